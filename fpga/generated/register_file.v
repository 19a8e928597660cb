// SPDX-License-Identifier: Apache-2.0
// Made by fpga/tools/registers.py from fpga/registers.rdl; do not edit.
//
// Registers of the bridge between the I2C target and the hardware.
//
//                    ___     ___     ___     ___     ___     ___
// clk_i            _|   |___|   |___|   |___|   |___|   |___|   |__
// index_i          =X== index, held ================================
// write_data_i     =X== word, held =================================
// write_allowed_o  _________|^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^
// write_strobe_i   _________________|^^^^^^^|_______________________
// <name>_o         =========================X= new value ===========
// read_strobe_i    _________|^^^^^^^|_______________________________
// read_data_o      =========================X= word, held ==========
//
// write_allowed_o and index_known_o follow their inputs by one clock; write_strobe_i may come only
// while write_allowed_o is high. Rejected are: a number outside its limits, a code without a name,
// what needs the unlocked map while it is locked, and registers that are only read.
// Ports: <register>[_<field>] with _o for what software sets (for one clock only, where 1 starts
// something), _i for inputs from hardware and _clear_o for pulses of one clock that clear it.
// <block>_hold_o: the hardware keeps the values of the block. Latency: 2 clocks.

`default_nettype none

module register_file (
  input  wire clk_i,
  input  wire rst_i,
  input  wire [7:0] index_i,
  output reg  index_known_o,
  input  wire reading_i,
  input  wire read_strobe_i,
  output reg  [15:0] read_data_o,
  output reg  write_allowed_o,
  input  wire write_strobe_i,
  input  wire [15:0] write_data_i,
  output reg  camera0_hold_o,
  output reg  camera1_hold_o,
  input  wire [15:0] build_i,
  input  wire caps_camera1_i,
  input  wire caps_router_i,
  input  wire caps_pattern_i,
  input  wire caps_trigger_i,
  input  wire caps_alternating_i,
  input  wire caps_tag_i,
  output reg  [15:0] scratch_o,
  output reg  [14:0] servo_period_us_o,
  output reg  ctrl_servo0_enable_o,
  output reg  ctrl_servo1_enable_o,
  output reg  ctrl_stream_enable_o,
  output wire ctrl_soft_reset_o,
  input  wire status_servo0_active_i,
  input  wire status_servo1_active_i,
  input  wire status_watchdog_fired_i,
  input  wire status_camera0_lost_i,
  input  wire status_camera1_lost_i,
  input  wire status_switching_i,
  input  wire status_irq_line_i,
  input  wire [7:0] irq_status_i,
  output wire [7:0] irq_status_clear_o,
  output reg  [7:0] irq_enable_o,
  output wire [7:0] irq_test_o,
  output reg  unlock_o,
  output reg  [15:0] wdg_ms_o,
  output reg  [1:0] wdg_action_o,
  input  wire wdg_fired_i,
  output wire wdg_fired_clear_o,
  output reg  [15:0] servo0_target_q4_o,
  input  wire [15:0] servo0_actual_q4_i,
  output reg  [14:0] servo0_min_q4_o,
  output reg  [15:0] servo0_max_q4_o,
  output reg  [15:0] servo0_safe_q4_o,
  output reg  [10:0] servo0_slew_q4_o,
  input  wire [7:0] servo0_frames_i,
  output reg  [15:0] servo1_target_q4_o,
  input  wire [15:0] servo1_actual_q4_i,
  output reg  [14:0] servo1_min_q4_o,
  output reg  [15:0] servo1_max_q4_o,
  output reg  [15:0] servo1_safe_q4_o,
  output reg  [10:0] servo1_slew_q4_o,
  input  wire [7:0] servo1_frames_i,
  output reg  [1:0] cam_select_source_o,
  output reg  cam_select_alternating_o,
  output reg  [6:0] cam_select_frames_each_o,
  input  wire [1:0] cam_state_active_i,
  input  wire cam_state_gate_open_i,
  input  wire cam_state_switching_i,
  input  wire cam_state_forced_i,
  output reg  [7:0] switch_timeout_ms_o,
  output reg  ppi_mode_sync_shape_o,
  output reg  ppi_mode_edge0_o,
  output reg  ppi_mode_edge1_o,
  output reg  ppi_mode_tag_o,
  output reg  [11:0] pattern_width_o,
  output reg  [11:0] pattern_height_o,
  output reg  [9:0] pattern_hblank_o,
  output reg  [7:0] pattern_vblank_o,
  output reg  [2:0] pattern_kind_o,
  output reg  [9:0] pattern_seed_o,
  output reg  [11:0] expect_width_o,
  output reg  [11:0] expect_height_o,
  input  wire [15:0] camera0_frames_i,
  input  wire [11:0] camera0_lines_i,
  input  wire [11:0] camera0_pixels_i,
  input  wire [15:0] camera0_period_10us_i,
  input  wire [15:0] camera0_pixclk_khz_i,
  input  wire [7:0] camera0_short_lines_i,
  input  wire [7:0] camera0_short_frames_i,
  input  wire camera0_flags_lost_i,
  input  wire camera0_flags_frame_valid_i,
  input  wire camera0_flags_short_line_i,
  input  wire camera0_flags_short_frame_i,
  input  wire camera0_flags_cut_i,
  input  wire [15:0] camera1_frames_i,
  input  wire [11:0] camera1_lines_i,
  input  wire [11:0] camera1_pixels_i,
  input  wire [15:0] camera1_period_10us_i,
  input  wire [15:0] camera1_pixclk_khz_i,
  input  wire [7:0] camera1_short_lines_i,
  input  wire [7:0] camera1_short_frames_i,
  input  wire camera1_flags_lost_i,
  input  wire camera1_flags_frame_valid_i,
  input  wire camera1_flags_short_line_i,
  input  wire camera1_flags_short_frame_i,
  input  wire camera1_flags_cut_i,
  output wire [1:0] trigger_ctrl_fire_o,
  input  wire trigger_ctrl_busy_i,
  output reg  [15:0] trigger_delay_us_o,
  output reg  [15:0] trigger_width_us_o,
  input  wire [15:0] skew_us_i,
  input  wire [31:0] frame_time_us_i,
  output reg  [1:0] sensor_reset_n_o,
  output reg  [1:0] sensor_standby_o,
  output reg  [1:0] sensor_oe_o,
  output reg  [1:0] sensor_extclk_o,
  input  wire [31:0] time_us_i,
  input  wire i2c_diag_scl_i,
  input  wire i2c_diag_sda_i,
  input  wire [1:0] i2c_diag_branch_scl_i,
  input  wire [1:0] i2c_diag_branch_sda_i,
  input  wire i2c_diag_clear_busy_i,
  input  wire [7:0] i2c_timeouts_i,
  output wire i2c_timeouts_clear_o,
  input  wire [7:0] i2c_protocol_errors_i,
  output wire i2c_protocol_errors_clear_o,
  input  wire [7:0] branch_errors_i,
  output wire branch_errors_clear_o,
  input  wire [7:0] spikes_i,
  output wire spikes_clear_o,
  output wire [1:0] bus_clear_o,
  output reg  branch_ctrl_router_enable_o,
  output reg  [1:0] branch_ctrl_bypass_o
);

  // Comparisons with constants: bit by bit they take fewer cells than a carry chain.
  function at_least(input [15:0] word, input [15:0] limit);
    integer n;
    begin
      at_least = 1'b1;
      for (n = 0; n < 16; n = n + 1)
        at_least = limit[n] ? at_least && word[n] : at_least || word[n];
    end
  endfunction

  // What may be written to the register at the index.
  reg allowed;
  always @* case (index_i)
    8'h04: allowed = 1'b1;
    8'h07: allowed = unlock_o && at_least(write_data_i, 16'd15000) && !at_least(write_data_i,
      16'd25001);
    8'h08: allowed = 1'b1;
    8'h0A: allowed = 1'b1;
    8'h0B: allowed = 1'b1;
    8'h0C: allowed = 1'b1;
    8'h0D: allowed = 1'b1;
    8'h0E: allowed = (unlock_o || at_least(write_data_i, 16'd1));
    8'h0F: allowed = write_data_i[1:0] <= 2'd2;
    8'h10: allowed = at_least(write_data_i, 16'd9600) && !at_least(write_data_i, 16'd38401);
    8'h12: allowed = unlock_o && at_least(write_data_i, 16'd9600) && !at_least(write_data_i,
      16'd24001);
    8'h13: allowed = unlock_o && at_least(write_data_i, 16'd24000) && !at_least(write_data_i,
      16'd38401);
    8'h14: allowed = at_least(write_data_i, 16'd9600) && !at_least(write_data_i, 16'd38401);
    8'h15: allowed = !at_least(write_data_i, 16'd2048);
    8'h18: allowed = at_least(write_data_i, 16'd9600) && !at_least(write_data_i, 16'd38401);
    8'h1A: allowed = unlock_o && at_least(write_data_i, 16'd9600) && !at_least(write_data_i,
      16'd24001);
    8'h1B: allowed = unlock_o && at_least(write_data_i, 16'd24000) && !at_least(write_data_i,
      16'd38401);
    8'h1C: allowed = at_least(write_data_i, 16'd9600) && !at_least(write_data_i, 16'd38401);
    8'h1D: allowed = !at_least(write_data_i, 16'd2048);
    8'h20: allowed = write_data_i[1:0] <= 2'd2;
    8'h22: allowed = at_least(write_data_i, 16'd1) && !at_least(write_data_i, 16'd256);
    8'h23: allowed = 1'b1;
    8'h24: allowed = at_least(write_data_i, 16'd16) && !at_least(write_data_i, 16'd4096);
    8'h25: allowed = at_least(write_data_i, 16'd8) && !at_least(write_data_i, 16'd4096);
    8'h26: allowed = at_least(write_data_i, 16'd8) && !at_least(write_data_i, 16'd1024);
    8'h27: allowed = at_least(write_data_i, 16'd1) && !at_least(write_data_i, 16'd256);
    8'h28: allowed = write_data_i[2:0] <= 3'd4;
    8'h29: allowed = 1'b1;
    8'h2A: allowed = !at_least(write_data_i, 16'd4096);
    8'h2B: allowed = !at_least(write_data_i, 16'd4096);
    8'h40: allowed = 1'b1;
    8'h41: allowed = 1'b1;
    8'h42: allowed = at_least(write_data_i, 16'd1);
    8'h48: allowed = 1'b1;
    8'h51: allowed = 1'b1;
    8'h52: allowed = 1'b1;
    8'h53: allowed = 1'b1;
    8'h54: allowed = 1'b1;
    8'h55: allowed = 1'b1;
    8'h56: allowed = write_data_i[2:1] <= 2'd2;
    default: allowed = 1'b0;
  endcase

  always @(posedge clk_i or posedge rst_i) begin
    if (rst_i) begin
      scratch_o <= 16'd0;
      servo_period_us_o <= 15'd20000;
      ctrl_servo0_enable_o <= 1'd0;
      ctrl_servo1_enable_o <= 1'd0;
      ctrl_stream_enable_o <= 1'd0;
      irq_enable_o <= 8'd0;
      unlock_o <= 1'd0;
      wdg_ms_o <= 16'd1000;
      wdg_action_o <= 2'd2;
      servo0_target_q4_o <= 16'd24000;
      servo0_min_q4_o <= 15'd14400;
      servo0_max_q4_o <= 16'd33600;
      servo0_safe_q4_o <= 16'd24000;
      servo0_slew_q4_o <= 11'd480;
      servo1_target_q4_o <= 16'd24000;
      servo1_min_q4_o <= 15'd14400;
      servo1_max_q4_o <= 16'd33600;
      servo1_safe_q4_o <= 16'd24000;
      servo1_slew_q4_o <= 11'd480;
      cam_select_source_o <= 2'd0;
      cam_select_alternating_o <= 1'd0;
      cam_select_frames_each_o <= 7'd1;
      switch_timeout_ms_o <= 8'd95;
      ppi_mode_sync_shape_o <= 1'd0;
      ppi_mode_edge0_o <= 1'd0;
      ppi_mode_edge1_o <= 1'd0;
      ppi_mode_tag_o <= 1'd0;
      pattern_width_o <= 12'd640;
      pattern_height_o <= 12'd480;
      pattern_hblank_o <= 10'd144;
      pattern_vblank_o <= 8'd25;
      pattern_kind_o <= 3'd0;
      pattern_seed_o <= 10'd1;
      expect_width_o <= 12'd0;
      expect_height_o <= 12'd0;
      trigger_delay_us_o <= 16'd0;
      trigger_width_us_o <= 16'd10;
      sensor_reset_n_o <= 2'd0;
      sensor_standby_o <= 2'd0;
      sensor_oe_o <= 2'd0;
      sensor_extclk_o <= 2'd0;
      branch_ctrl_router_enable_o <= 1'd1;
      branch_ctrl_bypass_o <= 2'd0;
    end else if (write_strobe_i) case (index_i)
      8'h04: scratch_o <= write_data_i[15:0];
      8'h07: servo_period_us_o <= write_data_i[14:0];
      8'h08: begin
        ctrl_servo0_enable_o <= write_data_i[0];
        ctrl_servo1_enable_o <= write_data_i[1];
        ctrl_stream_enable_o <= write_data_i[8];
      end
      8'h0B: irq_enable_o <= write_data_i[7:0];
      8'h0D: unlock_o <= write_data_i == 16'h4C4B;
      8'h0E: wdg_ms_o <= write_data_i[15:0];
      8'h0F: wdg_action_o <= write_data_i[1:0];
      8'h10: servo0_target_q4_o <= write_data_i[15:0];
      8'h12: servo0_min_q4_o <= write_data_i[14:0];
      8'h13: servo0_max_q4_o <= write_data_i[15:0];
      8'h14: servo0_safe_q4_o <= write_data_i[15:0];
      8'h15: servo0_slew_q4_o <= write_data_i[10:0];
      8'h18: servo1_target_q4_o <= write_data_i[15:0];
      8'h1A: servo1_min_q4_o <= write_data_i[14:0];
      8'h1B: servo1_max_q4_o <= write_data_i[15:0];
      8'h1C: servo1_safe_q4_o <= write_data_i[15:0];
      8'h1D: servo1_slew_q4_o <= write_data_i[10:0];
      8'h20: begin
        cam_select_source_o <= write_data_i[1:0];
        cam_select_alternating_o <= write_data_i[8];
        cam_select_frames_each_o <= write_data_i[15:9];
      end
      8'h22: switch_timeout_ms_o <= write_data_i[7:0];
      8'h23: begin
        ppi_mode_sync_shape_o <= write_data_i[0];
        ppi_mode_edge0_o <= write_data_i[4];
        ppi_mode_edge1_o <= write_data_i[5];
        ppi_mode_tag_o <= write_data_i[8];
      end
      8'h24: pattern_width_o <= {write_data_i[11:4], 4'd0};
      8'h25: pattern_height_o <= {write_data_i[11:3], 3'd0};
      8'h26: pattern_hblank_o <= {write_data_i[9:2], 2'd0};
      8'h27: pattern_vblank_o <= write_data_i[7:0];
      8'h28: pattern_kind_o <= write_data_i[2:0];
      8'h29: pattern_seed_o <= write_data_i[9:0];
      8'h2A: expect_width_o <= write_data_i[11:0];
      8'h2B: expect_height_o <= write_data_i[11:0];
      8'h41: trigger_delay_us_o <= write_data_i[15:0];
      8'h42: trigger_width_us_o <= write_data_i[15:0];
      8'h48: begin
        sensor_reset_n_o <= write_data_i[1:0];
        sensor_standby_o <= write_data_i[3:2];
        sensor_oe_o <= write_data_i[5:4];
        sensor_extclk_o <= write_data_i[7:6];
      end
      8'h56: begin
        branch_ctrl_router_enable_o <= write_data_i[0];
        branch_ctrl_bypass_o <= write_data_i[2:1];
      end
      default: ;
    endcase
  end

  assign ctrl_soft_reset_o = write_data_i[14] & {1{write_strobe_i && index_i == 8'h08}};
  assign irq_status_clear_o = write_data_i[7:0] & {8{write_strobe_i && index_i == 8'h0A}};
  assign irq_test_o = write_data_i[7:0] & {8{write_strobe_i && index_i == 8'h0C}};
  assign wdg_fired_clear_o = write_data_i[8] & {1{write_strobe_i && index_i == 8'h0F}};
  assign trigger_ctrl_fire_o = write_data_i[1:0] & {2{write_strobe_i && index_i == 8'h40}};
  assign i2c_timeouts_clear_o = write_strobe_i && index_i == 8'h51;
  assign i2c_protocol_errors_clear_o = write_strobe_i && index_i == 8'h52;
  assign branch_errors_clear_o = write_strobe_i && index_i == 8'h53;
  assign spikes_clear_o = write_strobe_i && index_i == 8'h54;
  assign bus_clear_o = write_data_i[1:0] & {2{write_strobe_i && index_i == 8'h55}};

  // A snapshot lasts from a block's first word until the transfer leaves it.
  always @(posedge clk_i or posedge rst_i) begin
    if (rst_i) camera0_hold_o <= 1'b0;
    else if (!reading_i) camera0_hold_o <= 1'b0;
    else if (read_strobe_i) camera0_hold_o <= index_i == 8'h30 ||
      (camera0_hold_o && index_i[7:3] == 5'h06);
  end
  always @(posedge clk_i or posedge rst_i) begin
    if (rst_i) camera1_hold_o <= 1'b0;
    else if (!reading_i) camera1_hold_o <= 1'b0;
    else if (read_strobe_i) camera1_hold_o <= index_i == 8'h38 ||
      (camera1_hold_o && index_i[7:3] == 5'h07);
  end

  // The low half of the 32-bit value whose high half was read last.
  reg fetch;
  reg [15:0] low_word;
  always @(posedge clk_i or posedge rst_i) begin
    if (rst_i) low_word <= 16'd0;
    else if (fetch) case (index_i)
      8'h45: low_word <= frame_time_us_i[15:0];
      8'h4A: low_word <= time_us_i[15:0];
      default: ;
    endcase
  end

  reg known;
  reg [15:0] word;
  always @* begin
    known = 1'b1;
    case (index_i)
      8'h00: word = 16'd23325;
      8'h01: word = {8'd1, 8'd0};
      8'h02: word = build_i;
      8'h03: word = {10'd0, caps_tag_i, caps_alternating_i, caps_trigger_i, caps_pattern_i,
        caps_router_i, caps_camera1_i};
      8'h04: word = scratch_o;
      8'h07: word = {1'd0, servo_period_us_o};
      8'h08: word = {7'd0, ctrl_stream_enable_o, 6'd0, ctrl_servo1_enable_o, ctrl_servo0_enable_o};
      8'h09: word = {9'd0, status_irq_line_i, status_switching_i, status_camera1_lost_i,
        status_camera0_lost_i, status_watchdog_fired_i, status_servo1_active_i,
        status_servo0_active_i};
      8'h0A: word = {8'd0, irq_status_i};
      8'h0B: word = {8'd0, irq_enable_o};
      8'h0C: word = 16'd0;
      8'h0D: word = {15'd0, unlock_o};
      8'h0E: word = wdg_ms_o;
      8'h0F: word = {7'd0, wdg_fired_i, 6'd0, wdg_action_o};
      8'h10: word = servo0_target_q4_o;
      8'h11: word = servo0_actual_q4_i;
      8'h12: word = {1'd0, servo0_min_q4_o};
      8'h13: word = servo0_max_q4_o;
      8'h14: word = servo0_safe_q4_o;
      8'h15: word = {5'd0, servo0_slew_q4_o};
      8'h16: word = {8'd0, servo0_frames_i};
      8'h18: word = servo1_target_q4_o;
      8'h19: word = servo1_actual_q4_i;
      8'h1A: word = {1'd0, servo1_min_q4_o};
      8'h1B: word = servo1_max_q4_o;
      8'h1C: word = servo1_safe_q4_o;
      8'h1D: word = {5'd0, servo1_slew_q4_o};
      8'h1E: word = {8'd0, servo1_frames_i};
      8'h20: word = {cam_select_frames_each_o, cam_select_alternating_o, 6'd0, cam_select_source_o};
      8'h21: word = {9'd0, cam_state_forced_i, cam_state_switching_i, cam_state_gate_open_i, 2'd0,
        cam_state_active_i};
      8'h22: word = {8'd0, switch_timeout_ms_o};
      8'h23: word = {7'd0, ppi_mode_tag_o, 2'd0, ppi_mode_edge1_o, ppi_mode_edge0_o, 3'd0,
        ppi_mode_sync_shape_o};
      8'h24: word = {4'd0, pattern_width_o};
      8'h25: word = {4'd0, pattern_height_o};
      8'h26: word = {6'd0, pattern_hblank_o};
      8'h27: word = {8'd0, pattern_vblank_o};
      8'h28: word = {13'd0, pattern_kind_o};
      8'h29: word = {6'd0, pattern_seed_o};
      8'h2A: word = {4'd0, expect_width_o};
      8'h2B: word = {4'd0, expect_height_o};
      8'h30: word = camera0_frames_i;
      8'h31: word = {4'd0, camera0_lines_i};
      8'h32: word = {4'd0, camera0_pixels_i};
      8'h33: word = camera0_period_10us_i;
      8'h34: word = camera0_pixclk_khz_i;
      8'h35: word = {8'd0, camera0_short_lines_i};
      8'h36: word = {8'd0, camera0_short_frames_i};
      8'h37: word = {11'd0, camera0_flags_cut_i, camera0_flags_short_frame_i,
        camera0_flags_short_line_i, camera0_flags_frame_valid_i, camera0_flags_lost_i};
      8'h38: word = camera1_frames_i;
      8'h39: word = {4'd0, camera1_lines_i};
      8'h3A: word = {4'd0, camera1_pixels_i};
      8'h3B: word = camera1_period_10us_i;
      8'h3C: word = camera1_pixclk_khz_i;
      8'h3D: word = {8'd0, camera1_short_lines_i};
      8'h3E: word = {8'd0, camera1_short_frames_i};
      8'h3F: word = {11'd0, camera1_flags_cut_i, camera1_flags_short_frame_i,
        camera1_flags_short_line_i, camera1_flags_frame_valid_i, camera1_flags_lost_i};
      8'h40: word = {7'd0, trigger_ctrl_busy_i, 8'd0};
      8'h41: word = trigger_delay_us_o;
      8'h42: word = trigger_width_us_o;
      8'h44: word = skew_us_i;
      8'h45: word = frame_time_us_i[31:16];
      8'h46: word = low_word;
      8'h48: word = {8'd0, sensor_extclk_o, sensor_oe_o, sensor_standby_o, sensor_reset_n_o};
      8'h4A: word = time_us_i[31:16];
      8'h4B: word = low_word;
      8'h50: word = {7'd0, i2c_diag_clear_busy_i, 2'd0, i2c_diag_branch_sda_i,
        i2c_diag_branch_scl_i, i2c_diag_sda_i, i2c_diag_scl_i};
      8'h51: word = {8'd0, i2c_timeouts_i};
      8'h52: word = {8'd0, i2c_protocol_errors_i};
      8'h53: word = {8'd0, branch_errors_i};
      8'h54: word = {8'd0, spikes_i};
      8'h55: word = 16'd0;
      8'h56: word = {13'd0, branch_ctrl_bypass_o, branch_ctrl_router_enable_o};
      default: begin
        known = 1'b0;
        word = 16'd0;
      end
    endcase
  end

  always @(posedge clk_i or posedge rst_i) begin
    if (rst_i) begin
      write_allowed_o <= 1'b0;
      index_known_o <= 1'b0;
      fetch <= 1'b0;
      read_data_o <= 16'd0;
    end else begin
      write_allowed_o <= allowed;
      index_known_o <= known;
      fetch <= read_strobe_i;
      if (fetch) read_data_o <= word;
    end
  end

`ifdef FORMAL
`include "register_file_properties.vh"
`endif

endmodule

`default_nettype wire
