// SPDX-License-Identifier: Apache-2.0
// Made by fpga/tools/registers.py from fpga/registers.rdl; do not edit.
// The register file in bridge_core, and a wire for each port of a register, named as the
// port without _i or _o.
  wire camera0_hold;
  wire camera1_hold;
  wire [15:0] build;
  wire caps_camera1;
  wire caps_router;
  wire caps_pattern;
  wire caps_trigger;
  wire caps_alternating;
  wire caps_tag;
  wire [15:0] scratch;
  wire [14:0] servo_period_us;
  wire ctrl_servo0_enable;
  wire ctrl_servo1_enable;
  wire ctrl_stream_enable;
  wire ctrl_soft_reset;
  wire status_servo0_active;
  wire status_servo1_active;
  wire status_watchdog_fired;
  wire status_camera0_lost;
  wire status_camera1_lost;
  wire status_switching;
  wire status_irq_line;
  wire [7:0] irq_status;
  wire [7:0] irq_status_clear;
  wire [7:0] irq_enable;
  wire [7:0] irq_test;
  wire unlock;
  wire [15:0] wdg_ms;
  wire [1:0] wdg_action;
  wire wdg_fired;
  wire wdg_fired_clear;
  wire [15:0] servo0_target_q4;
  wire [15:0] servo0_actual_q4;
  wire [14:0] servo0_min_q4;
  wire [15:0] servo0_max_q4;
  wire [15:0] servo0_safe_q4;
  wire [10:0] servo0_slew_q4;
  wire [7:0] servo0_frames;
  wire [15:0] servo1_target_q4;
  wire [15:0] servo1_actual_q4;
  wire [14:0] servo1_min_q4;
  wire [15:0] servo1_max_q4;
  wire [15:0] servo1_safe_q4;
  wire [10:0] servo1_slew_q4;
  wire [7:0] servo1_frames;
  wire [1:0] cam_select_source;
  wire cam_select_alternating;
  wire [6:0] cam_select_frames_each;
  wire [1:0] cam_state_active;
  wire cam_state_gate_open;
  wire cam_state_switching;
  wire cam_state_forced;
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
  wire [15:0] camera0_frames;
  wire [11:0] camera0_lines;
  wire [11:0] camera0_pixels;
  wire [15:0] camera0_period_10us;
  wire [15:0] camera0_pixclk_khz;
  wire [7:0] camera0_short_lines;
  wire [7:0] camera0_short_frames;
  wire camera0_flags_lost;
  wire camera0_flags_frame_valid;
  wire camera0_flags_short_line;
  wire camera0_flags_short_frame;
  wire camera0_flags_cut;
  wire [15:0] camera1_frames;
  wire [11:0] camera1_lines;
  wire [11:0] camera1_pixels;
  wire [15:0] camera1_period_10us;
  wire [15:0] camera1_pixclk_khz;
  wire [7:0] camera1_short_lines;
  wire [7:0] camera1_short_frames;
  wire camera1_flags_lost;
  wire camera1_flags_frame_valid;
  wire camera1_flags_short_line;
  wire camera1_flags_short_frame;
  wire camera1_flags_cut;
  wire [1:0] trigger_ctrl_fire;
  wire trigger_ctrl_busy;
  wire [15:0] trigger_delay_us;
  wire [15:0] trigger_width_us;
  wire [15:0] skew_us;
  wire [31:0] frame_time_us;
  wire [1:0] sensor_reset_n;
  wire [1:0] sensor_standby;
  wire [1:0] sensor_oe;
  wire [1:0] sensor_extclk;
  wire [31:0] time_us;
  wire i2c_diag_scl;
  wire i2c_diag_sda;
  wire [1:0] i2c_diag_branch_scl;
  wire [1:0] i2c_diag_branch_sda;
  wire i2c_diag_clear_busy;
  wire [7:0] i2c_timeouts;
  wire i2c_timeouts_clear;
  wire [7:0] i2c_protocol_errors;
  wire i2c_protocol_errors_clear;
  wire [7:0] branch_errors;
  wire branch_errors_clear;
  wire [7:0] spikes;
  wire spikes_clear;
  wire [1:0] bus_clear;
  wire branch_ctrl_router_enable;
  wire [1:0] branch_ctrl_bypass;
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
    .camera0_hold_o(camera0_hold),
    .camera1_hold_o(camera1_hold),
    .build_i(build),
    .caps_camera1_i(caps_camera1),
    .caps_router_i(caps_router),
    .caps_pattern_i(caps_pattern),
    .caps_trigger_i(caps_trigger),
    .caps_alternating_i(caps_alternating),
    .caps_tag_i(caps_tag),
    .scratch_o(scratch),
    .servo_period_us_o(servo_period_us),
    .ctrl_servo0_enable_o(ctrl_servo0_enable),
    .ctrl_servo1_enable_o(ctrl_servo1_enable),
    .ctrl_stream_enable_o(ctrl_stream_enable),
    .ctrl_soft_reset_o(ctrl_soft_reset),
    .status_servo0_active_i(status_servo0_active),
    .status_servo1_active_i(status_servo1_active),
    .status_watchdog_fired_i(status_watchdog_fired),
    .status_camera0_lost_i(status_camera0_lost),
    .status_camera1_lost_i(status_camera1_lost),
    .status_switching_i(status_switching),
    .status_irq_line_i(status_irq_line),
    .irq_status_i(irq_status),
    .irq_status_clear_o(irq_status_clear),
    .irq_enable_o(irq_enable),
    .irq_test_o(irq_test),
    .unlock_o(unlock),
    .wdg_ms_o(wdg_ms),
    .wdg_action_o(wdg_action),
    .wdg_fired_i(wdg_fired),
    .wdg_fired_clear_o(wdg_fired_clear),
    .servo0_target_q4_o(servo0_target_q4),
    .servo0_actual_q4_i(servo0_actual_q4),
    .servo0_min_q4_o(servo0_min_q4),
    .servo0_max_q4_o(servo0_max_q4),
    .servo0_safe_q4_o(servo0_safe_q4),
    .servo0_slew_q4_o(servo0_slew_q4),
    .servo0_frames_i(servo0_frames),
    .servo1_target_q4_o(servo1_target_q4),
    .servo1_actual_q4_i(servo1_actual_q4),
    .servo1_min_q4_o(servo1_min_q4),
    .servo1_max_q4_o(servo1_max_q4),
    .servo1_safe_q4_o(servo1_safe_q4),
    .servo1_slew_q4_o(servo1_slew_q4),
    .servo1_frames_i(servo1_frames),
    .cam_select_source_o(cam_select_source),
    .cam_select_alternating_o(cam_select_alternating),
    .cam_select_frames_each_o(cam_select_frames_each),
    .cam_state_active_i(cam_state_active),
    .cam_state_gate_open_i(cam_state_gate_open),
    .cam_state_switching_i(cam_state_switching),
    .cam_state_forced_i(cam_state_forced),
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
    .camera0_short_lines_i(camera0_short_lines),
    .camera0_short_frames_i(camera0_short_frames),
    .camera0_flags_lost_i(camera0_flags_lost),
    .camera0_flags_frame_valid_i(camera0_flags_frame_valid),
    .camera0_flags_short_line_i(camera0_flags_short_line),
    .camera0_flags_short_frame_i(camera0_flags_short_frame),
    .camera0_flags_cut_i(camera0_flags_cut),
    .camera1_frames_i(camera1_frames),
    .camera1_lines_i(camera1_lines),
    .camera1_pixels_i(camera1_pixels),
    .camera1_period_10us_i(camera1_period_10us),
    .camera1_pixclk_khz_i(camera1_pixclk_khz),
    .camera1_short_lines_i(camera1_short_lines),
    .camera1_short_frames_i(camera1_short_frames),
    .camera1_flags_lost_i(camera1_flags_lost),
    .camera1_flags_frame_valid_i(camera1_flags_frame_valid),
    .camera1_flags_short_line_i(camera1_flags_short_line),
    .camera1_flags_short_frame_i(camera1_flags_short_frame),
    .camera1_flags_cut_i(camera1_flags_cut),
    .trigger_ctrl_fire_o(trigger_ctrl_fire),
    .trigger_ctrl_busy_i(trigger_ctrl_busy),
    .trigger_delay_us_o(trigger_delay_us),
    .trigger_width_us_o(trigger_width_us),
    .skew_us_i(skew_us),
    .frame_time_us_i(frame_time_us),
    .sensor_reset_n_o(sensor_reset_n),
    .sensor_standby_o(sensor_standby),
    .sensor_oe_o(sensor_oe),
    .sensor_extclk_o(sensor_extclk),
    .time_us_i(time_us),
    .i2c_diag_scl_i(i2c_diag_scl),
    .i2c_diag_sda_i(i2c_diag_sda),
    .i2c_diag_branch_scl_i(i2c_diag_branch_scl),
    .i2c_diag_branch_sda_i(i2c_diag_branch_sda),
    .i2c_diag_clear_busy_i(i2c_diag_clear_busy),
    .i2c_timeouts_i(i2c_timeouts),
    .i2c_timeouts_clear_o(i2c_timeouts_clear),
    .i2c_protocol_errors_i(i2c_protocol_errors),
    .i2c_protocol_errors_clear_o(i2c_protocol_errors_clear),
    .branch_errors_i(branch_errors),
    .branch_errors_clear_o(branch_errors_clear),
    .spikes_i(spikes),
    .spikes_clear_o(spikes_clear),
    .bus_clear_o(bus_clear),
    .branch_ctrl_router_enable_o(branch_ctrl_router_enable),
    .branch_ctrl_bypass_o(branch_ctrl_bypass)
  );
