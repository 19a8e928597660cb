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

  // ---- reset and time
  // The soft reset takes registers, counters and interrupt. What it must not cut (an answer on the
  // bus, a pulse, a frame, a clock) ends by its own rules with its registers as after reset.
  wire rst, soft_rst, tick_10us, tick_50us, tick_ms, tick_16ms;
  wire [31:0] time_us;
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

  // ---- registers
  wire camera0_hold;
  wire camera1_hold;
  wire ctrl_servo0_enable;
  wire ctrl_servo1_enable;
  wire ctrl_stream_enable;
  wire ctrl_soft_reset;
  wire [7:0] irq_status_clear;
  wire [7:0] irq_enable;
  wire [7:0] irq_test;
  wire unlock;
  wire [15:0] wdg_ms;
  wire [1:0] wdg_action;
  wire wdg_fired_clear;
  wire [1:0] cam_select_source;
  wire cam_select_alternating;
  wire [6:0] cam_select_frames_each;
  wire [7:0] switch_timeout_ms;
  wire ppi_mode_sync_shape;
  wire ppi_mode_edge0;
  wire ppi_mode_edge1;
  wire ppi_mode_tag;
  wire [11:0] pattern_width;
  wire [11:0] pattern_height;
  wire [9:0] pattern_hblank;
  wire [7:0] pattern_vblank;
  wire [2:0] pattern_kind;
  wire [9:0] pattern_seed;
  wire [11:0] expect_width;
  wire [11:0] expect_height;
  wire [1:0] trigger_ctrl_fire;
  wire [15:0] trigger_delay_us;
  wire [15:0] trigger_width_us;
  wire [1:0] bus_clear;
  wire branch_ctrl_router_enable;
  wire [1:0] branch_ctrl_bypass;
  wire [7:0] index;
  wire index_known, reading, read_strobe, write_allowed, write_strobe;
  wire [15:0] read_data, write_data;
  wire [1:0] servo_active;
  wire watchdog_fired;
  wire [1:0] camera_lost, cam_active, frame_valid, short_line, short_frame, frame_cut;
  wire switching, gate_open, forced;
  wire [7:0] irq_status;
  wire [3:0] servo_place;
  wire [15:0] servo_word, servo_store_q4;
  wire servo_busy, servo_store, servo_stored, filling;
  wire [3:0] fill;
  wire [1:0] servo_finished, wrong_line, wrong_frame;
  wire trigger_busy;
  wire [15:0] skew_us;
  wire [31:0] frame_time;
  wire bus_scl, bus_sda, clear_busy;
  wire [1:0] branch_scl, branch_sda;
  wire [3:0] counter_place;
  wire [7:0] counter;
  wire counter_clear;
  wire [15:0] camera0_frames, camera0_period_10us, camera0_pixclk_khz;
  wire [11:0] camera0_lines, camera0_pixels;
  wire [15:0] camera1_frames, camera1_period_10us, camera1_pixclk_khz;
  wire [11:0] camera1_lines, camera1_pixels;
  register_file registers (
    .clk_i(clk_i),
    .rst_i(soft_rst),
    .index_i(index),
    .index_known_o(index_known),
    .reading_i(reading),
    .read_strobe_i(read_strobe),
    .read_data_o(read_data),
    .write_allowed_o(write_allowed),
    .write_strobe_i(write_strobe),
    .write_data_i(write_data),
    .filling_o(filling),
    .fill_o(fill),
    .memory_place_i(servo_place),
    .memory_busy_o(servo_busy),
    .memory_word_o(servo_word),
    .memory_store_i(servo_store),
    .memory_data_i(servo_store_q4),
    .memory_stored_o(servo_stored),
    .counter_place_o(counter_place),
    .counter_clear_o(counter_clear),
    .counter_i(counter),
    .camera0_hold_o(camera0_hold),
    .camera1_hold_o(camera1_hold),
    .build_i(BUILD),
    .caps_camera1_i(1'b1),
    .caps_router_i(1'b1),
    .caps_pattern_i(1'b1),
    .caps_trigger_i(1'b1),
    .caps_alternating_i(1'b1),
    .caps_tag_i(1'b1),
    .ctrl_servo0_enable_o(ctrl_servo0_enable),
    .ctrl_servo1_enable_o(ctrl_servo1_enable),
    .ctrl_stream_enable_o(ctrl_stream_enable),
    .ctrl_soft_reset_o(ctrl_soft_reset),
    .status_servo0_active_i(servo_active[0]),
    .status_servo1_active_i(servo_active[1]),
    .status_watchdog_fired_i(watchdog_fired),
    .status_camera0_lost_i(camera_lost[0]),
    .status_camera1_lost_i(camera_lost[1]),
    .status_switching_i(switching),
    .status_irq_line_i(irq_o),
    .irq_status_i(irq_status),
    .irq_status_clear_o(irq_status_clear),
    .irq_enable_o(irq_enable),
    .irq_test_o(irq_test),
    .unlock_o(unlock),
    .wdg_ms_o(wdg_ms),
    .wdg_action_o(wdg_action),
    .wdg_fired_i(watchdog_fired),
    .wdg_fired_clear_o(wdg_fired_clear),
    .cam_select_source_o(cam_select_source),
    .cam_select_alternating_o(cam_select_alternating),
    .cam_select_frames_each_o(cam_select_frames_each),
    .cam_state_active_i(cam_active),
    .cam_state_gate_open_i(gate_open),
    .cam_state_switching_i(switching),
    .cam_state_forced_i(forced),
    .switch_timeout_ms_o(switch_timeout_ms),
    .ppi_mode_sync_shape_o(ppi_mode_sync_shape),
    .ppi_mode_edge0_o(ppi_mode_edge0),
    .ppi_mode_edge1_o(ppi_mode_edge1),
    .ppi_mode_tag_o(ppi_mode_tag),
    .pattern_width_o(pattern_width),
    .pattern_height_o(pattern_height),
    .pattern_hblank_o(pattern_hblank),
    .pattern_vblank_o(pattern_vblank),
    .pattern_kind_o(pattern_kind),
    .pattern_seed_o(pattern_seed),
    .expect_width_o(expect_width),
    .expect_height_o(expect_height),
    .camera0_frames_i(camera0_frames),
    .camera0_lines_i(camera0_lines),
    .camera0_pixels_i(camera0_pixels),
    .camera0_period_10us_i(camera0_period_10us),
    .camera0_pixclk_khz_i(camera0_pixclk_khz),
    .camera0_flags_lost_i(camera_lost[0]),
    .camera0_flags_frame_valid_i(frame_valid[0]),
    .camera0_flags_short_line_i(short_line[0]),
    .camera0_flags_short_frame_i(short_frame[0]),
    .camera0_flags_cut_i(frame_cut[0]),
    .camera1_frames_i(camera1_frames),
    .camera1_lines_i(camera1_lines),
    .camera1_pixels_i(camera1_pixels),
    .camera1_period_10us_i(camera1_period_10us),
    .camera1_pixclk_khz_i(camera1_pixclk_khz),
    .camera1_flags_lost_i(camera_lost[1]),
    .camera1_flags_frame_valid_i(frame_valid[1]),
    .camera1_flags_short_line_i(short_line[1]),
    .camera1_flags_short_frame_i(short_frame[1]),
    .camera1_flags_cut_i(frame_cut[1]),
    .trigger_ctrl_fire_o(trigger_ctrl_fire),
    .trigger_ctrl_busy_i(trigger_busy),
    .trigger_delay_us_o(trigger_delay_us),
    .trigger_width_us_o(trigger_width_us),
    .skew_us_i(skew_us),
    .frame_time_i(frame_time),
    .sensor_reset_n_o(sensor_reset_n_o),
    .sensor_standby_o(sensor_standby_o),
    .sensor_oe_o(sensor_oe_o),
    .sensor_extclk_o(sensor_extclk_enable_o),
    .time_i(time_us),
    .i2c_diag_scl_i(bus_scl),
    .i2c_diag_sda_i(bus_sda),
    .i2c_diag_branch_scl_i(branch_scl),
    .i2c_diag_branch_sda_i(branch_sda),
    .i2c_diag_clear_busy_i(clear_busy),
    .bus_clear_o(bus_clear),
    .branch_ctrl_router_enable_o(branch_ctrl_router_enable),
    .branch_ctrl_bypass_o(branch_ctrl_bypass)
  );

  // For the DSP alone.
  wire unused = &{1'b0, unlock};

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
    .scl_o(bus_scl),
    .sda_o(bus_sda),
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
    .scl_i(bus_scl),
    .sda_i(bus_sda),
    .start_i(bus_start),
    .stop_i(bus_stop),
    .sda_low_o(router_low),
    .branch_scl_i(branch_scl_i),
    .branch_sda_i(branch_sda_i),
    .branch_scl_low_o(branch_scl_low_o),
    .branch_sda_low_o(branch_sda_low_o),
    .branch_scl_o(branch_scl),
    .branch_sda_o(branch_sda),
    .clearing_o(clear_busy),
    .event_o(branch_event)
  );
  // Those that can come most often first. A servo's counter wraps, the others stay at 255.
  event_counters #(
    .EVENTS(10),
    .SATURATING(8),
    .PLACES({4'hF, 4'h7, 4'hE, 4'h6, 4'h3, 4'h1, 4'h2, 4'hD, 4'h5, 4'h4})
  ) counters (
    .clk_i(clk_i),
    .rst_i(soft_rst),
    .filling_i(filling),
    .fill_i(fill),
    .event_i({servo_finished, wrong_frame, branch_event, timeout_event, protocol_event, wrong_line,
              spike_event}),
    .clear_i(counter_clear),
    .read_i(read_strobe),
    .place_i(counter_place),
    .count_o(counter)
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
    .watchdog_fired_o(watchdog_fired),
    .watchdog_event_o(watchdog_event),
    .enable_i({ctrl_servo1_enable, ctrl_servo0_enable}),
    .place_o(servo_place),
    .word_i(servo_word),
    .busy_i(servo_busy),
    .store_o(servo_store),
    .store_q4_o(servo_store_q4),
    .stored_i(servo_stored),
    .servo_o(servo_o),
    .active_o(servo_active),
    .finished_o(servo_finished)
  );

  // ---- pixels
  wire frame_event, switched_event, forced_event, lost_event, line_event;
  // A camera that is enabled and drives its pins should have a clock.
  wire [1:0] camera_wanted = sensor_oe_o & sensor_extclk_enable_o & {2{ctrl_stream_enable}};
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
    .active_o(cam_active),
    .gate_open_o(gate_open),
    .switching_o(switching),
    .forced_o(forced),
    .lost_o(camera_lost),
    .cut_o(frame_cut),
    .frame_valid_o(frame_valid),
    .wrong_line_o(wrong_line),
    .wrong_frame_o(wrong_frame),
    .short_line_o(short_line),
    .short_frame_o(short_frame),
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
    .frame_time_o(frame_time),
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
    .busy_o(trigger_busy),
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
    .sensor_oe(sensor_oe_o), .extclk(sensor_extclk_enable_o), .stream(ctrl_stream_enable),
    .wanted(camera_wanted)
  );
`endif

endmodule

`default_nettype wire
