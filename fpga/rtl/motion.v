// SPDX-License-Identifier: Apache-2.0
//
// Both servos, their common frame and the watchdog that stills them.
//
//               frame of 20 ms
// servo_o[0]  __|^^^^^|__________________|^^^^^|____
// servo_o[1]  __|^^^^^^^^^^|_____________|^^^^^^^|__
//
// written_i: a register is written; the watchdog wants that now and then, and a width that is being
// worked out starts anew. Latency: see servo_pwm.

`default_nettype none

module motion (
  input  wire clk_i,
  input  wire rst_i,
  input  wire soft_rst_i,
  input  wire tick_us_i,
  input  wire written_i,

  input  wire [15:0] watchdog_ms_i,
  input  wire [1:0]  watchdog_action_i,
  input  wire        watchdog_clear_i,
  output wire        watchdog_fired_o,
  output wire        watchdog_event_o,

  input  wire [14:0] period_us_i,
  input  wire [1:0]  enable_i,
  input  wire [15:0] servo0_target_q4_i,
  input  wire [15:0] servo0_min_q4_i,
  input  wire [15:0] servo0_max_q4_i,
  input  wire [15:0] servo0_safe_q4_i,
  input  wire [10:0] servo0_slew_q4_i,
  input  wire [15:0] servo1_target_q4_i,
  input  wire [15:0] servo1_min_q4_i,
  input  wire [15:0] servo1_max_q4_i,
  input  wire [15:0] servo1_safe_q4_i,
  input  wire [10:0] servo1_slew_q4_i,
  output wire [1:0]  servo_o,
  output wire [1:0]  active_o,
  output wire [15:0] servo0_actual_q4_o,
  output wire [15:0] servo1_actual_q4_o,
  output wire [7:0]  servo0_frames_o,
  output wire [7:0]  servo1_frames_o
);

  wire hold;
  wire safe;
  wire off;
  watchdog dog (
    .clk_i(clk_i),
    .rst_i(soft_rst_i),
    .tick_us_i(tick_us_i),
    .period_ms_i(watchdog_ms_i),
    .action_i(watchdog_action_i),
    .arm_i(|enable_i),
    .kick_i(written_i),
    .clear_i(watchdog_clear_i),
    .fired_o(watchdog_fired_o),
    .event_o(watchdog_event_o),
    .hold_o(hold),
    .safe_o(safe),
    .off_o(off)
  );

  wire frame;
  wire early;
  wire [11:0] phase_us;
  wire [4:0] sub_clock;
  wire [5:0] step;
  servo_frame frames (
    .clk_i(clk_i),
    .rst_i(rst_i),
    .tick_us_i(tick_us_i),
    .period_us_i(period_us_i),
    .frame_o(frame),
    .phase_us_o(phase_us),
    .early_o(early),
    .sub_clock_o(sub_clock),
    .step_o(step)
  );

  // A register is new a clock after its strobe; all of them are three clocks after a soft reset.
  reg [2:0] written;
  always @(posedge clk_i or posedge rst_i) begin
    if (rst_i) written <= 3'd0;
    else written <= {written[1:0], written_i};
  end
  wire changed = written_i || (|written);

  servo_pwm servo0 (
    .clk_i(clk_i),
    .rst_i(rst_i),
    .frame_i(frame),
    .phase_us_i(phase_us),
    .early_i(early),
    .sub_clock_i(sub_clock),
    .step_i(step),
    .changed_i(changed),
    .enable_i(enable_i[0]),
    .hold_i(hold),
    .safe_i(safe),
    .off_i(off),
    .target_q4_i(servo0_target_q4_i),
    .min_q4_i(servo0_min_q4_i),
    .max_q4_i(servo0_max_q4_i),
    .safe_q4_i(servo0_safe_q4_i),
    .slew_q4_i(servo0_slew_q4_i),
    .servo_o(servo_o[0]),
    .active_o(active_o[0]),
    .actual_q4_o(servo0_actual_q4_o),
    .frames_o(servo0_frames_o)
  );

  servo_pwm servo1 (
    .clk_i(clk_i),
    .rst_i(rst_i),
    .frame_i(frame),
    .phase_us_i(phase_us),
    .early_i(early),
    .sub_clock_i(sub_clock),
    .step_i(step),
    .changed_i(changed),
    .enable_i(enable_i[1]),
    .hold_i(hold),
    .safe_i(safe),
    .off_i(off),
    .target_q4_i(servo1_target_q4_i),
    .min_q4_i(servo1_min_q4_i),
    .max_q4_i(servo1_max_q4_i),
    .safe_q4_i(servo1_safe_q4_i),
    .slew_q4_i(servo1_slew_q4_i),
    .servo_o(servo_o[1]),
    .active_o(active_o[1]),
    .actual_q4_o(servo1_actual_q4_o),
    .frames_o(servo1_frames_o)
  );

endmodule

`default_nettype wire
