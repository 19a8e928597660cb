// SPDX-License-Identifier: Apache-2.0
//
// Both servos, their common frame and the watchdog that stills them.
//
//               frame of 20 ms
// servo_o[0]  __|^^^^^|__________________|^^^^^|____
// servo_o[1]  __|^^^^^^^^^^|_____________|^^^^^^^|__
//
// written_i: a register is written; the watchdog wants that now and then. word_i: the register at
// place_o, but not while busy_i; a width that is being calculated then restarts.
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
  output wire [3:0]  place_o,
  input  wire [15:0] word_i,
  input  wire        busy_i,
  output wire        store_o,
  output wire [15:0] store_q4_o,
  input  wire        stored_i,
  output wire [1:0]  servo_o,
  output wire [1:0]  active_o,
  output wire [1:0]  finished_o
);

`ifdef PROVE_MOTION
  wire armed;
  wire fresh;
  wire [14:0] phase;
  wire [14:0] period;
  wire [15:0] actual0;
  wire [15:0] actual1;
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
  wire work;
  wire early;
  wire idle;
  wire [11:0] phase_us;
  wire [4:0] sub_clock;
  // word_i is the period when its place was asked for in the clock before, and nothing else was at
  // work then.
  reg period_there;
  always @(posedge clk_i or posedge rst_i) begin
    if (rst_i) period_there <= 1'b0;
    else period_there <= idle && !busy_i;
  end

  servo_frame frames (
    .clk_i(clk_i),
    .rst_i(rst_i),
    .tick_us_i(tick_us_i),
    .period_us_i(word_i[14:0]),
    .period_there_i(period_there),
`ifdef PROVE_MOTION
    .phase_o(phase),
    .period_o(period),
`endif
    .frame_o(frame),
    .work_o(work),
    .phase_us_o(phase_us),
    .early_o(early),
    .sub_clock_o(sub_clock)
  );

  wire [1:0] may_load;
  wire [1:0] load;
  servo_width widths (
    .clk_i(clk_i),
    .rst_i(rst_i),
    .start_i(work),
    .restart_i(busy_i),
    .safe_i(safe),
    .take_i(may_load & {2{!hold}}),
`ifdef PROVE_MOTION
    .fresh_o(fresh),
`endif
    .idle_o(idle),
    .place_o(place_o),
    .word_i(word_i),
    .store_o(store_o),
    .stored_i(stored_i),
    .load_o(load),
    .next_q4_o(store_q4_o)
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
    .load_i(load[0]),
    .next_q4_i(store_q4_o),
    .may_load_o(may_load[0]),
`ifdef PROVE_MOTION
    .actual_o(actual0),
    .whole_past_o(whole_past[0]),
`endif
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
    .load_i(load[1]),
    .next_q4_i(store_q4_o),
    .may_load_o(may_load[1]),
`ifdef PROVE_MOTION
    .actual_o(actual1),
    .whole_past_o(whole_past[1]),
`endif
    .servo_o(servo_o[1]),
    .active_o(active_o[1]),
    .finished_o(finished_o[1])
  );

`ifdef PROVE_MOTION
  motion_properties properties (
    .clk_i(clk_i), .rst_i(rst_i), .soft_rst_i(soft_rst_i), .tick_us_i(tick_us_i),
    .written_i(written_i), .action_i(watchdog_action_i), .fired_i(watchdog_fired_o),
    .armed_i(armed), .fresh_i(fresh), .enable_i(enable_i), .place_i(place_o), .word_i(word_i),
    .busy_i(busy_i), .idle_i(idle), .store_i(store_o), .stored_i(stored_i),
    .next_q4_i(store_q4_o), .may_load_i(may_load), .load_i(load), .frame_i(frame),
    .work_i(work), .phase_us_i(phase_us), .early_i(early), .sub_clock_i(sub_clock),
    .phase_i(phase), .period_i(period), .servo_i(servo_o), .active_i(active_o),
    .finished_i(finished_o), .actual0_i(actual0), .actual1_i(actual1),
    .whole_past_i(whole_past)
  );
`endif

endmodule

`default_nettype wire
