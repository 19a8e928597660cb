// SPDX-License-Identifier: Apache-2.0
// Properties of one servo's pin; see motion_properties.v.
`default_nettype none

module motion_channel_properties (
  input wire        clk_i,
  input wire        rst_i,
  input wire        tell_i,
  input wire        reset_i,         // in the clock before
  input wire        frame_i,
  input wire [14:0] ticks_i,         // since the frame, in the clock before
  input wire [14:0] now_i,           // in this clock
  input wire        enable_i,
  input wire        stopped_i,       // the watchdog lets no pulse begin
  input wire        held_i,          // ... no width change
  input wire        load_i,
  input wire [15:0] next_q4_i,
  input wire        servo_i,
  input wire        active_i,
  input wire        finished_i,
  input wire [15:0] actual_i,
  input wire        whole_past_i
);
  localparam [15:0] LOWEST_Q4 = 16'd9600;
  localparam [15:0] HIGHEST_Q4 = 16'd38400;

  wire [14:0] whole = {3'd0, actual_i[15:4]};
  reg [15:0] actual, next;           // values of the clock before
  reg        begins, held, load, servo;
  always @(posedge clk_i) begin
    actual <= actual_i;
    next <= next_q4_i;
    begins <= frame_i && enable_i && !stopped_i;
    held <= held_i;
    load <= load_i && active_i && !held_i;
    servo <= servo_i;
    if (tell_i) begin
      a_limits: assert (actual_i >= LOWEST_Q4 && actual_i <= HIGHEST_Q4);
      a_longest: assert (!servo_i || ticks_i <= 15'd2400);
      if (!reset_i) begin
        a_starts: assert (!(servo_i && !servo) || begins);
        a_starts_always: assert (!begins || servo_i);
        a_shortest: assert (!(servo && !servo_i) || ticks_i >= 15'd600);
        a_ends_whole: assert (!(servo && !servo_i) || ticks_i >= whole);
        a_change_early: assert (actual_i == actual || (active_i && ticks_i < 15'd512));
        a_change_by_load: assert (actual_i == (load ? next : actual));
        a_held: assert (!held || actual_i == actual);
      end
      // Assumptions of the proof of servo_pwm.
      a_load: assert (!load_i || (now_i != 15'd0 && now_i < 15'd512));
      a_next: assert (next_q4_i >= LOWEST_Q4 && next_q4_i <= HIGHEST_Q4);
      a_finished: assert (!finished_i || servo_i);
      // Helps the induction.
      a_inside: assert (!servo_i || ticks_i < whole || (ticks_i == whole &&
                        (now_i == whole || whole_past_i)));
      a_whole_past: assert (reset_i || whole_past_i == (ticks_i == {3'd0, actual[15:4]}));
    end
  end
endmodule

`default_nettype wire
