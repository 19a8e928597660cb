// SPDX-License-Identifier: Apache-2.0
// Properties of the servos' pins for any contents of the registers, except for the period of the
// frames, which the register file keeps inside its limits. What the proofs of the parts assume of
// each other is asserted here.
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
  input wire [1:0]  enable_i,
  input wire [14:0] period_us_i,
  input wire [31:0] target_q4_i,     // of servo 1 and 0
  input wire [31:0] safe_q4_i,
  input wire [31:0] min_q4_i,
  input wire [31:0] max_q4_i,
  input wire [21:0] slew_q4_i,
  input wire        channel_i,
  input wire [15:0] next_q4_i,
  input wire [1:0]  load_i,
  input wire        frame_i,
  input wire [11:0] phase_us_i,
  input wire        early_i,
  input wire [4:0]  sub_clock_i,
  input wire [14:0] phase_i,
  input wire [14:0] period_i,
  input wire [1:0]  servo_i,
  input wire [1:0]  active_i,
  input wire [1:0]  finished_i,
  input wire [31:0] actual_q4_i,
  input wire [1:0]  whole_past_i
);
  localparam [1:0] HOLD = 2'd0;
  localparam [1:0] SAFE = 2'd1;

  reg        begun = 1'b0;
  reg        reset = 1'b1;            // values of the clock before
  reg        fresh, written, enabled, fired;
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
  // The width that a servo, chosen by the solver, should get next.
  (* anyconst *) wire chosen;
  wire [15:0] request = safe ? safe_q4_i[16*chosen +: 16] : target_q4_i[16*chosen +: 16];
  wire [74:0] inputs = {request, min_q4_i[16*chosen +: 16], max_q4_i[16*chosen +: 16],
                        slew_q4_i[11*chosen +: 11], actual_q4_i[16*chosen +: 16]};
  reg [74:0] before;
  reg [2:0]  steady;                  // clocks in which the inputs were as now
  wire [15:0] next;
  servo_width_model model (
    .request_i(request), .min_i(inputs[58:43]), .max_i(inputs[42:27]), .slew_i(inputs[26:16]),
    .actual_i(inputs[15:0]), .next_o(next)
  );

  always @(posedge clk_i) begin
    if (!begun) assume (rst_i);
    assume (!rst_i || soft_rst_i);
    assume (period_us_i >= 15'd15000 && period_us_i <= 15'd25000);
    begun <= 1'b1;
    reset <= rst_i;
    fresh <= tick_us_i && !rst_i;
    before <= inputs;
    steady <= rst_i ? 3'd0 : inputs != before ? 3'd1 : steady == 3'd7 ? steady : steady + 3'd1;
    written <= written_i && !soft_rst_i;
    fired <= fired_i && !soft_rst_i;
    enabled <= !soft_rst_i && (enabled || enable_i != 2'd0);
    first_us <= !rst_i && (frame_i || first_us) && !tick_us_i;
    if (rst_i) wanted <= 15'd20000;
    else if (tick_us_i && (frame_i || first_us)) wanted <= period_us_i;

    if (begun && !rst_i) begin
      // Assumptions of the proof of servo_pwm.
      a_frame_fresh: assert (!frame_i || fresh);
      a_frames_apart: assert ((!frame_i || ticks >= 15'd14999) && now <= 15'd25000);
      a_early: assert (early_i == (now != 15'd0 && now < 15'd4096));
      a_phase: assert (!early_i || phase_us_i == now[11:0]);
      a_sub: assert (reset || sub_clock_i == sub);
      // Of the watchdog and the registers.
      a_period: assert (!frame_i || ticks + 15'd1 == wanted);
      a_width: assert (!load_i[chosen] || steady < 3'd5 || inputs != before || next_q4_i == next);
      a_armed_by_a_servo: assert (!fired_i || enabled);
      a_write_keeps_it_quiet: assert (!(fired_i && !fired) || !written);
      // Helps the induction.
      a_time: assert (period_i == wanted && wanted >= 15'd15000 && wanted <= 15'd25000
        && phase_i != 15'd0 && phase_i <= period_i
        && (phase_i == period_i ? now == 15'd0 : now == phase_i)
        && (first_us || frame_i) == (now == 15'd0));
      a_armed: assert (!armed_i || enabled);
      a_centre: assert (!reset || actual_q4_i == {2{16'd24000}});
    end
  end

  genvar k;
  generate
    for (k = 0; k < 2; k = k + 1) begin : channel
      motion_channel_properties view (
        .clk_i(clk_i), .rst_i(rst_i), .tell_i(begun && !rst_i), .reset_i(reset), .frame_i(frame_i),
        .ticks_i(ticks), .now_i(now), .enable_i(enable_i[k]), .stopped_i(fired_i && action_i[1]),
        .held_i(fired_i && action_i == HOLD), .load_i(load_i[k]), .next_q4_i(next_q4_i),
        .servo_i(servo_i[k]), .active_i(active_i[k]), .finished_i(finished_i[k]),
        .actual_i(actual_q4_i[16*k +: 16]), .whole_past_i(whole_past_i[k])
      );
    end
  endgenerate

  always @(posedge clk_i) begin
    c_pulses: cover (begun && !rst_i && servo_i == 2'b11);
    c_off: cover (begun && !rst_i && fired_i && action_i[1] && servo_i == 2'b01);
  end
endmodule

`default_nettype wire
