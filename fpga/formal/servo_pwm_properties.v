// SPDX-License-Identifier: Apache-2.0
// The pulse of a servo. Inputs from servo_frame are as its assertions marked (*) promise; the next
// width, and when it comes, as those of servo_width promise; all else is free.
`default_nettype none

module servo_pwm_properties (
  input wire        clk_i,
  input wire        rst_i,
  input wire        frame_i,
  input wire [11:0] phase_us_i,
  input wire        early_i,
  input wire [4:0]  sub_clock_i,
  input wire        enable_i,
  input wire        off_i,
  input wire        load_i,
  input wire [15:0] next_q4_i,
  input wire        servo_o,
  input wire        active_o,
  input wire [15:0] actual_i,
  input wire        finished_o,
  input wire        whole_past_i
);
  reg        begun = 1'b0;
  reg        reset = 1'b1;            // values of the clock before
  reg        frame, send, servo, load;
  reg [15:0] actual, next_q4;
  reg        finished;
  reg [4:0]  clocks2;
  reg [14:0] ticks2;

  // ---- time, as servo_frame keeps it ----
  (* anyseq *) wire fresh;
  wire [14:0] ticks, now;
  wire [4:0]  clocks, sub;
  wire        long_us;
  servo_clockwork clockwork (
    .clk_i(clk_i), .rst_i(rst_i), .fresh_i(fresh), .frame_i(frame_i), .ticks_o(ticks),
    .clocks_o(clocks), .long_o(long_us), .now_o(now), .sub_o(sub)
  );
  always @(posedge clk_i) begin
    if (!begun) assume (rst_i);
    if (!rst_i) begin
      assume (!frame_i || fresh);
      assume (!frame_i || ticks >= 15'd14999);
      assume (now <= 15'd25000);
      assume (early_i == (now != 15'd0 && now < 15'd4096));
      assume (!early_i || phase_us_i == now[11:0]);
      assume (reset || sub_clock_i == sub);
      assume (!load_i || (now != 15'd0 && now < 15'd512));
      assume (!load_i || (next_q4_i >= 16'd9600 && next_q4_i <= 16'd38400));
    end
  end

  // ---- length of the pulse ----
  wire [14:0] whole = {3'd0, actual_i[15:4]};
  wire [8:0]  product = {5'd0, actual_i[3:0]} * 9'd25;
  wire [4:0]  fraction = product[8:4];

  always @(posedge clk_i) begin
    begun <= 1'b1;
    reset <= rst_i;
    frame <= frame_i;
    send <= enable_i && !off_i;
    servo <= servo_o;
    load <= load_i && active_o;
    actual <= actual_i;
    next_q4 <= next_q4_i;
    finished <= finished_o;
    clocks2 <= clocks;
    ticks2 <= ticks;
    if (begun && !rst_i) begin
      a_hardware_limits: assert (actual_i >= 16'd9600 && actual_i <= 16'd38400);
      if (!reset) begin
        a_change_by_load: assert (actual_i == (load ? next_q4 : actual));
        a_change_early: assert (actual_i == actual || (ticks < 15'd512 && active_o));
        a_no_missed_frame: assert (!(frame && send) || (servo_o && active_o));
        a_starts_with_frame: assert (!(servo_o && !servo) || (frame && send));
        a_off: assert (!(frame && !send) || (!servo_o && !active_o));
        a_length: assert (!(servo && !servo_o && !frame) ||
                          (ticks == whole && clocks == fraction && !long_us) ||
                          (ticks == whole + 15'd1 && clocks == 5'd0 && ticks2 == whole &&
                           clocks2 < fraction));
        a_finished: assert (finished == (servo && !servo_o && !frame));
      end
      a_high_inside: assert (!servo_o || ticks < whole ||
                             (ticks == whole && clocks < fraction && !long_us));
      a_only_when_active: assert (!servo_o || active_o);
      c_pulse: cover (servo_o && now == 15'd2);
      c_load: cover (load_i && next_q4_i == 16'd9601);
      // Helps the induction.
      a_whole_past: assert (reset || whole_past_i == (ticks == whole && actual == actual_i));
      a_reset_low: assert (!reset || (!servo_o && !active_o));
    end
  end
endmodule

`default_nettype wire
