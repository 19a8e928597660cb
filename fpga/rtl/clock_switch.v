// SPDX-License-Identifier: Apache-2.0
//
// The PPI clock: one of three clocks, or none. No phase of it is ever shorter than that phase of
// the source, whatever the clocks do: drift, stop high or low, come back at any moment.
//
// clock0_i   _|^|_|^|_|^|_|^|_|^|_|^|_|^|_|^|_|^|_|^|_|^|_|^|_|^|_
// clock1_i   |^^|__|^^|__|^^|__|^^|__|^^|__|^^|__|^^|__|^^|__|^^|_
// select_i   ==X= 001 =======X= 000 ======X= 010 ================
// clock_o    _______|^|_|^|_|^|_______________________|^^|__|^^|_
// busy_o     _____|^^^^^^^^^^^^^^|_______________|^^^^^^^^^^^^^^^
//
// select_i is one-hot or 0. A new clock starts only when the others have ended, in any order of
// requests. hold_i (a frame is passing; changes at falling edges of clock_o) delays the end.
// A stopped source cannot end in whole periods: force_i removes it when the output has been
// high for STUCK ticks (this makes one falling edge) or low for STUCK ticks (no edge). A clock that
// comes back first takes the permission away first, and then ends whole.
// STUCK: ticks of a microsecond; the true time is between STUCK - 1 and STUCK of them.

`default_nettype none

module clock_switch #(
  parameter STUCK = 5
) (
  input  wire clk_i,
  input  wire rst_i,
  input  wire tick_us_i,
  input  wire [2:0] select_i,
  input  wire hold_i,
  input  wire force_i,
  input  wire clock0_i,
  input  wire clock1_i,
  input  wire clock2_i,
`ifdef PROVE_STREAM_SWITCH
  output wire [2:0] legs_asked_o,
  output wire [2:0] legs_enabled_o,
  output wire stop_o,
  output wire busy_meta_o,
`endif
  output wire busy_o,
  output wire clock_o
);

  wire [2:0] asked;
  wire [2:0] enabled;
  wire [2:0] busy = asked | enabled;
  wire [2:0] gated;
  wire stop;

  clock_gate leg0 (
    .clk_i(clock0_i), .rst_i(rst_i), .stop_i(stop), .hold_i(hold_i),
    .want_i(select_i[0] && !busy[1] && !busy[2]), .asked_o(asked[0]),
    .enabled_o(enabled[0]), .clk_o(gated[0])
  );
  clock_gate leg1 (
    .clk_i(clock1_i), .rst_i(rst_i), .stop_i(stop), .hold_i(hold_i),
    .want_i(select_i[1] && !busy[0] && !busy[2]), .asked_o(asked[1]),
    .enabled_o(enabled[1]), .clk_o(gated[1])
  );
  clock_gate leg2 (
    .clk_i(clock2_i), .rst_i(rst_i), .stop_i(stop), .hold_i(hold_i),
    .want_i(select_i[2] && !busy[0] && !busy[1]), .asked_o(asked[2]),
    .enabled_o(enabled[2]), .clk_o(gated[2])
  );

  assign clock_o = gated[0] || gated[1] || gated[2];

  sync_bit any_busy (
    .clk_i(clk_i),
    .rst_i(rst_i),
    .level_i(|busy),
`ifdef PROVE_STREAM_SWITCH
    .meta_o(busy_meta_o),
`endif
    .level_o(busy_o)
  );

  // The output itself clears these chains, so no edge of clk_i is needed to see a clock come back.
`ifdef FORMAL
  wire standing;
  time_step clearing (.level_i(clock_o), .level_o(standing));
`else
  wire standing = clock_o;
`endif
  wire low_ends = rst_i || standing;
  wire high_ends = rst_i || !standing;
  reg [STUCK-1:0] low;
  reg [STUCK-1:0] high;
  always @(posedge clk_i or posedge low_ends) begin
    if (low_ends) low <= {STUCK{1'b0}};
    else if (tick_us_i) low <= {low[STUCK-2:0], 1'b1};
  end
  always @(posedge clk_i or posedge high_ends) begin
    if (high_ends) high <= {STUCK{1'b0}};
    else if (tick_us_i) high <= {high[STUCK-2:0], 1'b1};
  end

  assign stop = force_i && (low[STUCK-1] || high[STUCK-1]);

`ifdef PROVE_STREAM_SWITCH
  assign legs_asked_o = asked;
  assign legs_enabled_o = enabled;
  assign stop_o = stop;
`endif
`ifdef PROVE_CLOCK_SWITCH
  clock_switch_properties #(.STUCK(STUCK)) properties (
    .clk_i(clk_i), .rst_i(rst_i), .tick_us_i(tick_us_i), .select_i(select_i), .hold_i(hold_i),
    .force_i(force_i), .clocks({clock2_i, clock1_i, clock0_i}), .clock_o(clock_o),
    .asked(asked), .enabled(enabled), .low(low), .high(high), .stop(stop)
  );
`endif

endmodule

`default_nettype wire
