// SPDX-License-Identifier: Apache-2.0
// Proof only: the time within a servo frame, counted apart from the RTL. servo_frame is proved to
// agree with it, and servo_pwm is proved with inputs that agree with it.
`default_nettype none

module servo_clockwork (
  input  wire        clk_i,
  input  wire        rst_i,
  input  wire        fresh_i,    // first clock of a microsecond
  input  wire        frame_i,
  output reg  [14:0] ticks_o,    // microseconds since the frame, in the clock before
  output reg  [4:0]  clocks_o,   // clocks since the tick, in the clock before; modulo 32 ...
  output reg         long_o,     // ... and 1 if there were more
  output wire [14:0] now_o,      // microseconds since the frame, in this clock
  output wire [4:0]  sub_o
);
`ifdef PROVE_LATE
  localparam [14:0] FIRST_US = 15'd19990;  // the first frame comes soon after reset
`else
  localparam [14:0] FIRST_US = 15'd1;
`endif
  assign now_o = frame_i ? 15'd0 : fresh_i ? ticks_o + 15'd1 : ticks_o;
  assign sub_o = fresh_i ? 5'd0 : clocks_o + 5'd1;

  always @(posedge clk_i) begin
    if (rst_i) begin
      ticks_o <= FIRST_US;
      clocks_o <= 5'd31;
      long_o <= 1'b1;
    end else begin
      ticks_o <= now_o;
      clocks_o <= sub_o;
      long_o <= !fresh_i && (long_o || (clocks_o == 5'd31));
    end
  end
endmodule

`default_nettype wire
