// SPDX-License-Identifier: Apache-2.0
//
// The whole bridge but for the board: prescaler, pads and vendor's cells are in boards/.
//
//   DSP's I2C -> i2c_target -> register_file -> everything
//            \-> i2c_router -> two branches with a sensor each
//   cameras -> video_path -> DSP's PPI
//   servo_frame -> two servo_pwm under one watchdog; trigger; interrupt
//
// tick_us_i     ____|^|__________________|^|____    one clock, every 25th; when idle every one
// *_low_o       1: pull the line down; the board joins it with *_i at the pad
// rst_i         at any time; each clock's own reset ends by its own edges
//
// Latency: see the modules. It only connects its parts.

`default_nettype none

module bridge_core #(
  parameter [15:0] BUILD = 16'd0
) (
  input  wire        rst_i,
  input  wire        clk_i,
  input  wire        tick_us_i,

  input  wire        scl_i,
  input  wire        sda_i,
  output wire        sda_low_o,
  input  wire [1:0]  branch_scl_i,
  input  wire [1:0]  branch_sda_i,
  output wire [1:0]  branch_scl_low_o,
  output wire [1:0]  branch_sda_low_o,

  input  wire [1:0]  pix_clk_i,
  input  wire [1:0]  frame_valid_i,
  input  wire [1:0]  line_valid_i,
  input  wire [9:0]  left_data_i,
  input  wire [9:0]  right_data_i,

  output wire        ppi_clk_o,
  output wire        ppi_fs1_o,  // line valid
  output wire        ppi_fs2_o,  // frame valid
  output wire        ppi_fs3_o,  // low
  output wire [9:0]  ppi_data_o,

  output wire [1:0]  servo_o,
  output wire        irq_o,
  output wire [1:0]  sensor_reset_n_o,
  output wire [1:0]  sensor_standby_o,
  output wire [1:0]  sensor_oe_o,
  output wire [1:0]  sensor_extclk_enable_o,
  output wire [1:0]  trigger_o
);

  assign ppi_fs3_o = 1'b0;

  // ---- registers
  wire rst, soft_rst;
  wire [7:0] index;
  wire index_known, reading, read_strobe, write_allowed, write_strobe;
  wire [15:0] read_data, write_data;
`include "register_file_instance.vh"
  assign build = BUILD;
  assign {caps_camera1, caps_router, caps_pattern} = 3'b111;
  assign {caps_trigger, caps_alternating, caps_tag} = 3'b111;
  assign status_irq_line = irq_o;
  assign status_switching = cam_state_switching;
  assign status_watchdog_fired = wdg_fired;
  assign {status_camera1_lost, status_camera0_lost} = {camera1_flags_lost, camera0_flags_lost};
  assign sensor_reset_n_o = sensor_reset_n;
  assign sensor_standby_o = sensor_standby;
  assign sensor_oe_o = sensor_oe;
  assign sensor_extclk_enable_o = sensor_extclk;

  // For the DSP alone.
  wire unused = &{1'b0, unlock, scratch};

  // ---- reset and time
  // The soft reset takes registers, counters and interrupt. What it must not cut (an answer on the
  // bus, a pulse, a frame, a clock) ends by its own rules with its registers as after reset.
  wire tick_10us, tick_50us, tick_ms, tick_16ms;
  reset_sync core_reset (
    .clk_i(clk_i),
    .rst_i(rst_i),
    .request_i(1'b0),
    .rst_o(rst)
  );
  reset_sync register_reset (
    .clk_i(clk_i),
    .rst_i(rst_i),
    .request_i(ctrl_soft_reset),
    .rst_o(soft_rst)
  );
  microsecond_time clock (
    .clk_i(clk_i),
    .rst_i(rst),
    .tick_us_i(tick_us_i),
    .time_us_o(time_us)
  );
  time_base ticks (
    .clk_i(clk_i),
    .rst_i(rst),
    .tick_us_i(tick_us_i),
    .tick_10us_o(tick_10us),
    .tick_50us_o(tick_50us),
    .tick_ms_o(tick_ms),
    .tick_16ms_o(tick_16ms)
  );

  // ---- the DSP's bus
  wire target_low, router_low, bus_start, bus_stop;
  wire timeout_event, protocol_event, spike_event, branch_event;
  assign sda_low_o = target_low || router_low;
  i2c_target target (
    .clk_i(clk_i),
    .rst_i(rst),
    .tick_ms_i(tick_ms),
    .scl_i(scl_i),
    .sda_i(sda_i),
    .sda_low_o(target_low),
    .scl_o(i2c_diag_scl),
    .sda_o(i2c_diag_sda),
    .index_o(index),
    .index_known_i(index_known),
    .reading_o(reading),
    .read_strobe_o(read_strobe),
    .read_data_i(read_data),
    .write_allowed_i(write_allowed),
    .write_strobe_o(write_strobe),
    .write_data_o(write_data),
    .start_o(bus_start),
    .stop_o(bus_stop),
    .timeout_o(timeout_event),
    .protocol_error_o(protocol_event),
    .spike_o(spike_event)
  );
  sensor_bus branches (
    .clk_i(clk_i),
    .rst_i(rst),
    .tick_us_i(tick_us_i),
    .tick_ms_i(tick_ms),
    .enable_i(branch_ctrl_router_enable),
    .bypass_i(branch_ctrl_bypass),
    .clear_i(bus_clear),
    .scl_i(i2c_diag_scl),
    .sda_i(i2c_diag_sda),
    .start_i(bus_start),
    .stop_i(bus_stop),
    .sda_low_o(router_low),
    .branch_scl_i(branch_scl_i),
    .branch_sda_i(branch_sda_i),
    .branch_scl_low_o(branch_scl_low_o),
    .branch_sda_low_o(branch_sda_low_o),
    .branch_scl_o(i2c_diag_branch_scl),
    .branch_sda_o(i2c_diag_branch_sda),
    .clearing_o(i2c_diag_clear_busy),
    .event_o(branch_event)
  );
  // A servo's counter wraps, the others stay at 255.
  wire [1:0] wrong_line, wrong_frame, servo_finished;
  event_counters #(
    .EVENTS(10),
    .SATURATING(8)
  ) counters (
    .clk_i(clk_i),
    .rst_i(soft_rst),
    .event_i({servo_finished, wrong_frame, wrong_line, branch_event, timeout_event, protocol_event,
              spike_event}),
    .clear_i({6'd0, branch_errors_clear, i2c_timeouts_clear, i2c_protocol_errors_clear,
              spikes_clear}),
    .count_o({servo1_frames, servo0_frames, camera1_short_frames, camera0_short_frames,
              camera1_short_lines, camera0_short_lines, branch_errors, i2c_timeouts,
              i2c_protocol_errors, spikes})
  );

  // ---- servos
  wire watchdog_event;
  motion servos (
    .clk_i(clk_i),
    .rst_i(rst),
    .soft_rst_i(soft_rst),
    .tick_us_i(tick_us_i),
    .tick_ms_i(tick_ms),
    .written_i(write_strobe),
    .watchdog_ms_i(wdg_ms),
    .watchdog_action_i(wdg_action),
    .watchdog_clear_i(wdg_fired_clear),
    .watchdog_fired_o(wdg_fired),
    .watchdog_event_o(watchdog_event),
    .enable_i({ctrl_servo1_enable, ctrl_servo0_enable}),
    .period_us_i(servo_period_us),
    .target0_q4_i(servo0_target_q4),
    .target1_q4_i(servo1_target_q4),
    .safe0_q4_i(servo0_safe_q4),
    .safe1_q4_i(servo1_safe_q4),
    .min0_q4_i({1'b0, servo0_min_q4}),
    .min1_q4_i({1'b0, servo1_min_q4}),
    .max0_q4_i(servo0_max_q4),
    .max1_q4_i(servo1_max_q4),
    .slew0_q4_i(servo0_slew_q4),
    .slew1_q4_i(servo1_slew_q4),
    .actual0_q4_o(servo0_actual_q4),
    .actual1_q4_o(servo1_actual_q4),
    .servo_o(servo_o),
    .active_o({status_servo1_active, status_servo0_active}),
    .finished_o(servo_finished)
  );

  // ---- pixels
  wire frame_event, switched_event, forced_event, lost_event, line_event;
  // A camera that is enabled and drives its pins should have a clock.
  wire [1:0] camera_wanted = sensor_oe & sensor_extclk & {2{ctrl_stream_enable}};
  video_path video (
    .clk_i(clk_i),
    .rst_i(rst),
    .tick_us_i(tick_us_i),
    .tick_ms_i(tick_ms),
    .tick_10us_i(tick_10us),
    .tick_50us_i(tick_50us),
    .tick_16ms_i(tick_16ms),
    .time_us_i(time_us),
    .stream_i(ctrl_stream_enable),
    .request_i(cam_select_source),
    .alternating_i(cam_select_alternating),
    .frames_each_i(cam_select_frames_each),
    .timeout_ms_i(switch_timeout_ms),
    .first_line_i(ppi_mode_sync_shape),
    .tag_i(ppi_mode_tag),
    .falling_i({ppi_mode_edge1, ppi_mode_edge0}),
    .wanted_i(camera_wanted),
    .hold_i({camera1_hold, camera0_hold}),
    .expect_width_i(expect_width),
    .expect_height_i(expect_height),
    .pattern_width_i(pattern_width),
    .pattern_height_i(pattern_height),
    .pattern_hblank_i(pattern_hblank),
    .pattern_vblank_i(pattern_vblank),
    .pattern_kind_i(pattern_kind),
    .pattern_seed_i(pattern_seed),
    .camera0_clk_i(pix_clk_i[0]),
    .camera0_data_i(left_data_i),
    .camera0_line_i(line_valid_i[0]),
    .camera0_frame_i(frame_valid_i[0]),
    .camera1_clk_i(pix_clk_i[1]),
    .camera1_data_i(right_data_i),
    .camera1_line_i(line_valid_i[1]),
    .camera1_frame_i(frame_valid_i[1]),
    .ppi_clock_o(ppi_clk_o),
    .ppi_data_o(ppi_data_o),
    .ppi_line_o(ppi_fs1_o),
    .ppi_frame_o(ppi_fs2_o),
    .active_o(cam_state_active),
    .gate_open_o(cam_state_gate_open),
    .switching_o(cam_state_switching),
    .forced_o(cam_state_forced),
    .lost_o({camera1_flags_lost, camera0_flags_lost}),
    .cut_o({camera1_flags_cut, camera0_flags_cut}),
    .frame_valid_o({camera1_flags_frame_valid, camera0_flags_frame_valid}),
    .wrong_line_o(wrong_line),
    .wrong_frame_o(wrong_frame),
    .short_line_o({camera1_flags_short_line, camera0_flags_short_line}),
    .short_frame_o({camera1_flags_short_frame, camera0_flags_short_frame}),
    .camera0_frames_o(camera0_frames),
    .camera0_lines_o(camera0_lines),
    .camera0_pixels_o(camera0_pixels),
    .camera0_period_10us_o(camera0_period_10us),
    .camera0_pixclk_khz_o(camera0_pixclk_khz),
    .camera1_frames_o(camera1_frames),
    .camera1_lines_o(camera1_lines),
    .camera1_pixels_o(camera1_pixels),
    .camera1_period_10us_o(camera1_period_10us),
    .camera1_pixclk_khz_o(camera1_pixclk_khz),
    .skew_us_o(skew_us),
    .frame_time_o(frame_time_us),
    .event_frame_start_o(frame_event),
    .event_switched_o(switched_event),
    .event_timed_out_o(forced_event),
    .event_clock_lost_o(lost_event),
    .event_line_error_o(line_event)
  );

  // ---- trigger and interrupt
  wire trigger_done;
  trigger both_cameras (
    .clk_i(clk_i),
    .rst_i(soft_rst),
    .tick_us_i(tick_us_i),
    .fire_i(trigger_ctrl_fire),
    .delay_us_i(trigger_delay_us),
    .width_us_i(trigger_width_us),
    .trigger_o(trigger_o),
    .busy_o(trigger_ctrl_busy),
    .done_o(trigger_done)
  );
  interrupt #(.SOURCES(8)) interrupts (
    .clk_i(clk_i),
    .rst_i(soft_rst),
    .event_i({trigger_done, line_event, timeout_event || protocol_event || branch_event,
              watchdog_event, lost_event, forced_event, switched_event, frame_event}),
    .test_i(irq_test),
    .clear_i(irq_status_clear),
    .enable_i(irq_enable),
    .status_o(irq_status),
    .line_o(irq_o)
  );

`ifdef PROVE_BRIDGE_CORE
  bridge_core_properties properties (
    .clk_i(clk_i), .rst_i(rst_i), .rst(rst), .soft_rst(soft_rst),
    .soft_reset(ctrl_soft_reset), .irq_o(irq_o), .irq_status(irq_status),
    .irq_enable(irq_enable), .irq_test(irq_test), .irq_clear(irq_status_clear),
    .events({trigger_done, line_event, branch_event, protocol_event, timeout_event,
             watchdog_event, lost_event, forced_event, switched_event, frame_event}),
    .target_low(target_low), .router_low(router_low), .sda_low_o(sda_low_o), .fs3_o(ppi_fs3_o),
    .sensor_oe(sensor_oe), .extclk(sensor_extclk), .stream(ctrl_stream_enable),
    .wanted(camera_wanted)
  );
`endif

endmodule

`default_nettype wire
