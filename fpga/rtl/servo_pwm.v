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
//   actual_q4_o  ---X----------------- one frame ------------------X----    new only here
//
// Everything takes effect with a frame: enable (from the width reached so far, 1500 us after
// reset), disable, hold_i (the width stays), safe_i (goes to the safe position at the slew rate),
// off_i (no pulses). While there are no pulses the width stays as it is.
// The width is what servo_width has ready: a write within its round (129 clocks, 5.2 us) before a
// frame counts for the frame after.
//
// Latency: servo_o rises in the clock after frame_i.
`default_nettype none

module servo_pwm (
  input  wire        clk_i,
  input  wire        rst_i,
  input  wire        frame_i,       // from servo_frame, as the next four
  input  wire [11:0] phase_us_i,
  input  wire        early_i,
  input  wire [4:0]  sub_clock_i,
  input  wire [5:0]  step_i,
  input  wire        changed_i,     // a register changes in this clock or the next
  input  wire        enable_i,
  input  wire        hold_i,
  input  wire        safe_i,
  input  wire        off_i,
  input  wire [15:0] target_q4_i,
  input  wire [15:0] min_q4_i,
  input  wire [15:0] max_q4_i,
  input  wire [15:0] safe_q4_i,
  input  wire [10:0] slew_q4_i,
  output wire        servo_o,
  output wire        active_o,      // this frame has a pulse
  output wire [15:0] actual_q4_o,
  output wire [7:0]  frames_o       // pulses finished, wraps
);
  localparam [15:0] CENTRE_Q4 = 16'd24000;  // 1500 us

  reg [15:0] actual;
  reg        active;
  reg        pulse;
  reg        whole_past;
  reg [7:0]  frames;
  wire [4:0] fraction_clocks;
  wire       ready;
  wire [15:0] next_q4;

  servo_width width (
    .clk_i(clk_i), .rst_i(rst_i), .step_i(step_i), .changed_i(changed_i || frame_i),
    .safe_i(safe_i), .target_q4_i(target_q4_i), .safe_q4_i(safe_q4_i), .min_q4_i(min_q4_i),
    .max_q4_i(max_q4_i), .slew_q4_i(slew_q4_i), .actual_q4_i(actual), .ready_o(ready),
    .next_q4_o(next_q4)
  );

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
      frames <= 8'd0;
    end else begin
      whole_past <= whole;
      if (frame_i) begin
        active <= send;
        pulse <= send;
        if (send && ready && !hold_i) begin
          actual <= next_q4;
        end
      end else if (pulse && finish) begin
        pulse <= 1'b0;
        frames <= frames + 8'd1;
      end
    end
  end

  assign servo_o = pulse;
  assign active_o = active;
  assign actual_q4_o = actual;
  assign frames_o = frames;

`ifdef FORMAL
  servo_pwm_properties properties (
    .clk_i(clk_i), .rst_i(rst_i), .frame_i(frame_i), .phase_us_i(phase_us_i), .early_i(early_i),
    .sub_clock_i(sub_clock_i), .enable_i(enable_i), .hold_i(hold_i), .off_i(off_i),
    .servo_o(servo_o), .active_o(active_o), .actual_q4_o(actual_q4_o), .frames_o(frames_o),
    .ready_i(ready), .next_q4_i(next_q4), .whole_past_i(whole_past)
  );
`endif
endmodule

`default_nettype wire
