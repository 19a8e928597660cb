// SPDX-License-Identifier: Apache-2.0
//
// Both servos, their common frame and the watchdog that stills them.
//
//               frame of 20 ms
// servo_o[0]  __|^^^^^|__________________|^^^^^|____
// servo_o[1]  __|^^^^^^^^^^|_____________|^^^^^^^|__
//
// written_i: a register is written; the watchdog wants that now and then. Both servos share
// servo_width: it works for servo 0 in the first 32 us of a frame, and for servo 1 in the next.
// Latency: see servo_pwm.

`default_nettype none

module motion (
  input  wire clk_i,
  input  wire rst_i,
  input  wire soft_rst_i,
  input  wire tick_us_i,
  input  wire tick_ms_i,
  input  wire written_i,

  input  wire [15:0] watchdog_ms_i,
  input  wire [1:0]  watchdog_action_i,
  input  wire        watchdog_clear_i,
  output wire        watchdog_fired_o,
  output wire        watchdog_event_o,

  input  wire [1:0]  enable_i,
  input  wire [14:0] period_us_i,
  input  wire [15:0] target0_q4_i,
  input  wire [15:0] target1_q4_i,
  input  wire [15:0] safe0_q4_i,
  input  wire [15:0] safe1_q4_i,
  input  wire [15:0] min0_q4_i,
  input  wire [15:0] min1_q4_i,
  input  wire [15:0] max0_q4_i,
  input  wire [15:0] max1_q4_i,
  input  wire [10:0] slew0_q4_i,
  input  wire [10:0] slew1_q4_i,
  output wire [15:0] actual0_q4_o,
  output wire [15:0] actual1_q4_o,
  output wire [1:0]  servo_o,
  output wire [1:0]  active_o,
  output wire [1:0]  finished_o
);

`ifdef PROVE_MOTION
  wire armed;
  wire [14:0] phase;
  wire [14:0] period;
  wire [1:0] whole_past;
`endif
  wire hold;
  wire safe;
  wire off;
  watchdog dog (
    .clk_i(clk_i),
    .rst_i(soft_rst_i),
    .tick_ms_i(tick_ms_i),
    .period_ms_i(watchdog_ms_i),
    .action_i(watchdog_action_i),
    .arm_i(|enable_i),
    .kick_i(written_i),
    .clear_i(watchdog_clear_i),
`ifdef PROVE_MOTION
    .armed_o(armed),
`endif
    .fired_o(watchdog_fired_o),
    .event_o(watchdog_event_o),
    .hold_o(hold),
    .safe_o(safe),
    .off_o(off)
  );

  wire frame;
  wire early;
  wire channel;
  wire [1:0] load;
  wire [11:0] phase_us;
  wire [4:0] sub_clock;
  servo_frame frames (
    .clk_i(clk_i),
    .rst_i(rst_i),
    .tick_us_i(tick_us_i),
    .period_us_i(period_us_i),
`ifdef PROVE_MOTION
    .phase_o(phase),
    .period_o(period),
`endif
    .frame_o(frame),
    .channel_o(channel),
    .load_o(load),
    .phase_us_o(phase_us),
    .early_o(early),
    .sub_clock_o(sub_clock)
  );

  wire [15:0] next_q4;
  servo_width widths (
    .clk_i(clk_i),
    .rst_i(rst_i),
    .request_q4_i(safe ? (channel ? safe1_q4_i : safe0_q4_i)
                       : (channel ? target1_q4_i : target0_q4_i)),
    .min_q4_i(channel ? min1_q4_i : min0_q4_i),
    .max_q4_i(channel ? max1_q4_i : max0_q4_i),
    .slew_q4_i(channel ? slew1_q4_i : slew0_q4_i),
    .actual_q4_i(channel ? actual1_q4_o : actual0_q4_o),
    .next_q4_o(next_q4)
  );

  servo_pwm servo0 (
    .clk_i(clk_i),
    .rst_i(rst_i),
    .frame_i(frame),
    .phase_us_i(phase_us),
    .early_i(early),
    .sub_clock_i(sub_clock),
    .enable_i(enable_i[0]),
    .off_i(off),
    .load_i(load[0] && !hold),
    .next_q4_i(next_q4),
`ifdef PROVE_MOTION
    .whole_past_o(whole_past[0]),
`endif
    .actual_q4_o(actual0_q4_o),
    .servo_o(servo_o[0]),
    .active_o(active_o[0]),
    .finished_o(finished_o[0])
  );

  servo_pwm servo1 (
    .clk_i(clk_i),
    .rst_i(rst_i),
    .frame_i(frame),
    .phase_us_i(phase_us),
    .early_i(early),
    .sub_clock_i(sub_clock),
    .enable_i(enable_i[1]),
    .off_i(off),
    .load_i(load[1] && !hold),
    .next_q4_i(next_q4),
`ifdef PROVE_MOTION
    .whole_past_o(whole_past[1]),
`endif
    .actual_q4_o(actual1_q4_o),
    .servo_o(servo_o[1]),
    .active_o(active_o[1]),
    .finished_o(finished_o[1])
  );

`ifdef PROVE_MOTION
  motion_properties properties (
    .clk_i(clk_i), .rst_i(rst_i), .soft_rst_i(soft_rst_i), .tick_us_i(tick_us_i),
    .written_i(written_i), .action_i(watchdog_action_i), .fired_i(watchdog_fired_o),
    .armed_i(armed), .enable_i(enable_i), .period_us_i(period_us_i), .channel_i(channel),
    .target_q4_i({target1_q4_i, target0_q4_i}), .safe_q4_i({safe1_q4_i, safe0_q4_i}),
    .min_q4_i({min1_q4_i, min0_q4_i}), .max_q4_i({max1_q4_i, max0_q4_i}),
    .slew_q4_i({slew1_q4_i, slew0_q4_i}), .next_q4_i(next_q4), .load_i(load), .frame_i(frame),
    .phase_us_i(phase_us), .early_i(early), .sub_clock_i(sub_clock), .phase_i(phase),
    .period_i(period), .servo_i(servo_o), .active_i(active_o), .finished_i(finished_o),
    .actual_q4_i({actual1_q4_o, actual0_q4_o}), .whole_past_i(whole_past)
  );
`endif

endmodule

`default_nettype wire
