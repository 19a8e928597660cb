// SPDX-License-Identifier: Apache-2.0
// Made by fpga/tools/registers.py from fpga/registers.rdl; do not edit.
// What the register file promises; included in it for the proof.

  // One register for all: the solver chooses its index.
  (* anyconst *) wire [7:0] f_any;
  reg [7:0] f_index;
  wire [15:0] f_word =
    f_any == 8'h04 ? {scratch_o} :
    f_any == 8'h07 ? {1'd0, servo_period_us_o} :
    f_any == 8'h08 ? {7'd0, ctrl_stream_enable_o, 6'd0, ctrl_servo1_enable_o, ctrl_servo0_enable_o} :
    f_any == 8'h0B ? {8'd0, irq_enable_o} :
    f_any == 8'h0E ? {wdg_ms_o} :
    f_any == 8'h0F ? {14'd0, wdg_action_o} :
    f_any == 8'h10 ? {servo0_target_q4_o} :
    f_any == 8'h12 ? {1'd0, servo0_min_q4_o} :
    f_any == 8'h13 ? {servo0_max_q4_o} :
    f_any == 8'h14 ? {servo0_safe_q4_o} :
    f_any == 8'h15 ? {5'd0, servo0_slew_q4_o} :
    f_any == 8'h18 ? {servo1_target_q4_o} :
    f_any == 8'h1A ? {1'd0, servo1_min_q4_o} :
    f_any == 8'h1B ? {servo1_max_q4_o} :
    f_any == 8'h1C ? {servo1_safe_q4_o} :
    f_any == 8'h1D ? {5'd0, servo1_slew_q4_o} :
    f_any == 8'h20 ? {cam_select_frames_each_o, cam_select_alternating_o, 6'd0, cam_select_source_o} :
    f_any == 8'h22 ? {8'd0, switch_timeout_ms_o} :
    f_any == 8'h23 ? {7'd0, ppi_mode_tag_o, 2'd0, ppi_mode_edge1_o, ppi_mode_edge0_o, 3'd0, ppi_mode_sync_shape_o} :
    f_any == 8'h24 ? {4'd0, pattern_width_o} :
    f_any == 8'h25 ? {4'd0, pattern_height_o} :
    f_any == 8'h26 ? {6'd0, pattern_hblank_o} :
    f_any == 8'h27 ? {8'd0, pattern_vblank_o} :
    f_any == 8'h28 ? {13'd0, pattern_kind_o} :
    f_any == 8'h29 ? {6'd0, pattern_seed_o} :
    f_any == 8'h2A ? {4'd0, expect_width_o} :
    f_any == 8'h2B ? {4'd0, expect_height_o} :
    f_any == 8'h41 ? {trigger_delay_us_o} :
    f_any == 8'h42 ? {trigger_width_us_o} :
    f_any == 8'h48 ? {8'd0, sensor_extclk_o, sensor_oe_o, sensor_standby_o, sensor_reset_n_o} :
    f_any == 8'h56 ? {13'd0, branch_ctrl_bypass_o, branch_ctrl_router_enable_o} :
    16'd0;
  wire [15:0] f_stored =
    f_any == 8'h04 ? 16'hFFFF :
    f_any == 8'h07 ? 16'h7FFF :
    f_any == 8'h08 ? 16'h0103 :
    f_any == 8'h0B ? 16'h00FF :
    f_any == 8'h0E ? 16'hFFFF :
    f_any == 8'h0F ? 16'h0003 :
    f_any == 8'h10 ? 16'hFFFF :
    f_any == 8'h12 ? 16'h7FFF :
    f_any == 8'h13 ? 16'hFFFF :
    f_any == 8'h14 ? 16'hFFFF :
    f_any == 8'h15 ? 16'h07FF :
    f_any == 8'h18 ? 16'hFFFF :
    f_any == 8'h1A ? 16'h7FFF :
    f_any == 8'h1B ? 16'hFFFF :
    f_any == 8'h1C ? 16'hFFFF :
    f_any == 8'h1D ? 16'h07FF :
    f_any == 8'h20 ? 16'hFF03 :
    f_any == 8'h22 ? 16'h00FF :
    f_any == 8'h23 ? 16'h0131 :
    f_any == 8'h24 ? 16'h0FF0 :
    f_any == 8'h25 ? 16'h0FF8 :
    f_any == 8'h26 ? 16'h03FC :
    f_any == 8'h27 ? 16'h00FF :
    f_any == 8'h28 ? 16'h0007 :
    f_any == 8'h29 ? 16'h03FF :
    f_any == 8'h2A ? 16'h0FFF :
    f_any == 8'h2B ? 16'h0FFF :
    f_any == 8'h41 ? 16'hFFFF :
    f_any == 8'h42 ? 16'hFFFF :
    f_any == 8'h48 ? 16'h00FF :
    f_any == 8'h56 ? 16'h0007 :
    16'd0;
  wire [15:0] f_reset =
    f_any == 8'h04 ? 16'h0000 :
    f_any == 8'h07 ? 16'h4E20 :
    f_any == 8'h08 ? 16'h0000 :
    f_any == 8'h0B ? 16'h0000 :
    f_any == 8'h0E ? 16'h03E8 :
    f_any == 8'h0F ? 16'h0002 :
    f_any == 8'h10 ? 16'h5DC0 :
    f_any == 8'h12 ? 16'h3840 :
    f_any == 8'h13 ? 16'h8340 :
    f_any == 8'h14 ? 16'h5DC0 :
    f_any == 8'h15 ? 16'h01E0 :
    f_any == 8'h18 ? 16'h5DC0 :
    f_any == 8'h1A ? 16'h3840 :
    f_any == 8'h1B ? 16'h8340 :
    f_any == 8'h1C ? 16'h5DC0 :
    f_any == 8'h1D ? 16'h01E0 :
    f_any == 8'h20 ? 16'h0200 :
    f_any == 8'h22 ? 16'h005F :
    f_any == 8'h23 ? 16'h0000 :
    f_any == 8'h24 ? 16'h0280 :
    f_any == 8'h25 ? 16'h01E0 :
    f_any == 8'h26 ? 16'h0090 :
    f_any == 8'h27 ? 16'h0019 :
    f_any == 8'h28 ? 16'h0000 :
    f_any == 8'h29 ? 16'h0001 :
    f_any == 8'h2A ? 16'h0000 :
    f_any == 8'h2B ? 16'h0000 :
    f_any == 8'h41 ? 16'h0000 :
    f_any == 8'h42 ? 16'h000A :
    f_any == 8'h48 ? 16'h0000 :
    f_any == 8'h56 ? 16'h0001 :
    16'd0;
  wire [15:0] f_lowest =
    f_any == 8'h07 ? 16'd15000 :
    f_any == 8'h10 ? 16'd9600 :
    f_any == 8'h12 ? 16'd9600 :
    f_any == 8'h13 ? 16'd24000 :
    f_any == 8'h14 ? 16'd9600 :
    f_any == 8'h18 ? 16'd9600 :
    f_any == 8'h1A ? 16'd9600 :
    f_any == 8'h1B ? 16'd24000 :
    f_any == 8'h1C ? 16'd9600 :
    f_any == 8'h22 ? 16'd1 :
    f_any == 8'h24 ? 16'd16 :
    f_any == 8'h25 ? 16'd8 :
    f_any == 8'h26 ? 16'd8 :
    f_any == 8'h27 ? 16'd1 :
    f_any == 8'h42 ? 16'd1 :
    16'd0;
  wire [15:0] f_highest =
    f_any == 8'h07 ? 16'd25000 :
    f_any == 8'h0E ? 16'd65535 :
    f_any == 8'h10 ? 16'd38400 :
    f_any == 8'h12 ? 16'd24000 :
    f_any == 8'h13 ? 16'd38400 :
    f_any == 8'h14 ? 16'd38400 :
    f_any == 8'h15 ? 16'd2047 :
    f_any == 8'h18 ? 16'd38400 :
    f_any == 8'h1A ? 16'd24000 :
    f_any == 8'h1B ? 16'd38400 :
    f_any == 8'h1C ? 16'd38400 :
    f_any == 8'h1D ? 16'd2047 :
    f_any == 8'h22 ? 16'd255 :
    f_any == 8'h24 ? 16'd4095 :
    f_any == 8'h25 ? 16'd4095 :
    f_any == 8'h26 ? 16'd1023 :
    f_any == 8'h27 ? 16'd255 :
    f_any == 8'h2A ? 16'd4095 :
    f_any == 8'h2B ? 16'd4095 :
    f_any == 8'h42 ? 16'd65535 :
    16'hFFFF;
  wire f_codes_named =
    f_any == 8'h0F ? wdg_action_o <= 2 :
    f_any == 8'h20 ? cam_select_source_o <= 2 :
    f_any == 8'h28 ? pattern_kind_o <= 4 :
    f_any == 8'h56 ? branch_ctrl_bypass_o <= 2 :
    1'b1;
  wire f_needs_unlock =
    f_any == 8'h07 ? 1'b1 :
    f_any == 8'h12 ? 1'b1 :
    f_any == 8'h13 ? 1'b1 :
    f_any == 8'h1A ? 1'b1 :
    f_any == 8'h1B ? 1'b1 :
    1'b0;
  wire f_writable =
    f_any == 8'h04 ? 1'b1 :
    f_any == 8'h07 ? 1'b1 :
    f_any == 8'h08 ? 1'b1 :
    f_any == 8'h0A ? 1'b1 :
    f_any == 8'h0B ? 1'b1 :
    f_any == 8'h0C ? 1'b1 :
    f_any == 8'h0D ? 1'b1 :
    f_any == 8'h0E ? 1'b1 :
    f_any == 8'h0F ? 1'b1 :
    f_any == 8'h10 ? 1'b1 :
    f_any == 8'h12 ? 1'b1 :
    f_any == 8'h13 ? 1'b1 :
    f_any == 8'h14 ? 1'b1 :
    f_any == 8'h15 ? 1'b1 :
    f_any == 8'h18 ? 1'b1 :
    f_any == 8'h1A ? 1'b1 :
    f_any == 8'h1B ? 1'b1 :
    f_any == 8'h1C ? 1'b1 :
    f_any == 8'h1D ? 1'b1 :
    f_any == 8'h20 ? 1'b1 :
    f_any == 8'h22 ? 1'b1 :
    f_any == 8'h23 ? 1'b1 :
    f_any == 8'h24 ? 1'b1 :
    f_any == 8'h25 ? 1'b1 :
    f_any == 8'h26 ? 1'b1 :
    f_any == 8'h27 ? 1'b1 :
    f_any == 8'h28 ? 1'b1 :
    f_any == 8'h29 ? 1'b1 :
    f_any == 8'h2A ? 1'b1 :
    f_any == 8'h2B ? 1'b1 :
    f_any == 8'h40 ? 1'b1 :
    f_any == 8'h41 ? 1'b1 :
    f_any == 8'h42 ? 1'b1 :
    f_any == 8'h48 ? 1'b1 :
    f_any == 8'h51 ? 1'b1 :
    f_any == 8'h52 ? 1'b1 :
    f_any == 8'h53 ? 1'b1 :
    f_any == 8'h54 ? 1'b1 :
    f_any == 8'h55 ? 1'b1 :
    f_any == 8'h56 ? 1'b1 :
    1'b0;
  wire [15:0] f_pulses =
    f_any == 8'h08 ? {1'd0, ctrl_soft_reset_o, 14'd0} :
    f_any == 8'h0A ? {8'd0, irq_status_clear_o[7], irq_status_clear_o[6], irq_status_clear_o[5], irq_status_clear_o[4], irq_status_clear_o[3], irq_status_clear_o[2], irq_status_clear_o[1], irq_status_clear_o[0]} :
    f_any == 8'h0C ? {8'd0, irq_test_o} :
    f_any == 8'h0F ? {7'd0, wdg_fired_clear_o, 8'd0} :
    f_any == 8'h40 ? {14'd0, trigger_ctrl_fire_o} :
    f_any == 8'h55 ? {14'd0, bus_clear_o} :
    16'd0;
  wire [15:0] f_pulse_mask =
    f_any == 8'h08 ? 16'h4000 :
    f_any == 8'h0A ? 16'h00FF :
    f_any == 8'h0C ? 16'h00FF :
    f_any == 8'h0F ? 16'h0100 :
    f_any == 8'h40 ? 16'h0003 :
    f_any == 8'h55 ? 16'h0003 :
    16'h0000;
  wire f_clear =
    f_any == 8'h51 ? i2c_timeouts_clear_o :
    f_any == 8'h52 ? i2c_protocol_errors_clear_o :
    f_any == 8'h53 ? branch_errors_clear_o :
    f_any == 8'h54 ? spikes_clear_o :
    1'b0;
  wire f_clearable =
    f_any == 8'h51 ? 1'b1 :
    f_any == 8'h52 ? 1'b1 :
    f_any == 8'h53 ? 1'b1 :
    f_any == 8'h54 ? 1'b1 :
    1'b0;
  wire [15:0] f_reference =
    f_any == 8'h00 ? {16'd23325} :
    f_any == 8'h01 ? {8'd1, 8'd0} :
    f_any == 8'h02 ? {build_i} :
    f_any == 8'h03 ? {10'd0, caps_tag_i, caps_alternating_i, caps_trigger_i, caps_pattern_i, caps_router_i, caps_camera1_i} :
    f_any == 8'h04 ? {scratch_o} :
    f_any == 8'h07 ? {1'd0, servo_period_us_o} :
    f_any == 8'h08 ? {7'd0, ctrl_stream_enable_o, 6'd0, ctrl_servo1_enable_o, ctrl_servo0_enable_o} :
    f_any == 8'h09 ? {9'd0, status_irq_line_i, status_switching_i, status_camera1_lost_i, status_camera0_lost_i, status_watchdog_fired_i, status_servo1_active_i, status_servo0_active_i} :
    f_any == 8'h0A ? {8'd0, irq_status_i[7], irq_status_i[6], irq_status_i[5], irq_status_i[4], irq_status_i[3], irq_status_i[2], irq_status_i[1], irq_status_i[0]} :
    f_any == 8'h0B ? {8'd0, irq_enable_o} :
    f_any == 8'h0D ? {15'd0, unlock_o} :
    f_any == 8'h0E ? {wdg_ms_o} :
    f_any == 8'h0F ? {14'd0, wdg_action_o} | {7'd0, wdg_fired_i, 8'd0} :
    f_any == 8'h10 ? {servo0_target_q4_o} :
    f_any == 8'h11 ? {servo0_actual_q4_i} :
    f_any == 8'h12 ? {1'd0, servo0_min_q4_o} :
    f_any == 8'h13 ? {servo0_max_q4_o} :
    f_any == 8'h14 ? {servo0_safe_q4_o} :
    f_any == 8'h15 ? {5'd0, servo0_slew_q4_o} :
    f_any == 8'h16 ? {8'd0, servo0_frames_i} :
    f_any == 8'h18 ? {servo1_target_q4_o} :
    f_any == 8'h19 ? {servo1_actual_q4_i} :
    f_any == 8'h1A ? {1'd0, servo1_min_q4_o} :
    f_any == 8'h1B ? {servo1_max_q4_o} :
    f_any == 8'h1C ? {servo1_safe_q4_o} :
    f_any == 8'h1D ? {5'd0, servo1_slew_q4_o} :
    f_any == 8'h1E ? {8'd0, servo1_frames_i} :
    f_any == 8'h20 ? {cam_select_frames_each_o, cam_select_alternating_o, 6'd0, cam_select_source_o} :
    f_any == 8'h21 ? {9'd0, cam_state_forced_i, cam_state_switching_i, cam_state_gate_open_i, 2'd0, cam_state_active_i} :
    f_any == 8'h22 ? {8'd0, switch_timeout_ms_o} :
    f_any == 8'h23 ? {7'd0, ppi_mode_tag_o, 2'd0, ppi_mode_edge1_o, ppi_mode_edge0_o, 3'd0, ppi_mode_sync_shape_o} :
    f_any == 8'h24 ? {4'd0, pattern_width_o} :
    f_any == 8'h25 ? {4'd0, pattern_height_o} :
    f_any == 8'h26 ? {6'd0, pattern_hblank_o} :
    f_any == 8'h27 ? {8'd0, pattern_vblank_o} :
    f_any == 8'h28 ? {13'd0, pattern_kind_o} :
    f_any == 8'h29 ? {6'd0, pattern_seed_o} :
    f_any == 8'h2A ? {4'd0, expect_width_o} :
    f_any == 8'h2B ? {4'd0, expect_height_o} :
    f_any == 8'h30 ? {camera0_frames_i} :
    f_any == 8'h31 ? {4'd0, camera0_lines_i} :
    f_any == 8'h32 ? {4'd0, camera0_pixels_i} :
    f_any == 8'h33 ? {camera0_period_10us_i} :
    f_any == 8'h34 ? {camera0_pixclk_khz_i} :
    f_any == 8'h35 ? {8'd0, camera0_short_lines_i} :
    f_any == 8'h36 ? {8'd0, camera0_short_frames_i} :
    f_any == 8'h37 ? {11'd0, camera0_flags_cut_i, camera0_flags_short_frame_i, camera0_flags_short_line_i, camera0_flags_frame_valid_i, camera0_flags_lost_i} :
    f_any == 8'h38 ? {camera1_frames_i} :
    f_any == 8'h39 ? {4'd0, camera1_lines_i} :
    f_any == 8'h3A ? {4'd0, camera1_pixels_i} :
    f_any == 8'h3B ? {camera1_period_10us_i} :
    f_any == 8'h3C ? {camera1_pixclk_khz_i} :
    f_any == 8'h3D ? {8'd0, camera1_short_lines_i} :
    f_any == 8'h3E ? {8'd0, camera1_short_frames_i} :
    f_any == 8'h3F ? {11'd0, camera1_flags_cut_i, camera1_flags_short_frame_i, camera1_flags_short_line_i, camera1_flags_frame_valid_i, camera1_flags_lost_i} :
    f_any == 8'h40 ? {7'd0, trigger_ctrl_busy_i, 8'd0} :
    f_any == 8'h41 ? {trigger_delay_us_o} :
    f_any == 8'h42 ? {trigger_width_us_o} :
    f_any == 8'h44 ? {skew_us_i} :
    f_any == 8'h45 ? frame_time_us_i[31:16] :
    f_any == 8'h46 ? low_word :
    f_any == 8'h48 ? {8'd0, sensor_extclk_o, sensor_oe_o, sensor_standby_o, sensor_reset_n_o} :
    f_any == 8'h4A ? time_us_i[31:16] :
    f_any == 8'h4B ? low_word :
    f_any == 8'h50 ? {7'd0, i2c_diag_clear_busy_i, 2'd0, i2c_diag_branch_sda_i, i2c_diag_branch_scl_i, i2c_diag_sda_i, i2c_diag_scl_i} :
    f_any == 8'h51 ? {8'd0, i2c_timeouts_i} :
    f_any == 8'h52 ? {8'd0, i2c_protocol_errors_i} :
    f_any == 8'h53 ? {8'd0, branch_errors_i} :
    f_any == 8'h54 ? {8'd0, spikes_i} :
    f_any == 8'h56 ? {13'd0, branch_ctrl_bypass_o, branch_ctrl_router_enable_o} :
    16'd0;
  wire [31:0] f_pair =
    f_any == 8'h45 ? frame_time_us_i :
    f_any == 8'h4A ? time_us_i :
    32'd0;
  wire f_is_high =
    f_any == 8'h45 ? 1'b1 :
    f_any == 8'h4A ? 1'b1 :
    1'b0;
  wire [15:0] f_floor =
    index_i == 8'h07 ? 16'd15000 :
    index_i == 8'h0E ? (unlock_o ? 16'd0 : 16'd1) :
    index_i == 8'h10 ? 16'd9600 :
    index_i == 8'h12 ? 16'd9600 :
    index_i == 8'h13 ? 16'd24000 :
    index_i == 8'h14 ? 16'd9600 :
    index_i == 8'h18 ? 16'd9600 :
    index_i == 8'h1A ? 16'd9600 :
    index_i == 8'h1B ? 16'd24000 :
    index_i == 8'h1C ? 16'd9600 :
    index_i == 8'h22 ? 16'd1 :
    index_i == 8'h24 ? 16'd16 :
    index_i == 8'h25 ? 16'd8 :
    index_i == 8'h26 ? 16'd8 :
    index_i == 8'h27 ? 16'd1 :
    index_i == 8'h42 ? 16'd1 :
    16'd0;
  wire [15:0] f_ceiling =
    index_i == 8'h07 ? 16'd25000 :
    index_i == 8'h0E ? 16'd65535 :
    index_i == 8'h10 ? 16'd38400 :
    index_i == 8'h12 ? 16'd24000 :
    index_i == 8'h13 ? 16'd38400 :
    index_i == 8'h14 ? 16'd38400 :
    index_i == 8'h15 ? 16'd2047 :
    index_i == 8'h18 ? 16'd38400 :
    index_i == 8'h1A ? 16'd24000 :
    index_i == 8'h1B ? 16'd38400 :
    index_i == 8'h1C ? 16'd38400 :
    index_i == 8'h1D ? 16'd2047 :
    index_i == 8'h22 ? 16'd255 :
    index_i == 8'h24 ? 16'd4095 :
    index_i == 8'h25 ? 16'd4095 :
    index_i == 8'h26 ? 16'd1023 :
    index_i == 8'h27 ? 16'd255 :
    index_i == 8'h2A ? 16'd4095 :
    index_i == 8'h2B ? 16'd4095 :
    index_i == 8'h42 ? 16'd65535 :
    16'hFFFF;
  wire f_allow =
    index_i == 8'h04 ? 1'b1 :
    index_i == 8'h07 ? unlock_o && write_data_i >= f_floor && write_data_i <= f_ceiling :
    index_i == 8'h08 ? 1'b1 :
    index_i == 8'h0A ? 1'b1 :
    index_i == 8'h0B ? 1'b1 :
    index_i == 8'h0C ? 1'b1 :
    index_i == 8'h0D ? 1'b1 :
    index_i == 8'h0E ? write_data_i >= f_floor && write_data_i <= f_ceiling :
    index_i == 8'h0F ? write_data_i[1:0] <= 2 :
    index_i == 8'h10 ? write_data_i >= f_floor && write_data_i <= f_ceiling :
    index_i == 8'h12 ? unlock_o && write_data_i >= f_floor && write_data_i <= f_ceiling :
    index_i == 8'h13 ? unlock_o && write_data_i >= f_floor && write_data_i <= f_ceiling :
    index_i == 8'h14 ? write_data_i >= f_floor && write_data_i <= f_ceiling :
    index_i == 8'h15 ? write_data_i >= f_floor && write_data_i <= f_ceiling :
    index_i == 8'h18 ? write_data_i >= f_floor && write_data_i <= f_ceiling :
    index_i == 8'h1A ? unlock_o && write_data_i >= f_floor && write_data_i <= f_ceiling :
    index_i == 8'h1B ? unlock_o && write_data_i >= f_floor && write_data_i <= f_ceiling :
    index_i == 8'h1C ? write_data_i >= f_floor && write_data_i <= f_ceiling :
    index_i == 8'h1D ? write_data_i >= f_floor && write_data_i <= f_ceiling :
    index_i == 8'h20 ? write_data_i[1:0] <= 2 :
    index_i == 8'h22 ? write_data_i >= f_floor && write_data_i <= f_ceiling :
    index_i == 8'h23 ? 1'b1 :
    index_i == 8'h24 ? write_data_i >= f_floor && write_data_i <= f_ceiling :
    index_i == 8'h25 ? write_data_i >= f_floor && write_data_i <= f_ceiling :
    index_i == 8'h26 ? write_data_i >= f_floor && write_data_i <= f_ceiling :
    index_i == 8'h27 ? write_data_i >= f_floor && write_data_i <= f_ceiling :
    index_i == 8'h28 ? write_data_i[2:0] <= 4 :
    index_i == 8'h29 ? 1'b1 :
    index_i == 8'h2A ? write_data_i >= f_floor && write_data_i <= f_ceiling :
    index_i == 8'h2B ? write_data_i >= f_floor && write_data_i <= f_ceiling :
    index_i == 8'h40 ? 1'b1 :
    index_i == 8'h41 ? 1'b1 :
    index_i == 8'h42 ? write_data_i >= f_floor && write_data_i <= f_ceiling :
    index_i == 8'h48 ? 1'b1 :
    index_i == 8'h51 ? 1'b1 :
    index_i == 8'h52 ? 1'b1 :
    index_i == 8'h53 ? 1'b1 :
    index_i == 8'h54 ? 1'b1 :
    index_i == 8'h55 ? 1'b1 :
    index_i == 8'h56 ? write_data_i[2:1] <= 2 :
    1'b0;
  wire f_known =
    index_i == 8'h00 ? 1'b1 :
    index_i == 8'h01 ? 1'b1 :
    index_i == 8'h02 ? 1'b1 :
    index_i == 8'h03 ? 1'b1 :
    index_i == 8'h04 ? 1'b1 :
    index_i == 8'h07 ? 1'b1 :
    index_i == 8'h08 ? 1'b1 :
    index_i == 8'h09 ? 1'b1 :
    index_i == 8'h0A ? 1'b1 :
    index_i == 8'h0B ? 1'b1 :
    index_i == 8'h0C ? 1'b1 :
    index_i == 8'h0D ? 1'b1 :
    index_i == 8'h0E ? 1'b1 :
    index_i == 8'h0F ? 1'b1 :
    index_i == 8'h10 ? 1'b1 :
    index_i == 8'h11 ? 1'b1 :
    index_i == 8'h12 ? 1'b1 :
    index_i == 8'h13 ? 1'b1 :
    index_i == 8'h14 ? 1'b1 :
    index_i == 8'h15 ? 1'b1 :
    index_i == 8'h16 ? 1'b1 :
    index_i == 8'h18 ? 1'b1 :
    index_i == 8'h19 ? 1'b1 :
    index_i == 8'h1A ? 1'b1 :
    index_i == 8'h1B ? 1'b1 :
    index_i == 8'h1C ? 1'b1 :
    index_i == 8'h1D ? 1'b1 :
    index_i == 8'h1E ? 1'b1 :
    index_i == 8'h20 ? 1'b1 :
    index_i == 8'h21 ? 1'b1 :
    index_i == 8'h22 ? 1'b1 :
    index_i == 8'h23 ? 1'b1 :
    index_i == 8'h24 ? 1'b1 :
    index_i == 8'h25 ? 1'b1 :
    index_i == 8'h26 ? 1'b1 :
    index_i == 8'h27 ? 1'b1 :
    index_i == 8'h28 ? 1'b1 :
    index_i == 8'h29 ? 1'b1 :
    index_i == 8'h2A ? 1'b1 :
    index_i == 8'h2B ? 1'b1 :
    index_i == 8'h30 ? 1'b1 :
    index_i == 8'h31 ? 1'b1 :
    index_i == 8'h32 ? 1'b1 :
    index_i == 8'h33 ? 1'b1 :
    index_i == 8'h34 ? 1'b1 :
    index_i == 8'h35 ? 1'b1 :
    index_i == 8'h36 ? 1'b1 :
    index_i == 8'h37 ? 1'b1 :
    index_i == 8'h38 ? 1'b1 :
    index_i == 8'h39 ? 1'b1 :
    index_i == 8'h3A ? 1'b1 :
    index_i == 8'h3B ? 1'b1 :
    index_i == 8'h3C ? 1'b1 :
    index_i == 8'h3D ? 1'b1 :
    index_i == 8'h3E ? 1'b1 :
    index_i == 8'h3F ? 1'b1 :
    index_i == 8'h40 ? 1'b1 :
    index_i == 8'h41 ? 1'b1 :
    index_i == 8'h42 ? 1'b1 :
    index_i == 8'h44 ? 1'b1 :
    index_i == 8'h45 ? 1'b1 :
    index_i == 8'h46 ? 1'b1 :
    index_i == 8'h48 ? 1'b1 :
    index_i == 8'h4A ? 1'b1 :
    index_i == 8'h4B ? 1'b1 :
    index_i == 8'h50 ? 1'b1 :
    index_i == 8'h51 ? 1'b1 :
    index_i == 8'h52 ? 1'b1 :
    index_i == 8'h53 ? 1'b1 :
    index_i == 8'h54 ? 1'b1 :
    index_i == 8'h55 ? 1'b1 :
    index_i == 8'h56 ? 1'b1 :
    1'b0;
  reg f_allowed_due, f_known_due;
  wire [1:0] f_first =
    f_index == 8'h30 ? 2'd1 :
    f_index == 8'h38 ? 2'd2 :
    2'd0;
  wire [1:0] f_inside =
    f_index == 8'h30 ? 2'd1 :
    f_index == 8'h31 ? 2'd1 :
    f_index == 8'h32 ? 2'd1 :
    f_index == 8'h33 ? 2'd1 :
    f_index == 8'h34 ? 2'd1 :
    f_index == 8'h35 ? 2'd1 :
    f_index == 8'h36 ? 2'd1 :
    f_index == 8'h37 ? 2'd1 :
    f_index == 8'h38 ? 2'd2 :
    f_index == 8'h39 ? 2'd2 :
    f_index == 8'h3A ? 2'd2 :
    f_index == 8'h3B ? 2'd2 :
    f_index == 8'h3C ? 2'd2 :
    f_index == 8'h3D ? 2'd2 :
    f_index == 8'h3E ? 2'd2 :
    f_index == 8'h3F ? 2'd2 :
    2'd0;
  reg f_begun = 1'b0;
  reg f_running;             // no reset now and none at the edge before
  reg f_allowed, f_unlocked, f_reading, f_fetch;
  reg [2:0] f_writes;        // write strobes at the last edges
  reg [2:0] f_reads;
  reg [1:0] f_steady;        // edges that index and data have not changed for
  reg [15:0] f_data;
  reg [15:0] f_word_before, f_reference_before, f_read_before, f_low_before;
  reg [31:0] f_pair_before;
  reg [1:0] f_hold_before;
  wire [1:0] f_hold = {camera1_hold_o, camera0_hold_o};

  // What i2c_target promises and is proved there.
  always @(posedge clk_i) begin
    if (!f_begun) assume (rst_i);
    if (write_strobe_i) begin
      assume (f_allowed && f_steady == 2'd2 && index_i == f_index && write_data_i == f_data);
    end
    if (write_strobe_i || read_strobe_i) begin
      assume (!(write_strobe_i && read_strobe_i));
      assume (f_writes[1:0] == 2'd0 && f_reads[1:0] == 2'd0);
    end
    if (read_strobe_i) assume (reading_i);
    if (f_writes[1:0] != 2'd0 || f_reads[1:0] != 2'd0) assume (index_i == f_index);
    if (f_writes[1:0] != 2'd0) assume (write_data_i == f_data);
    f_begun <= 1'b1;
    f_running <= !rst_i;
    f_allowed <= write_allowed_o;
    f_unlocked <= unlock_o;
    f_reading <= reading_i;
    f_fetch <= fetch && !rst_i;
    f_writes <= rst_i ? 3'd0 : {f_writes[1:0], write_strobe_i};
    f_reads <= rst_i ? 3'd0 : {f_reads[1:0], read_strobe_i};
    f_steady <= rst_i || index_i != f_index || write_data_i != f_data ? 2'd0
      : f_steady == 2'd2 ? 2'd2 : f_steady + 2'd1;
    f_index <= index_i;
    f_data <= write_data_i;
    f_word_before <= f_word;
    f_reference_before <= f_reference;
    f_read_before <= read_data_o;
    f_low_before <= low_word;
    f_pair_before <= f_pair;
    f_hold_before <= f_hold;
    f_allowed_due <= f_allow;
    f_known_due <= f_known;
  end

  // It was written at the last edge.
  wire f_hit = f_writes[0] && f_index == f_any;
  always @(posedge clk_i) if (f_begun && f_running && !rst_i) begin
    // What is stored.
    a_written: assert (!f_hit || f_word == (f_data & f_stored));
    a_kept: assert (f_hit || f_word == f_word_before);
    a_locked: assert (!f_needs_unlock || f_unlocked || f_word == f_word_before);
    a_unlock: assert (unlock_o
      == (f_writes[0] && f_index == 8'h0D ? f_data == 16'h4C4B : f_unlocked));
    a_range: assert (f_word >= f_lowest && f_word <= f_highest);
    a_codes: assert (f_codes_named);

    // What a write does at once.
    a_pulses: assert (f_pulses
      == (write_strobe_i && index_i == f_any ? write_data_i & f_pulse_mask : 16'd0));
    a_clears: assert (f_clear == (write_strobe_i && index_i == f_any && f_clearable));
    a_read_only_refused: assert (!write_allowed_o || f_index != f_any || f_writable);
    a_allowed: assert (write_allowed_o == f_allowed_due);
    a_known: assert (index_known_o == f_known_due);

    // What is read, and that a moment later it is still the same.
    a_read: assert (!(f_fetch && f_index == f_any) || read_data_o == f_reference_before);
    a_read_stays: assert (f_fetch || read_data_o == f_read_before);
    a_fetch: assert (fetch == f_reads[0]);
    a_pair_of_one_moment: assert (!(f_fetch && f_index == f_any && f_is_high)
      || {read_data_o, low_word} == f_pair_before);
    a_low_word_stays: assert ((f_fetch && (f_index == 8'h45 || f_index == 8'h4A)) || low_word == f_low_before);

    // Snapshots.
    a_hold_begins: assert (!f_reads[0] || !f_reading || (f_hold & f_first) == f_first);
    a_hold_ends: assert (f_reading || f_hold == 2'd0);
    a_hold_leaves: assert (!f_reads[0] || (f_hold & ~f_inside) == 2'd0);
    a_hold_stays: assert (!f_reads[0] || !f_reading
      || (f_hold_before & f_inside & ~f_hold) == 2'd0);
    a_hold_lasts: assert (!f_reading || f_reads[0] || f_hold == f_hold_before);
    a_hold_from_the_first:
      assert ((f_hold & ~f_hold_before) == 2'd0
        || (f_reads[0] && (f_hold & ~f_hold_before & ~f_first) == 2'd0));
    c_written: cover (f_hit && f_writable);
    c_read_pair: cover (f_fetch && f_is_high);
    c_hold: cover (f_hold != 2'd0);
  end
  always @(posedge clk_i) if (f_begun && rst_i) begin
    a_reset: assert (f_word == f_reset && !unlock_o && f_hold == 2'd0);
  end
