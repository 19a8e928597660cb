// SPDX-License-Identifier: Apache-2.0
//
// The sensors' side of I2C: filters of the branches' lines and the router behind them.
//
//   DSP's bus (filtered by i2c_target) -> i2c_router -> branch_*_low_o
//   branch_*_i -> glitch_filter -> i2c_router -> sda_low_o
//
// scl_i     ^^^|_______|^^^^^^^^|___    DSP's bus
// branch    ^^^^^^|________|^^^^^|___   SCL of the branch that is meant, see i2c_router
//
// branch_*_o: the lines as filtered. Latency: that of the filter (2 + 3 clocks) and the router.

`default_nettype none

module sensor_bus (
  input  wire clk_i,
  input  wire rst_i,
  input  wire tick_us_i,
  input  wire tick_ms_i,
  input  wire enable_i,
  input  wire [1:0] bypass_i,
  input  wire [1:0] clear_i,

  input  wire scl_i,
  input  wire sda_i,
  input  wire start_i,
  input  wire stop_i,
  output wire sda_low_o,

  input  wire [1:0] branch_scl_i,
  input  wire [1:0] branch_sda_i,
  output wire [1:0] branch_scl_low_o,
  output wire [1:0] branch_sda_low_o,
  output wire [1:0] branch_scl_o,
  output wire [1:0] branch_sda_o,

  output wire clearing_o,
  output wire event_o            // one clock: a branch failed, stretched or timed out
);

  wire [3:0] lines = {branch_sda_i, branch_scl_i};
  wire [3:0] level;
  wire [3:0] spike;
  wire [3:0] sample;
  genvar i;
  generate
    for (i = 0; i < 4; i = i + 1) begin : line
      glitch_filter filter (
        .clk_i(clk_i),
        .rst_i(rst_i),
        .line_i(lines[i]),
        .level_o(level[i]),
        .sample_o(sample[i]),
        .spike_o(spike[i])
      );
    end
  endgenerate
  assign branch_scl_o = level[1:0];
  assign branch_sda_o = level[3:2];

  // Spikes are counted on the DSP's bus alone.
  wire unused = &{1'b0, spike, sample};

  wire [1:0] clearing;
  wire error;
  wire stretch;
  wire timeout;
  i2c_router router (
    .clk_i(clk_i),
    .rst_i(rst_i),
    .tick_us_i(tick_us_i),
    .tick_ms_i(tick_ms_i),
    .enable_i(enable_i),
    .bypass_i(bypass_i),
    .clear_i(clear_i),
    .scl_i(scl_i),
    .sda_i(sda_i),
    .start_i(start_i),
    .stop_i(stop_i),
    .sda_low_o(sda_low_o),
    .branch_scl_i(branch_scl_o),
    .branch_sda_i(branch_sda_o),
    .branch_scl_low_o(branch_scl_low_o),
    .branch_sda_low_o(branch_sda_low_o),
    .clearing_o(clearing),
    .error_o(error),
    .stretch_o(stretch),
    .timeout_o(timeout)
  );
  assign clearing_o = |clearing;
  assign event_o = error || stretch || timeout;

`ifdef PROVE_SENSOR_BUS
  sensor_bus_properties properties (
    .clk_i(clk_i), .rst_i(rst_i), .lines_i({branch_sda_i, branch_scl_i}),
    .levels_i({branch_sda_o, branch_scl_o}), .clearing_i(clearing), .clearing_o(clearing_o),
    .error_i(error), .stretch_i(stretch), .timeout_i(timeout), .event_o(event_o)
  );
`endif

endmodule

`default_nettype wire
