// SPDX-License-Identifier: Apache-2.0
// One servo channel: the pulse, and when it may change.
//
// Widths are in 1/16 us (12.4 bits). The pulse ends width/16 whole ticks plus
// floor(fraction * 25 / 16) clocks (of 25 MHz) after its start; a tick that comes before these
// clocks have passed ends it as well (idle simulation, a tick every clock: the width in us rounded
// up).
//
//   frame_i      _|'|______________________________________________|'|__
//   servo_o      ___|''''''''''''''''''''|__________________________|'''
//                   |<-- actual_q4_o --->|
//   enable_i     ''''''''|____________|'''''''''''''''''''''''''''''''''    the pulse is finished
//   load_i       _____|'|____________________________________________|'|__
//   actual_q4_o  -------X----------------- one frame ------------------X--    new only there
//
// enable and off_i (no pulses) take effect with a frame. The width changes only by load_i, which
// servo_frame gives before any pulse may end, and only if the frame has a pulse.
//
// Latency: servo_o rises in the clock after frame_i.
`default_nettype none

module servo_pwm (
  input  wire        clk_i,
  input  wire        rst_i,
  input  wire        frame_i,       // from servo_frame, as the next three
  input  wire [11:0] phase_us_i,
  input  wire        early_i,
  input  wire [4:0]  sub_clock_i,
  input  wire        enable_i,
  input  wire        off_i,
  input  wire        load_i,        // take next_q4_i, from servo_width
  input  wire [15:0] next_q4_i,
`ifdef PROVE_MOTION
  output wire        whole_past_o,
`endif
  output wire [15:0] actual_q4_o,
  output wire        servo_o,
  output wire        active_o,      // this frame has a pulse
  output wire        finished_o     // one clock: a pulse ends
);
  localparam [15:0] CENTRE_Q4 = 16'd24000;  // 1500 us

  reg [15:0] actual;
  reg        active;
  reg        pulse;
  reg        whole_past;
  wire [4:0] fraction_clocks;

  wire send = enable_i && !off_i;
  wire whole = early_i && (phase_us_i == actual[15:4]);
  wire finish = whole ? (sub_clock_i == fraction_clocks) : whole_past;

  // floor(fraction * 25 / 16), each bit a table of 16 entries
  genvar place, fraction;
  generate
    for (place = 0; place < 5; place = place + 1) begin : fraction_bit
      wire [15:0] column;
      for (fraction = 0; fraction < 16; fraction = fraction + 1) begin : entry
        assign column[fraction] = (((fraction * 25 / 16) >> place) % 2) == 1;
      end
      assign fraction_clocks[place] = column[actual[3:0]];
    end
  endgenerate

  always @(posedge clk_i or posedge rst_i) begin
    if (rst_i) begin
      actual <= CENTRE_Q4;
      active <= 1'b0;
      pulse <= 1'b0;
      whole_past <= 1'b0;
    end else begin
      whole_past <= whole;
      if (load_i && active) actual <= next_q4_i;
      if (frame_i) begin
        active <= send;
        pulse <= send;
      end else if (finished_o) begin
        pulse <= 1'b0;
      end
    end
  end

  assign actual_q4_o = actual;
  assign servo_o = pulse;
  assign active_o = active;
  assign finished_o = pulse && finish && !frame_i;

`ifdef PROVE_MOTION
  assign whole_past_o = whole_past;
`elsif FORMAL
  servo_pwm_properties properties (
    .clk_i(clk_i), .rst_i(rst_i), .frame_i(frame_i), .phase_us_i(phase_us_i), .early_i(early_i),
    .sub_clock_i(sub_clock_i), .enable_i(enable_i), .off_i(off_i), .load_i(load_i),
    .next_q4_i(next_q4_i), .servo_o(servo_o), .active_o(active_o), .actual_i(actual),
    .finished_o(finished_o), .whole_past_i(whole_past)
  );
`endif
endmodule

`default_nettype wire
