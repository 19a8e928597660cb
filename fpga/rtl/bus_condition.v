// SPDX-License-Identifier: Apache-2.0
//
// Edges of SCL, START and STOP on an I2C bus, from filtered lines.
//
//              ____________________________          _______
// scl_i      _|                            |________|
//            ____________
// sda_i                  |________________________________
// start_o    ________________________|^|__________________    HOLD clocks after the edge of SDA
// scl_fall_o ______________________________|^|____________
//
// Data that moves as soon as SCL falls must not look like START or STOP, and spikes can make the
// filters show SDA's change up to 2 clocks early and SCL's fall up to 4 clocks late. Two rules:
// - SCL stays high, filtered, for HOLD clocks after the change of SDA.
// - Of the 5 samples of SCL before the last, at most 2 are low. Spikes of 50 ns that stand 200 ns
//   apart darken 2 of 5 samples at most, and a true fall hidden by one shows 3 of them.
// START and STOP need SCL high for HOLD clocks and 1 of sampling after the edge: 200 ns at 25 MHz,
// 222 ns at 22.5; at 1 MHz they last 260. Data may follow SCL's fall at once, spikes or not.
// scl_i, sda_i: filtered; scl_sample_i: the same SCL as sampled, 3 clocks ahead of scl_i.
// Latency: edges 0 clocks (combinational), START and STOP HOLD clocks.

`default_nettype none

module bus_condition #(
  parameter HOLD = 4
) (
  input  wire clk_i,
  input  wire rst_i,
  input  wire scl_i,
  input  wire scl_sample_i,
  input  wire sda_i,
  output wire scl_rise_o,
  output wire scl_fall_o,
  output wire start_o,
  output wire stop_o
);

  reg scl_last;
  reg sda_last;
  reg [HOLD-1:0] changed;
  reg [3:0] sampled;
  reg scl_mostly_high;
  wire [4:0] window = {sampled, scl_sample_i};
  wire [2:0] highs = {2'd0, window[0]} + {2'd0, window[1]} + {2'd0, window[2]}
    + {2'd0, window[3]} + {2'd0, window[4]};
  wire change = scl_i && scl_last && sda_i != sda_last;

  always @(posedge clk_i or posedge rst_i) begin
    if (rst_i) begin
      scl_last <= 1'b1;
      sda_last <= 1'b1;
      changed <= {HOLD{1'b0}};
      sampled <= 4'hF;
      scl_mostly_high <= 1'b1;
    end else begin
      scl_last <= scl_i;
      sda_last <= sda_i;
      sampled <= window[3:0];
      scl_mostly_high <= highs >= 3'd3;
      changed <= scl_i ? {changed[HOLD-2:0], change} : {HOLD{1'b0}};
    end
  end

  assign scl_rise_o = scl_i && !scl_last;
  assign scl_fall_o = !scl_i && scl_last;
  assign start_o = changed[HOLD-1] && scl_mostly_high && scl_i && !sda_i;
  assign stop_o = changed[HOLD-1] && scl_mostly_high && scl_i && sda_i;

`ifdef PROVE_BUS_CONDITION
  bus_condition_properties #(.HOLD(HOLD)) properties (
    .clk_i(clk_i), .rst_i(rst_i), .scl_i(scl_i), .scl_sample_i(scl_sample_i), .sda_i(sda_i),
    .scl_rise_o(scl_rise_o), .scl_fall_o(scl_fall_o), .start_o(start_o), .stop_o(stop_o),
    .scl_last_i(scl_last), .sda_last_i(sda_last)
  );
`endif

endmodule

`default_nettype wire
