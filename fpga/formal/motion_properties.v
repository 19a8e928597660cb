// SPDX-License-Identifier: Apache-2.0
// Properties of the servos' pins for any contents of the registers: word_i is free, except for the
// period of the frames, which the register file keeps inside its limits. Proved of the real
// servo_frame, servo_pwm and watchdog, and of servo_width by its properties. What the proofs of
// these modules assume of each other is asserted here.
`default_nettype none

module motion_properties (
  input wire        clk_i,
  input wire        rst_i,
  input wire        soft_rst_i,
  input wire        tick_us_i,
  input wire        written_i,
  input wire [1:0]  action_i,
  input wire        fired_i,
  input wire        armed_i,
  input wire        fresh_i,         // servo_width stores the centre, as after reset
  input wire [1:0]  enable_i,
  input wire [3:0]  place_i,
  input wire [15:0] word_i,
  input wire        busy_i,
  input wire        idle_i,
  input wire        store_i,
  input wire        stored_i,
  input wire [15:0] next_q4_i,
  input wire [1:0]  may_load_i,
  input wire [1:0]  load_i,
  input wire        frame_i,
  input wire        work_i,
  input wire [11:0] phase_us_i,
  input wire        early_i,
  input wire [4:0]  sub_clock_i,
  input wire [14:0] phase_i,
  input wire [14:0] period_i,
  input wire [1:0]  servo_i,
  input wire [1:0]  active_i,
  input wire [1:0]  finished_i,
  input wire [15:0] actual0_i,
  input wire [15:0] actual1_i,
  input wire [1:0]  whole_past_i
);
  localparam [1:0] HOLD = 2'd0;
  localparam [1:0] SAFE = 2'd1;

  reg        begun = 1'b0;
  reg        reset = 1'b1;            // values of the clock before
  reg        fresh, before_safe, written, enabled, fired;
  reg        first_us;
  reg [14:0] wanted;                  // the period that was taken last
  wire [14:0] ticks, now;
  wire [4:0]  clocks, sub;
  wire        long_us;
  servo_clockwork clockwork (
    .clk_i(clk_i), .rst_i(rst_i), .fresh_i(fresh), .frame_i(frame_i), .ticks_o(ticks),
    .clocks_o(clocks), .long_o(long_us), .now_o(now), .sub_o(sub)
  );
  wire       safe = fired_i && action_i == SAFE;
  // A register's word arrives in the clock after its place was selected, but not while the bus or
  // the filling of the memory was active (a_memory_word of the register file).
  localparam [3:0] PERIOD_AT = 4'd15;
  reg        there;

  always @(posedge clk_i) begin
    if (!begun) assume (rst_i);
    assume (!rst_i || soft_rst_i);
    if (there) assume (word_i >= 16'd15000 && word_i <= 16'd25000);
    assume (!stored_i || (store_i && !busy_i));
    begun <= 1'b1;
    reset <= rst_i;
    fresh <= tick_us_i && !rst_i;
    there <= !rst_i && place_i == PERIOD_AT && !busy_i;
    before_safe <= safe && !rst_i;
    written <= written_i && !soft_rst_i;
    fired <= fired_i && !soft_rst_i;
    enabled <= !soft_rst_i && (enabled || enable_i != 2'd0);
    first_us <= !rst_i && (frame_i || first_us) && !tick_us_i;
    if (rst_i) wanted <= 15'd20000;
    else if (tick_us_i && (frame_i || first_us) && there) wanted <= word_i[14:0];

    if (begun && !rst_i) begin
      // Assumptions of the proof of servo_pwm.
      a_frame_fresh: assert (!frame_i || fresh);
      a_frames_apart: assert ((!frame_i || ticks >= 15'd14999) && now <= 15'd25000);
      a_early: assert (early_i == (now != 15'd0 && now < 15'd4096));
      a_phase: assert (!early_i || phase_us_i == now[11:0]);
      a_sub: assert (reset || sub_clock_i == sub);
      // Of the watchdog and the places of the registers.
      a_period: assert (!frame_i || ticks + 15'd1 == wanted);
      a_work: assert (work_i == (tick_us_i && (frame_i || first_us)));
      a_safe_reads_safe: assert (reset || !(before_safe ? place_i[2:0] == 3'd0
                                                        : place_i[2:0] == 3'd4));
      a_armed_by_a_servo: assert (!fired_i || enabled);
      a_write_keeps_it_quiet: assert (!(fired_i && !fired) || !written);
      // Helps the induction.
      a_time: assert (period_i == wanted && wanted >= 15'd15000 && wanted <= 15'd25000
        && phase_i != 15'd0 && phase_i <= period_i
        && (phase_i == period_i ? now == 15'd0 : now == phase_i)
        && (first_us || frame_i) == (now == 15'd0));
      a_armed: assert (!armed_i || enabled);
      a_centre: assert (!fresh_i || (actual0_i == 16'd24000 && actual1_i == 16'd24000));
    end
  end

  genvar k;
  generate
    for (k = 0; k < 2; k = k + 1) begin : channel
      motion_channel_properties view (
        .clk_i(clk_i), .rst_i(rst_i), .tell_i(begun && !rst_i), .reset_i(reset), .frame_i(frame_i),
        .ticks_i(ticks), .now_i(now), .enable_i(enable_i[k]), .stopped_i(fired_i && action_i[1]),
        .held_i(fired_i && action_i == HOLD), .may_load_i(may_load_i[k]), .load_i(load_i[k]),
        .next_q4_i(next_q4_i),
        .servo_i(servo_i[k]), .active_i(active_i[k]), .finished_i(finished_i[k]),
        .actual_i(k == 0 ? actual0_i : actual1_i), .whole_past_i(whole_past_i[k])
      );
    end
  endgenerate

  always @(posedge clk_i) begin
    c_pulses: cover (begun && !rst_i && servo_i == 2'b11);
    c_off: cover (begun && !rst_i && fired_i && action_i[1] && servo_i == 2'b01);
  end
endmodule

`default_nettype wire
