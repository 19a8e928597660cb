// SPDX-License-Identifier: Apache-2.0
// Time base of the servo frames, shared by both channels.
//
// Counts microseconds and marks the start of every frame. The last microsecond of a count is the
// first one of the next frame, so that no subtraction of one is needed anywhere:
//
//   tick_us_i    _|'|_______|'|_______|'|_______|'|_______|'|__
//   phase_us     P-2 |  P-1    |    P    |    1    |    2          P: the period in use
//   frame_o      _______________|'|____________________________    first clock of phase P
//   load_o       changes of the widths: channel 0 at the end of phase 31, 1 at the end of phase 63
//   sub_clock_o  ... |0 1 2 ..  |0 1 2 .. |0 1 2 .. |0 1 2 ..      clocks since the last tick
//
// The period is taken over at the end of a frame's first microsecond. The register file takes none
// outside 15 000 .. 25 000 us.
// A width is worked out for channel_o, which is steady for 31 ticks before its load_o: all before
// any pulse may end.
//
// Latency: frame_o is high in the clock after the tick.
`default_nettype none

module servo_frame (
  input  wire        clk_i,
  input  wire        rst_i,
  input  wire        tick_us_i,
  input  wire [14:0] period_us_i,
`ifdef PROVE_MOTION
  output wire [14:0] phase_o,
  output wire [14:0] period_o,
`endif
  output wire        frame_o,      // one clock: a frame starts
  output wire        channel_o,    // whose width is worked out ...
  output wire [1:0]  load_o,       // ... and one clock: may change now
  output wire [11:0] phase_us_o,   // microseconds since then, modulo 4096 ...
  output wire        early_o,      // ... and this is 1 while there were fewer than 4096
  output wire [4:0]  sub_clock_o   // clocks since the last tick, modulo 32
);
  localparam [14:0] RESET_US = 15'd20000;
`ifdef PROVE_LATE
  localparam [14:0] FIRST_US = 15'd19990;  // for proofs: the first frame comes soon after reset
`else
  localparam [14:0] FIRST_US = 15'd1;
`endif

  reg [14:0] phase;
  reg [14:0] period;
  reg        fresh;
  reg        channel;
  reg [4:0]  sub_clock;

  wire last = (phase == period);

  always @(posedge clk_i or posedge rst_i) begin
    if (rst_i) begin
      phase <= FIRST_US;
      period <= RESET_US;
      fresh <= 1'b0;
      channel <= 1'b0;
      sub_clock <= 5'd0;
    end else begin
      fresh <= tick_us_i;
      channel <= phase[14:5] != 10'd0;
      sub_clock <= tick_us_i ? 5'd0 : sub_clock + 5'd1;
      if (tick_us_i) begin
        phase <= last ? 15'd1 : phase + 15'd1;
        if (last) period <= period_us_i;
      end
    end
  end

  assign frame_o = fresh && last;
  assign phase_us_o = phase[11:0];
  assign early_o = (phase[14:12] == 3'd0);
  assign sub_clock_o = sub_clock;
  assign channel_o = channel;
  assign load_o = {phase[14:5] == 10'd1, phase[14:5] == 10'd0} & {2{tick_us_i && &phase[4:0]}};

`ifdef PROVE_MOTION
  assign phase_o = phase;
  assign period_o = period;
`elsif FORMAL
  servo_frame_properties properties (
    .clk_i(clk_i), .rst_i(rst_i), .tick_us_i(tick_us_i), .period_us_i(period_us_i),
    .frame_o(frame_o), .channel_o(channel_o), .load_o(load_o),
    .phase_us_o(phase_us_o), .early_o(early_o), .sub_clock_o(sub_clock_o),
    .phase_i(phase), .period_i(period)
  );
`endif
endmodule

`default_nettype wire
