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
// while write_allowed_o is high. Refused are: a number outside its limits, a code without a name,
// what needs the unlocked map while it is locked, and registers that are only read.
// Ports: <register>[_<field>] with _o for what software sets (for one clock only, where 1 starts
// something), _i for what hardware tells and _clear_o for pulses of one clock that clear it.
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
  output wire [14:0] servo0_min_q4_o,
  output wire [15:0] servo0_max_q4_o,
  output wire [15:0] servo0_safe_q4_o,
  output reg  [10:0] servo0_slew_q4_o,
  input  wire [7:0] servo0_frames_i,
  output reg  [15:0] servo1_target_q4_o,
  input  wire [15:0] servo1_actual_q4_i,
  output wire [14:0] servo1_min_q4_o,
  output wire [15:0] servo1_max_q4_o,
  output wire [15:0] servo1_safe_q4_o,
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
  output wire [11:0] pattern_width_o,
  output wire [11:0] pattern_height_o,
  output wire [9:0] pattern_hblank_o,
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
  input  wire [31:0] frame_time_i,
  output reg  [1:0] sensor_reset_n_o,
  output reg  [1:0] sensor_standby_o,
  output reg  [1:0] sensor_oe_o,
  output reg  [1:0] sensor_extclk_o,
  input  wire [31:0] time_i,
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

  // Numbers are compared with constants bit by bit.
  wire at_least_1 = |write_data_i[15:0];
  wire at_least_8 = |write_data_i[15:3];
  wire at_least_16 = |write_data_i[15:4];
  wire at_least_9600 = |write_data_i[15:14] | (write_data_i[13] & (|write_data_i[12:11] |
    (write_data_i[10] & (write_data_i[9] | &write_data_i[8:7]))));
  wire at_least_15000 = |write_data_i[15:14] | (&write_data_i[13:11] & (write_data_i[10] |
    (write_data_i[9] & (write_data_i[8] | (write_data_i[7] & (|write_data_i[6:5] |
    &write_data_i[4:3]))))));
  wire at_least_24000 = write_data_i[15] | (write_data_i[14] & (write_data_i[13] |
    (&write_data_i[12:10] & (write_data_i[9] | &write_data_i[8:6]))));
  wire at_most_255 = !(|write_data_i[15:8]);
  wire at_most_1023 = !(|write_data_i[15:10]);
  wire at_most_2047 = !(|write_data_i[15:11]);
  wire at_most_4095 = !(|write_data_i[15:12]);
  wire at_most_24000 = !(write_data_i[15] | (write_data_i[14] & (write_data_i[13] |
    (&write_data_i[12:10] & (write_data_i[9] | (&write_data_i[8:6] & (|write_data_i[5:1] |
    write_data_i[0])))))));
  wire at_most_25000 = !(write_data_i[15] | (&write_data_i[14:13] & (|write_data_i[12:9] |
    (&write_data_i[8:7] & (write_data_i[6] | (write_data_i[5] & (write_data_i[4] | (write_data_i[3]
    & (|write_data_i[2:1] | write_data_i[0])))))))));
  wire at_most_38400 = !(write_data_i[15] & (|write_data_i[14:13] | (write_data_i[12] &
    (write_data_i[11] | (&write_data_i[10:9] & (|write_data_i[8:1] | write_data_i[0]))))));

  // What may be written to the register at the index.
  reg allowed;
  always @* case (index_i)
    8'h04, 8'h08, 8'h0A, 8'h0B, 8'h0C, 8'h0D, 8'h23, 8'h29, 8'h40, 8'h41, 8'h48, 8'h51, 8'h52,
      8'h53, 8'h54, 8'h55: allowed = 1'b1;
    8'h07: allowed = unlock_o && at_least_15000 && at_most_25000;
    8'h0E: allowed = (unlock_o || at_least_1);
    8'h0F, 8'h20: allowed = write_data_i[1:0] <= 2'd2;
    8'h10, 8'h14, 8'h18, 8'h1C: allowed = at_least_9600 && at_most_38400;
    8'h12, 8'h1A: allowed = unlock_o && at_least_9600 && at_most_24000;
    8'h13, 8'h1B: allowed = unlock_o && at_least_24000 && at_most_38400;
    8'h15, 8'h1D: allowed = at_most_2047;
    8'h22, 8'h27: allowed = at_least_1 && at_most_255;
    8'h24: allowed = at_least_16 && at_most_4095;
    8'h25: allowed = at_least_8 && at_most_4095;
    8'h26: allowed = at_least_8 && at_most_1023;
    8'h28: allowed = write_data_i[2:0] <= 3'd4;
    8'h2A, 8'h2B: allowed = at_most_4095;
    8'h42: allowed = at_least_1;
    8'h56: allowed = write_data_i[2:1] <= 2'd2;
    default: allowed = 1'b0;
  endcase

  always @(posedge clk_i or posedge rst_i) begin
    if (rst_i) write_allowed_o <= 1'b0;
    else write_allowed_o <= allowed;
  end

  reg [8:0] servo0_min_q4;
  reg [9:0] servo0_max_q4;
  reg [9:0] servo0_safe_q4;
  reg [8:0] servo1_min_q4;
  reg [9:0] servo1_max_q4;
  reg [9:0] servo1_safe_q4;
  reg [7:0] pattern_width;
  reg [8:0] pattern_height;
  reg [7:0] pattern_hblank;
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
      servo0_min_q4 <= 9'd225;
      servo0_max_q4 <= 10'd525;
      servo0_safe_q4 <= 10'd375;
      servo0_slew_q4_o <= 11'd480;
      servo1_target_q4_o <= 16'd24000;
      servo1_min_q4 <= 9'd225;
      servo1_max_q4 <= 10'd525;
      servo1_safe_q4 <= 10'd375;
      servo1_slew_q4_o <= 11'd480;
      cam_select_source_o <= 2'd0;
      cam_select_alternating_o <= 1'd0;
      cam_select_frames_each_o <= 7'd1;
      switch_timeout_ms_o <= 8'd95;
      ppi_mode_sync_shape_o <= 1'd0;
      ppi_mode_edge0_o <= 1'd0;
      ppi_mode_edge1_o <= 1'd0;
      ppi_mode_tag_o <= 1'd0;
      pattern_width <= 8'd40;
      pattern_height <= 9'd60;
      pattern_hblank <= 8'd36;
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
    end else begin
      if (write_strobe_i && index_i == 8'h04) scratch_o <= write_data_i[15:0];
      if (write_strobe_i && index_i == 8'h07) servo_period_us_o <= write_data_i[14:0];
      if (write_strobe_i && index_i == 8'h08) ctrl_servo0_enable_o <= write_data_i[0];
      if (write_strobe_i && index_i == 8'h08) ctrl_servo1_enable_o <= write_data_i[1];
      if (write_strobe_i && index_i == 8'h08) ctrl_stream_enable_o <= write_data_i[8];
      if (write_strobe_i && index_i == 8'h0B) irq_enable_o <= write_data_i[7:0];
      if (write_strobe_i && index_i == 8'h0D) unlock_o <= write_data_i == 16'h4C4B;
      if (write_strobe_i && index_i == 8'h0E) wdg_ms_o <= write_data_i[15:0];
      if (write_strobe_i && index_i == 8'h0F) wdg_action_o <= write_data_i[1:0];
      if (write_strobe_i && index_i == 8'h10) servo0_target_q4_o <= write_data_i[15:0];
      if (write_strobe_i && index_i == 8'h12) servo0_min_q4 <= write_data_i[14:6];
      if (write_strobe_i && index_i == 8'h13) servo0_max_q4 <= write_data_i[15:6];
      if (write_strobe_i && index_i == 8'h14) servo0_safe_q4 <= write_data_i[15:6];
      if (write_strobe_i && index_i == 8'h15) servo0_slew_q4_o <= write_data_i[10:0];
      if (write_strobe_i && index_i == 8'h18) servo1_target_q4_o <= write_data_i[15:0];
      if (write_strobe_i && index_i == 8'h1A) servo1_min_q4 <= write_data_i[14:6];
      if (write_strobe_i && index_i == 8'h1B) servo1_max_q4 <= write_data_i[15:6];
      if (write_strobe_i && index_i == 8'h1C) servo1_safe_q4 <= write_data_i[15:6];
      if (write_strobe_i && index_i == 8'h1D) servo1_slew_q4_o <= write_data_i[10:0];
      if (write_strobe_i && index_i == 8'h20) cam_select_source_o <= write_data_i[1:0];
      if (write_strobe_i && index_i == 8'h20) cam_select_alternating_o <= write_data_i[8];
      if (write_strobe_i && index_i == 8'h20) cam_select_frames_each_o <= write_data_i[15:9];
      if (write_strobe_i && index_i == 8'h22) switch_timeout_ms_o <= write_data_i[7:0];
      if (write_strobe_i && index_i == 8'h23) ppi_mode_sync_shape_o <= write_data_i[0];
      if (write_strobe_i && index_i == 8'h23) ppi_mode_edge0_o <= write_data_i[4];
      if (write_strobe_i && index_i == 8'h23) ppi_mode_edge1_o <= write_data_i[5];
      if (write_strobe_i && index_i == 8'h23) ppi_mode_tag_o <= write_data_i[8];
      if (write_strobe_i && index_i == 8'h24) pattern_width <= write_data_i[11:4];
      if (write_strobe_i && index_i == 8'h25) pattern_height <= write_data_i[11:3];
      if (write_strobe_i && index_i == 8'h26) pattern_hblank <= write_data_i[9:2];
      if (write_strobe_i && index_i == 8'h27) pattern_vblank_o <= write_data_i[7:0];
      if (write_strobe_i && index_i == 8'h28) pattern_kind_o <= write_data_i[2:0];
      if (write_strobe_i && index_i == 8'h29) pattern_seed_o <= write_data_i[9:0];
      if (write_strobe_i && index_i == 8'h2A) expect_width_o <= write_data_i[11:0];
      if (write_strobe_i && index_i == 8'h2B) expect_height_o <= write_data_i[11:0];
      if (write_strobe_i && index_i == 8'h41) trigger_delay_us_o <= write_data_i[15:0];
      if (write_strobe_i && index_i == 8'h42) trigger_width_us_o <= write_data_i[15:0];
      if (write_strobe_i && index_i == 8'h48) sensor_reset_n_o <= write_data_i[1:0];
      if (write_strobe_i && index_i == 8'h48) sensor_standby_o <= write_data_i[3:2];
      if (write_strobe_i && index_i == 8'h48) sensor_oe_o <= write_data_i[5:4];
      if (write_strobe_i && index_i == 8'h48) sensor_extclk_o <= write_data_i[7:6];
      if (write_strobe_i && index_i == 8'h56) branch_ctrl_router_enable_o <= write_data_i[0];
      if (write_strobe_i && index_i == 8'h56) branch_ctrl_bypass_o <= write_data_i[2:1];
    end
  end

  assign ctrl_soft_reset_o = (write_strobe_i && index_i == 8'h08) & write_data_i[14];
  assign irq_status_clear_o = {8{write_strobe_i && index_i == 8'h0A}} & write_data_i[7:0];
  assign irq_test_o = {8{write_strobe_i && index_i == 8'h0C}} & write_data_i[7:0];
  assign wdg_fired_clear_o = write_strobe_i && index_i == 8'h0F && write_data_i[8];
  assign servo0_min_q4_o = {servo0_min_q4, 6'd0};
  assign servo0_max_q4_o = {servo0_max_q4, 6'd0};
  assign servo0_safe_q4_o = {servo0_safe_q4, 6'd0};
  assign servo1_min_q4_o = {servo1_min_q4, 6'd0};
  assign servo1_max_q4_o = {servo1_max_q4, 6'd0};
  assign servo1_safe_q4_o = {servo1_safe_q4, 6'd0};
  assign pattern_width_o = {pattern_width, 4'd0};
  assign pattern_height_o = {pattern_height, 3'd0};
  assign pattern_hblank_o = {pattern_hblank, 2'd0};
  assign trigger_ctrl_fire_o = {2{write_strobe_i && index_i == 8'h40}} & write_data_i[1:0];
  assign i2c_timeouts_clear_o = write_strobe_i && index_i == 8'h51;
  assign i2c_protocol_errors_clear_o = write_strobe_i && index_i == 8'h52;
  assign branch_errors_clear_o = write_strobe_i && index_i == 8'h53;
  assign spikes_clear_o = write_strobe_i && index_i == 8'h54;
  assign bus_clear_o = {2{write_strobe_i && index_i == 8'h55}} & write_data_i[1:0];

  // A snapshot lasts from a block's first word until the transfer leaves it.
  always @(posedge clk_i or posedge rst_i) begin
    if (rst_i) camera0_hold_o <= 1'b0;
    else if (!reading_i) camera0_hold_o <= 1'b0;
    else if (read_strobe_i) camera0_hold_o <=
      index_i == 8'h30 || (camera0_hold_o && index_i[7:3] == 5'h06);
  end
  always @(posedge clk_i or posedge rst_i) begin
    if (rst_i) camera1_hold_o <= 1'b0;
    else if (!reading_i) camera1_hold_o <= 1'b0;
    else if (read_strobe_i) camera1_hold_o <=
      index_i == 8'h38 || (camera1_hold_o && index_i[7:3] == 5'h07);
  end

  // The low half of the 32-bit value whose high half was read last.
  reg fetch;
  reg [15:0] low_word;
  always @(posedge clk_i or posedge rst_i) begin
    if (rst_i) low_word <= 16'd0;
    else if (fetch) case (index_i)
      8'h45: low_word <= frame_time_i[15:0];
      8'h4A: low_word <= time_i[15:0];
      default: ;
    endcase
  end

  // Registers stand in pairs whose indices differ in one bit; a look-up table
  // chooses between the two or takes two bits that stand alone, and a carry
  // chain joins them.
  wire at_00_02 = (index_i & 8'hFD) == 8'h00;
  wire at_02 = at_00_02 & index_i[1];
  wire at_01_03 = (index_i & 8'hFD) == 8'h01;
  wire at_01 = at_01_03 & !index_i[1];
  wire at_03 = at_01_03 & index_i[1];
  wire at_04 = index_i == 8'h04;
  wire at_07_27 = (index_i & 8'hDF) == 8'h07;
  wire at_07 = at_07_27 & !index_i[5];
  wire at_08_48 = (index_i & 8'hBF) == 8'h08;
  wire at_08 = at_08_48 & !index_i[6];
  wire at_48 = at_08_48 & index_i[6];
  wire at_09_29 = (index_i & 8'hDF) == 8'h09;
  wire at_29 = at_09_29 & index_i[5];
  wire at_0a_0b = (index_i & 8'hFE) == 8'h0A;
  wire at_0c_0d = (index_i & 8'hFE) == 8'h0C;
  wire at_0d = at_0c_0d & index_i[0];
  wire at_0e_0f = (index_i & 8'hFE) == 8'h0E;
  wire at_0e = at_0e_0f & !index_i[0];
  wire at_10_11 = (index_i & 8'hFE) == 8'h10;
  wire at_12_1a = (index_i & 8'hF7) == 8'h12;
  wire at_13_1b = (index_i & 8'hF7) == 8'h13;
  wire at_14_1c = (index_i & 8'hF7) == 8'h14;
  wire at_15_1d = (index_i & 8'hF7) == 8'h15;
  wire at_16_1e = (index_i & 8'hF7) == 8'h16;
  wire at_18_19 = (index_i & 8'hFE) == 8'h18;
  wire at_20_28 = (index_i & 8'hF7) == 8'h20;
  wire at_20 = at_20_28 & !index_i[3];
  wire at_28 = at_20_28 & index_i[3];
  wire at_21_23 = (index_i & 8'hFD) == 8'h21;
  wire at_21 = at_21_23 & !index_i[1];
  wire at_23 = at_21_23 & index_i[1];
  wire at_22_26 = (index_i & 8'hFB) == 8'h22;
  wire at_22 = at_22_26 & !index_i[2];
  wire at_26 = at_22_26 & index_i[2];
  wire at_24_25 = (index_i & 8'hFE) == 8'h24;
  wire at_25 = at_24_25 & index_i[0];
  wire at_2a_2b = (index_i & 8'hFE) == 8'h2A;
  wire at_30_34 = (index_i & 8'hFB) == 8'h30;
  wire at_31_39 = (index_i & 8'hF7) == 8'h31;
  wire at_32_3a = (index_i & 8'hF7) == 8'h32;
  wire at_33_3b = (index_i & 8'hF7) == 8'h33;
  wire at_35_3d = (index_i & 8'hF7) == 8'h35;
  wire at_36_3e = (index_i & 8'hF7) == 8'h36;
  wire at_37_3f = (index_i & 8'hF7) == 8'h37;
  wire at_38_3c = (index_i & 8'hFB) == 8'h38;
  wire at_40 = index_i == 8'h40;
  wire at_41_51 = (index_i & 8'hEF) == 8'h41;
  wire at_41 = at_41_51 & !index_i[4];
  wire at_42_46 = (index_i & 8'hFB) == 8'h42;
  wire at_44_45 = (index_i & 8'hFE) == 8'h44;
  wire at_4a_4b = (index_i & 8'hFE) == 8'h4A;
  wire at_50_54 = (index_i & 8'hFB) == 8'h50;
  wire at_50 = at_50_54 & !index_i[2];
  wire at_54 = at_50_54 & index_i[2];
  wire at_52_53 = (index_i & 8'hFE) == 8'h52;
  wire at_55 = index_i == 8'h55;
  wire at_56 = index_i == 8'h56;
  wire [15:0] word;
  carry_or #(.WIDTH(30)) word_0 (.any_o(word[0]), .bits_i({
    at_00_02 & (index_i[1] ? build_i[0] : 1'b1),
    at_07_27 & (index_i[5] ? pattern_vblank_o[0] : servo_period_us_o[0]),
    at_08_48 & (index_i[6] ? sensor_reset_n_o[0] : ctrl_servo0_enable_o),
    at_09_29 & (index_i[5] ? pattern_seed_o[0] : status_servo0_active_i),
    at_0a_0b & (index_i[0] ? irq_enable_o[0] : irq_status_i[0]),
    at_0e_0f & (index_i[0] ? wdg_action_o[0] : wdg_ms_o[0]),
    at_10_11 & (index_i[0] ? servo0_actual_q4_i[0] : servo0_target_q4_o[0]),
    at_15_1d & (index_i[3] ? servo1_slew_q4_o[0] : servo0_slew_q4_o[0]),
    at_16_1e & (index_i[3] ? servo1_frames_i[0] : servo0_frames_i[0]),
    at_18_19 & (index_i[0] ? servo1_actual_q4_i[0] : servo1_target_q4_o[0]),
    at_20_28 & (index_i[3] ? pattern_kind_o[0] : cam_select_source_o[0]),
    at_21_23 & (index_i[1] ? ppi_mode_sync_shape_o : cam_state_active_i[0]),
    at_2a_2b & (index_i[0] ? expect_height_o[0] : expect_width_o[0]),
    at_30_34 & (index_i[2] ? camera0_pixclk_khz_i[0] : camera0_frames_i[0]),
    at_31_39 & (index_i[3] ? camera1_lines_i[0] : camera0_lines_i[0]),
    at_32_3a & (index_i[3] ? camera1_pixels_i[0] : camera0_pixels_i[0]),
    at_33_3b & (index_i[3] ? camera1_period_10us_i[0] : camera0_period_10us_i[0]),
    at_35_3d & (index_i[3] ? camera1_short_lines_i[0] : camera0_short_lines_i[0]),
    at_36_3e & (index_i[3] ? camera1_short_frames_i[0] : camera0_short_frames_i[0]),
    at_37_3f & (index_i[3] ? camera1_flags_lost_i : camera0_flags_lost_i),
    at_38_3c & (index_i[2] ? camera1_pixclk_khz_i[0] : camera1_frames_i[0]),
    at_41_51 & (index_i[4] ? i2c_timeouts_i[0] : trigger_delay_us_o[0]),
    at_42_46 & (index_i[2] ? low_word[0] : trigger_width_us_o[0]),
    at_44_45 & (index_i[0] ? frame_time_i[16] : skew_us_i[0]),
    at_4a_4b & (index_i[0] ? low_word[0] : time_i[16]),
    at_50_54 & (index_i[2] ? spikes_i[0] : i2c_diag_scl_i),
    at_52_53 & (index_i[0] ? branch_errors_i[0] : i2c_protocol_errors_i[0]),
    at_03 & caps_camera1_i | at_04 & scratch_o[0],
    at_0d & unlock_o | at_22 & switch_timeout_ms_o[0],
    at_56 & branch_ctrl_router_enable_o
  }));
  carry_or #(.WIDTH(28)) word_1 (.any_o(word[1]), .bits_i({
    at_07_27 & (index_i[5] ? pattern_vblank_o[1] : servo_period_us_o[1]),
    at_08_48 & (index_i[6] ? sensor_reset_n_o[1] : ctrl_servo1_enable_o),
    at_09_29 & (index_i[5] ? pattern_seed_o[1] : status_servo1_active_i),
    at_0a_0b & (index_i[0] ? irq_enable_o[1] : irq_status_i[1]),
    at_0e_0f & (index_i[0] ? wdg_action_o[1] : wdg_ms_o[1]),
    at_10_11 & (index_i[0] ? servo0_actual_q4_i[1] : servo0_target_q4_o[1]),
    at_15_1d & (index_i[3] ? servo1_slew_q4_o[1] : servo0_slew_q4_o[1]),
    at_16_1e & (index_i[3] ? servo1_frames_i[1] : servo0_frames_i[1]),
    at_18_19 & (index_i[0] ? servo1_actual_q4_i[1] : servo1_target_q4_o[1]),
    at_20_28 & (index_i[3] ? pattern_kind_o[1] : cam_select_source_o[1]),
    at_2a_2b & (index_i[0] ? expect_height_o[1] : expect_width_o[1]),
    at_30_34 & (index_i[2] ? camera0_pixclk_khz_i[1] : camera0_frames_i[1]),
    at_31_39 & (index_i[3] ? camera1_lines_i[1] : camera0_lines_i[1]),
    at_32_3a & (index_i[3] ? camera1_pixels_i[1] : camera0_pixels_i[1]),
    at_33_3b & (index_i[3] ? camera1_period_10us_i[1] : camera0_period_10us_i[1]),
    at_35_3d & (index_i[3] ? camera1_short_lines_i[1] : camera0_short_lines_i[1]),
    at_36_3e & (index_i[3] ? camera1_short_frames_i[1] : camera0_short_frames_i[1]),
    at_37_3f & (index_i[3] ? camera1_flags_frame_valid_i : camera0_flags_frame_valid_i),
    at_38_3c & (index_i[2] ? camera1_pixclk_khz_i[1] : camera1_frames_i[1]),
    at_41_51 & (index_i[4] ? i2c_timeouts_i[1] : trigger_delay_us_o[1]),
    at_42_46 & (index_i[2] ? low_word[1] : trigger_width_us_o[1]),
    at_44_45 & (index_i[0] ? frame_time_i[17] : skew_us_i[1]),
    at_4a_4b & (index_i[0] ? low_word[1] : time_i[17]),
    at_50_54 & (index_i[2] ? spikes_i[1] : i2c_diag_sda_i),
    at_52_53 & (index_i[0] ? branch_errors_i[1] : i2c_protocol_errors_i[1]),
    at_02 & build_i[1] | at_03 & caps_router_i,
    at_04 & scratch_o[1] | at_21 & cam_state_active_i[1],
    at_22 & switch_timeout_ms_o[1] | at_56 & branch_ctrl_bypass_o[0]
  }));
  carry_or #(.WIDTH(27)) word_2 (.any_o(word[2]), .bits_i({
    at_00_02 & (index_i[1] ? build_i[2] : 1'b1),
    at_07_27 & (index_i[5] ? pattern_vblank_o[2] : servo_period_us_o[2]),
    at_09_29 & (index_i[5] ? pattern_seed_o[2] : status_watchdog_fired_i),
    at_0a_0b & (index_i[0] ? irq_enable_o[2] : irq_status_i[2]),
    at_10_11 & (index_i[0] ? servo0_actual_q4_i[2] : servo0_target_q4_o[2]),
    at_15_1d & (index_i[3] ? servo1_slew_q4_o[2] : servo0_slew_q4_o[2]),
    at_16_1e & (index_i[3] ? servo1_frames_i[2] : servo0_frames_i[2]),
    at_18_19 & (index_i[0] ? servo1_actual_q4_i[2] : servo1_target_q4_o[2]),
    at_22_26 & (index_i[2] ? pattern_hblank_o[2] : switch_timeout_ms_o[2]),
    at_2a_2b & (index_i[0] ? expect_height_o[2] : expect_width_o[2]),
    at_30_34 & (index_i[2] ? camera0_pixclk_khz_i[2] : camera0_frames_i[2]),
    at_31_39 & (index_i[3] ? camera1_lines_i[2] : camera0_lines_i[2]),
    at_32_3a & (index_i[3] ? camera1_pixels_i[2] : camera0_pixels_i[2]),
    at_33_3b & (index_i[3] ? camera1_period_10us_i[2] : camera0_period_10us_i[2]),
    at_35_3d & (index_i[3] ? camera1_short_lines_i[2] : camera0_short_lines_i[2]),
    at_36_3e & (index_i[3] ? camera1_short_frames_i[2] : camera0_short_frames_i[2]),
    at_37_3f & (index_i[3] ? camera1_flags_short_line_i : camera0_flags_short_line_i),
    at_38_3c & (index_i[2] ? camera1_pixclk_khz_i[2] : camera1_frames_i[2]),
    at_41_51 & (index_i[4] ? i2c_timeouts_i[2] : trigger_delay_us_o[2]),
    at_42_46 & (index_i[2] ? low_word[2] : trigger_width_us_o[2]),
    at_44_45 & (index_i[0] ? frame_time_i[18] : skew_us_i[2]),
    at_4a_4b & (index_i[0] ? low_word[2] : time_i[18]),
    at_50_54 & (index_i[2] ? spikes_i[2] : i2c_diag_branch_scl_i[0]),
    at_52_53 & (index_i[0] ? branch_errors_i[2] : i2c_protocol_errors_i[2]),
    at_03 & caps_pattern_i | at_04 & scratch_o[2],
    at_48 & sensor_standby_o[0] | at_0e & wdg_ms_o[2],
    at_28 & pattern_kind_o[2] | at_56 & branch_ctrl_bypass_o[1]
  }));
  carry_or #(.WIDTH(27)) word_3 (.any_o(word[3]), .bits_i({
    at_00_02 & (index_i[1] ? build_i[3] : 1'b1),
    at_07_27 & (index_i[5] ? pattern_vblank_o[3] : servo_period_us_o[3]),
    at_09_29 & (index_i[5] ? pattern_seed_o[3] : status_camera0_lost_i),
    at_0a_0b & (index_i[0] ? irq_enable_o[3] : irq_status_i[3]),
    at_10_11 & (index_i[0] ? servo0_actual_q4_i[3] : servo0_target_q4_o[3]),
    at_15_1d & (index_i[3] ? servo1_slew_q4_o[3] : servo0_slew_q4_o[3]),
    at_16_1e & (index_i[3] ? servo1_frames_i[3] : servo0_frames_i[3]),
    at_18_19 & (index_i[0] ? servo1_actual_q4_i[3] : servo1_target_q4_o[3]),
    at_22_26 & (index_i[2] ? pattern_hblank_o[3] : switch_timeout_ms_o[3]),
    at_2a_2b & (index_i[0] ? expect_height_o[3] : expect_width_o[3]),
    at_30_34 & (index_i[2] ? camera0_pixclk_khz_i[3] : camera0_frames_i[3]),
    at_31_39 & (index_i[3] ? camera1_lines_i[3] : camera0_lines_i[3]),
    at_32_3a & (index_i[3] ? camera1_pixels_i[3] : camera0_pixels_i[3]),
    at_33_3b & (index_i[3] ? camera1_period_10us_i[3] : camera0_period_10us_i[3]),
    at_35_3d & (index_i[3] ? camera1_short_lines_i[3] : camera0_short_lines_i[3]),
    at_36_3e & (index_i[3] ? camera1_short_frames_i[3] : camera0_short_frames_i[3]),
    at_37_3f & (index_i[3] ? camera1_flags_short_frame_i : camera0_flags_short_frame_i),
    at_38_3c & (index_i[2] ? camera1_pixclk_khz_i[3] : camera1_frames_i[3]),
    at_41_51 & (index_i[4] ? i2c_timeouts_i[3] : trigger_delay_us_o[3]),
    at_42_46 & (index_i[2] ? low_word[3] : trigger_width_us_o[3]),
    at_44_45 & (index_i[0] ? frame_time_i[19] : skew_us_i[3]),
    at_4a_4b & (index_i[0] ? low_word[3] : time_i[19]),
    at_50_54 & (index_i[2] ? spikes_i[3] : i2c_diag_branch_scl_i[1]),
    at_52_53 & (index_i[0] ? branch_errors_i[3] : i2c_protocol_errors_i[3]),
    at_03 & caps_trigger_i | at_04 & scratch_o[3],
    at_48 & sensor_standby_o[1] | at_0e & wdg_ms_o[3],
    at_25 & pattern_height_o[3]
  }));
  carry_or #(.WIDTH(28)) word_4 (.any_o(word[4]), .bits_i({
    at_00_02 & (index_i[1] ? build_i[4] : 1'b1),
    at_07_27 & (index_i[5] ? pattern_vblank_o[4] : servo_period_us_o[4]),
    at_09_29 & (index_i[5] ? pattern_seed_o[4] : status_camera1_lost_i),
    at_0a_0b & (index_i[0] ? irq_enable_o[4] : irq_status_i[4]),
    at_10_11 & (index_i[0] ? servo0_actual_q4_i[4] : servo0_target_q4_o[4]),
    at_15_1d & (index_i[3] ? servo1_slew_q4_o[4] : servo0_slew_q4_o[4]),
    at_16_1e & (index_i[3] ? servo1_frames_i[4] : servo0_frames_i[4]),
    at_18_19 & (index_i[0] ? servo1_actual_q4_i[4] : servo1_target_q4_o[4]),
    at_21_23 & (index_i[1] ? ppi_mode_edge0_o : cam_state_gate_open_i),
    at_22_26 & (index_i[2] ? pattern_hblank_o[4] : switch_timeout_ms_o[4]),
    at_24_25 & (index_i[0] ? pattern_height_o[4] : pattern_width_o[4]),
    at_2a_2b & (index_i[0] ? expect_height_o[4] : expect_width_o[4]),
    at_30_34 & (index_i[2] ? camera0_pixclk_khz_i[4] : camera0_frames_i[4]),
    at_31_39 & (index_i[3] ? camera1_lines_i[4] : camera0_lines_i[4]),
    at_32_3a & (index_i[3] ? camera1_pixels_i[4] : camera0_pixels_i[4]),
    at_33_3b & (index_i[3] ? camera1_period_10us_i[4] : camera0_period_10us_i[4]),
    at_35_3d & (index_i[3] ? camera1_short_lines_i[4] : camera0_short_lines_i[4]),
    at_36_3e & (index_i[3] ? camera1_short_frames_i[4] : camera0_short_frames_i[4]),
    at_37_3f & (index_i[3] ? camera1_flags_cut_i : camera0_flags_cut_i),
    at_38_3c & (index_i[2] ? camera1_pixclk_khz_i[4] : camera1_frames_i[4]),
    at_41_51 & (index_i[4] ? i2c_timeouts_i[4] : trigger_delay_us_o[4]),
    at_42_46 & (index_i[2] ? low_word[4] : trigger_width_us_o[4]),
    at_44_45 & (index_i[0] ? frame_time_i[20] : skew_us_i[4]),
    at_4a_4b & (index_i[0] ? low_word[4] : time_i[20]),
    at_50_54 & (index_i[2] ? spikes_i[4] : i2c_diag_branch_sda_i[0]),
    at_52_53 & (index_i[0] ? branch_errors_i[4] : i2c_protocol_errors_i[4]),
    at_03 & caps_alternating_i | at_04 & scratch_o[4],
    at_48 & sensor_oe_o[0] | at_0e & wdg_ms_o[4]
  }));
  carry_or #(.WIDTH(27)) word_5 (.any_o(word[5]), .bits_i({
    at_07_27 & (index_i[5] ? pattern_vblank_o[5] : servo_period_us_o[5]),
    at_09_29 & (index_i[5] ? pattern_seed_o[5] : status_switching_i),
    at_0a_0b & (index_i[0] ? irq_enable_o[5] : irq_status_i[5]),
    at_10_11 & (index_i[0] ? servo0_actual_q4_i[5] : servo0_target_q4_o[5]),
    at_15_1d & (index_i[3] ? servo1_slew_q4_o[5] : servo0_slew_q4_o[5]),
    at_16_1e & (index_i[3] ? servo1_frames_i[5] : servo0_frames_i[5]),
    at_18_19 & (index_i[0] ? servo1_actual_q4_i[5] : servo1_target_q4_o[5]),
    at_21_23 & (index_i[1] ? ppi_mode_edge1_o : cam_state_switching_i),
    at_22_26 & (index_i[2] ? pattern_hblank_o[5] : switch_timeout_ms_o[5]),
    at_24_25 & (index_i[0] ? pattern_height_o[5] : pattern_width_o[5]),
    at_2a_2b & (index_i[0] ? expect_height_o[5] : expect_width_o[5]),
    at_30_34 & (index_i[2] ? camera0_pixclk_khz_i[5] : camera0_frames_i[5]),
    at_31_39 & (index_i[3] ? camera1_lines_i[5] : camera0_lines_i[5]),
    at_32_3a & (index_i[3] ? camera1_pixels_i[5] : camera0_pixels_i[5]),
    at_33_3b & (index_i[3] ? camera1_period_10us_i[5] : camera0_period_10us_i[5]),
    at_35_3d & (index_i[3] ? camera1_short_lines_i[5] : camera0_short_lines_i[5]),
    at_36_3e & (index_i[3] ? camera1_short_frames_i[5] : camera0_short_frames_i[5]),
    at_38_3c & (index_i[2] ? camera1_pixclk_khz_i[5] : camera1_frames_i[5]),
    at_41_51 & (index_i[4] ? i2c_timeouts_i[5] : trigger_delay_us_o[5]),
    at_42_46 & (index_i[2] ? low_word[5] : trigger_width_us_o[5]),
    at_44_45 & (index_i[0] ? frame_time_i[21] : skew_us_i[5]),
    at_4a_4b & (index_i[0] ? low_word[5] : time_i[21]),
    at_50_54 & (index_i[2] ? spikes_i[5] : i2c_diag_branch_sda_i[1]),
    at_52_53 & (index_i[0] ? branch_errors_i[5] : i2c_protocol_errors_i[5]),
    at_02 & build_i[5] | at_03 & caps_tag_i,
    at_04 & scratch_o[5] | at_48 & sensor_oe_o[1],
    at_0e & wdg_ms_o[5]
  }));
  carry_or #(.WIDTH(28)) word_6 (.any_o(word[6]), .bits_i({
    at_07_27 & (index_i[5] ? pattern_vblank_o[6] : servo_period_us_o[6]),
    at_09_29 & (index_i[5] ? pattern_seed_o[6] : status_irq_line_i),
    at_0a_0b & (index_i[0] ? irq_enable_o[6] : irq_status_i[6]),
    at_10_11 & (index_i[0] ? servo0_actual_q4_i[6] : servo0_target_q4_o[6]),
    at_12_1a & (index_i[3] ? servo1_min_q4_o[6] : servo0_min_q4_o[6]),
    at_13_1b & (index_i[3] ? servo1_max_q4_o[6] : servo0_max_q4_o[6]),
    at_14_1c & (index_i[3] ? servo1_safe_q4_o[6] : servo0_safe_q4_o[6]),
    at_15_1d & (index_i[3] ? servo1_slew_q4_o[6] : servo0_slew_q4_o[6]),
    at_16_1e & (index_i[3] ? servo1_frames_i[6] : servo0_frames_i[6]),
    at_18_19 & (index_i[0] ? servo1_actual_q4_i[6] : servo1_target_q4_o[6]),
    at_22_26 & (index_i[2] ? pattern_hblank_o[6] : switch_timeout_ms_o[6]),
    at_24_25 & (index_i[0] ? pattern_height_o[6] : pattern_width_o[6]),
    at_2a_2b & (index_i[0] ? expect_height_o[6] : expect_width_o[6]),
    at_30_34 & (index_i[2] ? camera0_pixclk_khz_i[6] : camera0_frames_i[6]),
    at_31_39 & (index_i[3] ? camera1_lines_i[6] : camera0_lines_i[6]),
    at_32_3a & (index_i[3] ? camera1_pixels_i[6] : camera0_pixels_i[6]),
    at_33_3b & (index_i[3] ? camera1_period_10us_i[6] : camera0_period_10us_i[6]),
    at_35_3d & (index_i[3] ? camera1_short_lines_i[6] : camera0_short_lines_i[6]),
    at_36_3e & (index_i[3] ? camera1_short_frames_i[6] : camera0_short_frames_i[6]),
    at_38_3c & (index_i[2] ? camera1_pixclk_khz_i[6] : camera1_frames_i[6]),
    at_41_51 & (index_i[4] ? i2c_timeouts_i[6] : trigger_delay_us_o[6]),
    at_42_46 & (index_i[2] ? low_word[6] : trigger_width_us_o[6]),
    at_44_45 & (index_i[0] ? frame_time_i[22] : skew_us_i[6]),
    at_4a_4b & (index_i[0] ? low_word[6] : time_i[22]),
    at_52_53 & (index_i[0] ? branch_errors_i[6] : i2c_protocol_errors_i[6]),
    at_02 & build_i[6] | at_04 & scratch_o[6],
    at_48 & sensor_extclk_o[0] | at_0e & wdg_ms_o[6],
    at_21 & cam_state_forced_i | at_54 & spikes_i[6]
  }));
  carry_or #(.WIDTH(27)) word_7 (.any_o(word[7]), .bits_i({
    at_07_27 & (index_i[5] ? pattern_vblank_o[7] : servo_period_us_o[7]),
    at_0a_0b & (index_i[0] ? irq_enable_o[7] : irq_status_i[7]),
    at_10_11 & (index_i[0] ? servo0_actual_q4_i[7] : servo0_target_q4_o[7]),
    at_12_1a & (index_i[3] ? servo1_min_q4_o[7] : servo0_min_q4_o[7]),
    at_13_1b & (index_i[3] ? servo1_max_q4_o[7] : servo0_max_q4_o[7]),
    at_14_1c & (index_i[3] ? servo1_safe_q4_o[7] : servo0_safe_q4_o[7]),
    at_15_1d & (index_i[3] ? servo1_slew_q4_o[7] : servo0_slew_q4_o[7]),
    at_16_1e & (index_i[3] ? servo1_frames_i[7] : servo0_frames_i[7]),
    at_18_19 & (index_i[0] ? servo1_actual_q4_i[7] : servo1_target_q4_o[7]),
    at_22_26 & (index_i[2] ? pattern_hblank_o[7] : switch_timeout_ms_o[7]),
    at_24_25 & (index_i[0] ? pattern_height_o[7] : pattern_width_o[7]),
    at_2a_2b & (index_i[0] ? expect_height_o[7] : expect_width_o[7]),
    at_30_34 & (index_i[2] ? camera0_pixclk_khz_i[7] : camera0_frames_i[7]),
    at_31_39 & (index_i[3] ? camera1_lines_i[7] : camera0_lines_i[7]),
    at_32_3a & (index_i[3] ? camera1_pixels_i[7] : camera0_pixels_i[7]),
    at_33_3b & (index_i[3] ? camera1_period_10us_i[7] : camera0_period_10us_i[7]),
    at_35_3d & (index_i[3] ? camera1_short_lines_i[7] : camera0_short_lines_i[7]),
    at_36_3e & (index_i[3] ? camera1_short_frames_i[7] : camera0_short_frames_i[7]),
    at_38_3c & (index_i[2] ? camera1_pixclk_khz_i[7] : camera1_frames_i[7]),
    at_41_51 & (index_i[4] ? i2c_timeouts_i[7] : trigger_delay_us_o[7]),
    at_42_46 & (index_i[2] ? low_word[7] : trigger_width_us_o[7]),
    at_44_45 & (index_i[0] ? frame_time_i[23] : skew_us_i[7]),
    at_4a_4b & (index_i[0] ? low_word[7] : time_i[23]),
    at_52_53 & (index_i[0] ? branch_errors_i[7] : i2c_protocol_errors_i[7]),
    at_02 & build_i[7] | at_04 & scratch_o[7],
    at_48 & sensor_extclk_o[1] | at_29 & pattern_seed_o[7],
    at_0e & wdg_ms_o[7] | at_54 & spikes_i[7]
  }));
  carry_or #(.WIDTH(24)) word_8 (.any_o(word[8]), .bits_i({
    at_00_02 & (index_i[1] ? build_i[8] : 1'b1),
    at_0e_0f & (index_i[0] ? wdg_fired_i : wdg_ms_o[8]),
    at_10_11 & (index_i[0] ? servo0_actual_q4_i[8] : servo0_target_q4_o[8]),
    at_12_1a & (index_i[3] ? servo1_min_q4_o[8] : servo0_min_q4_o[8]),
    at_13_1b & (index_i[3] ? servo1_max_q4_o[8] : servo0_max_q4_o[8]),
    at_14_1c & (index_i[3] ? servo1_safe_q4_o[8] : servo0_safe_q4_o[8]),
    at_15_1d & (index_i[3] ? servo1_slew_q4_o[8] : servo0_slew_q4_o[8]),
    at_18_19 & (index_i[0] ? servo1_actual_q4_i[8] : servo1_target_q4_o[8]),
    at_24_25 & (index_i[0] ? pattern_height_o[8] : pattern_width_o[8]),
    at_2a_2b & (index_i[0] ? expect_height_o[8] : expect_width_o[8]),
    at_30_34 & (index_i[2] ? camera0_pixclk_khz_i[8] : camera0_frames_i[8]),
    at_31_39 & (index_i[3] ? camera1_lines_i[8] : camera0_lines_i[8]),
    at_32_3a & (index_i[3] ? camera1_pixels_i[8] : camera0_pixels_i[8]),
    at_33_3b & (index_i[3] ? camera1_period_10us_i[8] : camera0_period_10us_i[8]),
    at_38_3c & (index_i[2] ? camera1_pixclk_khz_i[8] : camera1_frames_i[8]),
    at_42_46 & (index_i[2] ? low_word[8] : trigger_width_us_o[8]),
    at_44_45 & (index_i[0] ? frame_time_i[24] : skew_us_i[8]),
    at_4a_4b & (index_i[0] ? low_word[8] : time_i[24]),
    at_01 | at_04 & scratch_o[8],
    at_07 & servo_period_us_o[8] | at_08 & ctrl_stream_enable_o,
    at_29 & pattern_seed_o[8] | at_20 & cam_select_alternating_o,
    at_23 & ppi_mode_tag_o | at_26 & pattern_hblank_o[8],
    at_40 & trigger_ctrl_busy_i | at_41 & trigger_delay_us_o[8],
    at_50 & i2c_diag_clear_busy_i
  }));
  carry_or #(.WIDTH(21)) word_9 (.any_o(word[9]), .bits_i({
    at_00_02 & (index_i[1] ? build_i[9] : 1'b1),
    at_10_11 & (index_i[0] ? servo0_actual_q4_i[9] : servo0_target_q4_o[9]),
    at_12_1a & (index_i[3] ? servo1_min_q4_o[9] : servo0_min_q4_o[9]),
    at_13_1b & (index_i[3] ? servo1_max_q4_o[9] : servo0_max_q4_o[9]),
    at_14_1c & (index_i[3] ? servo1_safe_q4_o[9] : servo0_safe_q4_o[9]),
    at_15_1d & (index_i[3] ? servo1_slew_q4_o[9] : servo0_slew_q4_o[9]),
    at_18_19 & (index_i[0] ? servo1_actual_q4_i[9] : servo1_target_q4_o[9]),
    at_24_25 & (index_i[0] ? pattern_height_o[9] : pattern_width_o[9]),
    at_2a_2b & (index_i[0] ? expect_height_o[9] : expect_width_o[9]),
    at_30_34 & (index_i[2] ? camera0_pixclk_khz_i[9] : camera0_frames_i[9]),
    at_31_39 & (index_i[3] ? camera1_lines_i[9] : camera0_lines_i[9]),
    at_32_3a & (index_i[3] ? camera1_pixels_i[9] : camera0_pixels_i[9]),
    at_33_3b & (index_i[3] ? camera1_period_10us_i[9] : camera0_period_10us_i[9]),
    at_38_3c & (index_i[2] ? camera1_pixclk_khz_i[9] : camera1_frames_i[9]),
    at_42_46 & (index_i[2] ? low_word[9] : trigger_width_us_o[9]),
    at_44_45 & (index_i[0] ? frame_time_i[25] : skew_us_i[9]),
    at_4a_4b & (index_i[0] ? low_word[9] : time_i[25]),
    at_04 & scratch_o[9] | at_07 & servo_period_us_o[9],
    at_29 & pattern_seed_o[9] | at_0e & wdg_ms_o[9],
    at_20 & cam_select_frames_each_o[0] | at_26 & pattern_hblank_o[9],
    at_41 & trigger_delay_us_o[9]
  }));
  carry_or #(.WIDTH(19)) word_10 (.any_o(word[10]), .bits_i({
    at_10_11 & (index_i[0] ? servo0_actual_q4_i[10] : servo0_target_q4_o[10]),
    at_12_1a & (index_i[3] ? servo1_min_q4_o[10] : servo0_min_q4_o[10]),
    at_13_1b & (index_i[3] ? servo1_max_q4_o[10] : servo0_max_q4_o[10]),
    at_14_1c & (index_i[3] ? servo1_safe_q4_o[10] : servo0_safe_q4_o[10]),
    at_15_1d & (index_i[3] ? servo1_slew_q4_o[10] : servo0_slew_q4_o[10]),
    at_18_19 & (index_i[0] ? servo1_actual_q4_i[10] : servo1_target_q4_o[10]),
    at_24_25 & (index_i[0] ? pattern_height_o[10] : pattern_width_o[10]),
    at_2a_2b & (index_i[0] ? expect_height_o[10] : expect_width_o[10]),
    at_30_34 & (index_i[2] ? camera0_pixclk_khz_i[10] : camera0_frames_i[10]),
    at_31_39 & (index_i[3] ? camera1_lines_i[10] : camera0_lines_i[10]),
    at_32_3a & (index_i[3] ? camera1_pixels_i[10] : camera0_pixels_i[10]),
    at_33_3b & (index_i[3] ? camera1_period_10us_i[10] : camera0_period_10us_i[10]),
    at_38_3c & (index_i[2] ? camera1_pixclk_khz_i[10] : camera1_frames_i[10]),
    at_42_46 & (index_i[2] ? low_word[10] : trigger_width_us_o[10]),
    at_44_45 & (index_i[0] ? frame_time_i[26] : skew_us_i[10]),
    at_4a_4b & (index_i[0] ? low_word[10] : time_i[26]),
    at_02 & build_i[10] | at_04 & scratch_o[10],
    at_07 & servo_period_us_o[10] | at_0e & wdg_ms_o[10],
    at_20 & cam_select_frames_each_o[1] | at_41 & trigger_delay_us_o[10]
  }));
  carry_or #(.WIDTH(19)) word_11 (.any_o(word[11]), .bits_i({
    at_00_02 & (index_i[1] ? build_i[11] : 1'b1),
    at_10_11 & (index_i[0] ? servo0_actual_q4_i[11] : servo0_target_q4_o[11]),
    at_12_1a & (index_i[3] ? servo1_min_q4_o[11] : servo0_min_q4_o[11]),
    at_13_1b & (index_i[3] ? servo1_max_q4_o[11] : servo0_max_q4_o[11]),
    at_14_1c & (index_i[3] ? servo1_safe_q4_o[11] : servo0_safe_q4_o[11]),
    at_18_19 & (index_i[0] ? servo1_actual_q4_i[11] : servo1_target_q4_o[11]),
    at_24_25 & (index_i[0] ? pattern_height_o[11] : pattern_width_o[11]),
    at_2a_2b & (index_i[0] ? expect_height_o[11] : expect_width_o[11]),
    at_30_34 & (index_i[2] ? camera0_pixclk_khz_i[11] : camera0_frames_i[11]),
    at_31_39 & (index_i[3] ? camera1_lines_i[11] : camera0_lines_i[11]),
    at_32_3a & (index_i[3] ? camera1_pixels_i[11] : camera0_pixels_i[11]),
    at_33_3b & (index_i[3] ? camera1_period_10us_i[11] : camera0_period_10us_i[11]),
    at_38_3c & (index_i[2] ? camera1_pixclk_khz_i[11] : camera1_frames_i[11]),
    at_42_46 & (index_i[2] ? low_word[11] : trigger_width_us_o[11]),
    at_44_45 & (index_i[0] ? frame_time_i[27] : skew_us_i[11]),
    at_4a_4b & (index_i[0] ? low_word[11] : time_i[27]),
    at_04 & scratch_o[11] | at_07 & servo_period_us_o[11],
    at_0e & wdg_ms_o[11] | at_20 & cam_select_frames_each_o[2],
    at_41 & trigger_delay_us_o[11]
  }));
  carry_or #(.WIDTH(15)) word_12 (.any_o(word[12]), .bits_i({
    at_00_02 & (index_i[1] ? build_i[12] : 1'b1),
    at_10_11 & (index_i[0] ? servo0_actual_q4_i[12] : servo0_target_q4_o[12]),
    at_12_1a & (index_i[3] ? servo1_min_q4_o[12] : servo0_min_q4_o[12]),
    at_13_1b & (index_i[3] ? servo1_max_q4_o[12] : servo0_max_q4_o[12]),
    at_14_1c & (index_i[3] ? servo1_safe_q4_o[12] : servo0_safe_q4_o[12]),
    at_18_19 & (index_i[0] ? servo1_actual_q4_i[12] : servo1_target_q4_o[12]),
    at_30_34 & (index_i[2] ? camera0_pixclk_khz_i[12] : camera0_frames_i[12]),
    at_33_3b & (index_i[3] ? camera1_period_10us_i[12] : camera0_period_10us_i[12]),
    at_38_3c & (index_i[2] ? camera1_pixclk_khz_i[12] : camera1_frames_i[12]),
    at_42_46 & (index_i[2] ? low_word[12] : trigger_width_us_o[12]),
    at_44_45 & (index_i[0] ? frame_time_i[28] : skew_us_i[12]),
    at_4a_4b & (index_i[0] ? low_word[12] : time_i[28]),
    at_04 & scratch_o[12] | at_07 & servo_period_us_o[12],
    at_0e & wdg_ms_o[12] | at_20 & cam_select_frames_each_o[3],
    at_41 & trigger_delay_us_o[12]
  }));
  carry_or #(.WIDTH(14)) word_13 (.any_o(word[13]), .bits_i({
    at_10_11 & (index_i[0] ? servo0_actual_q4_i[13] : servo0_target_q4_o[13]),
    at_12_1a & (index_i[3] ? servo1_min_q4_o[13] : servo0_min_q4_o[13]),
    at_13_1b & (index_i[3] ? servo1_max_q4_o[13] : servo0_max_q4_o[13]),
    at_14_1c & (index_i[3] ? servo1_safe_q4_o[13] : servo0_safe_q4_o[13]),
    at_18_19 & (index_i[0] ? servo1_actual_q4_i[13] : servo1_target_q4_o[13]),
    at_30_34 & (index_i[2] ? camera0_pixclk_khz_i[13] : camera0_frames_i[13]),
    at_33_3b & (index_i[3] ? camera1_period_10us_i[13] : camera0_period_10us_i[13]),
    at_38_3c & (index_i[2] ? camera1_pixclk_khz_i[13] : camera1_frames_i[13]),
    at_42_46 & (index_i[2] ? low_word[13] : trigger_width_us_o[13]),
    at_44_45 & (index_i[0] ? frame_time_i[29] : skew_us_i[13]),
    at_4a_4b & (index_i[0] ? low_word[13] : time_i[29]),
    at_02 & build_i[13] | at_04 & scratch_o[13],
    at_07 & servo_period_us_o[13] | at_0e & wdg_ms_o[13],
    at_20 & cam_select_frames_each_o[4] | at_41 & trigger_delay_us_o[13]
  }));
  carry_or #(.WIDTH(15)) word_14 (.any_o(word[14]), .bits_i({
    at_00_02 & (index_i[1] ? build_i[14] : 1'b1),
    at_10_11 & (index_i[0] ? servo0_actual_q4_i[14] : servo0_target_q4_o[14]),
    at_12_1a & (index_i[3] ? servo1_min_q4_o[14] : servo0_min_q4_o[14]),
    at_13_1b & (index_i[3] ? servo1_max_q4_o[14] : servo0_max_q4_o[14]),
    at_14_1c & (index_i[3] ? servo1_safe_q4_o[14] : servo0_safe_q4_o[14]),
    at_18_19 & (index_i[0] ? servo1_actual_q4_i[14] : servo1_target_q4_o[14]),
    at_30_34 & (index_i[2] ? camera0_pixclk_khz_i[14] : camera0_frames_i[14]),
    at_33_3b & (index_i[3] ? camera1_period_10us_i[14] : camera0_period_10us_i[14]),
    at_38_3c & (index_i[2] ? camera1_pixclk_khz_i[14] : camera1_frames_i[14]),
    at_42_46 & (index_i[2] ? low_word[14] : trigger_width_us_o[14]),
    at_44_45 & (index_i[0] ? frame_time_i[30] : skew_us_i[14]),
    at_4a_4b & (index_i[0] ? low_word[14] : time_i[30]),
    at_04 & scratch_o[14] | at_07 & servo_period_us_o[14],
    at_0e & wdg_ms_o[14] | at_20 & cam_select_frames_each_o[5],
    at_41 & trigger_delay_us_o[14]
  }));
  carry_or #(.WIDTH(13)) word_15 (.any_o(word[15]), .bits_i({
    at_10_11 & (index_i[0] ? servo0_actual_q4_i[15] : servo0_target_q4_o[15]),
    at_13_1b & (index_i[3] ? servo1_max_q4_o[15] : servo0_max_q4_o[15]),
    at_14_1c & (index_i[3] ? servo1_safe_q4_o[15] : servo0_safe_q4_o[15]),
    at_18_19 & (index_i[0] ? servo1_actual_q4_i[15] : servo1_target_q4_o[15]),
    at_30_34 & (index_i[2] ? camera0_pixclk_khz_i[15] : camera0_frames_i[15]),
    at_33_3b & (index_i[3] ? camera1_period_10us_i[15] : camera0_period_10us_i[15]),
    at_38_3c & (index_i[2] ? camera1_pixclk_khz_i[15] : camera1_frames_i[15]),
    at_42_46 & (index_i[2] ? low_word[15] : trigger_width_us_o[15]),
    at_44_45 & (index_i[0] ? frame_time_i[31] : skew_us_i[15]),
    at_4a_4b & (index_i[0] ? low_word[15] : time_i[31]),
    at_02 & build_i[15] | at_04 & scratch_o[15],
    at_0e & wdg_ms_o[15] | at_20 & cam_select_frames_each_o[6],
    at_41 & trigger_delay_us_o[15]
  }));

  wire known = at_00_02 | at_01_03 | at_04 | at_07_27 | at_08_48 | at_09_29 | at_0a_0b | at_0c_0d |
    at_0e_0f | at_10_11 | at_12_1a | at_13_1b | at_14_1c | at_15_1d | at_16_1e | at_18_19 | at_20_28
    | at_21_23 | at_22_26 | at_24_25 | at_2a_2b | at_30_34 | at_31_39 | at_32_3a | at_33_3b |
    at_35_3d | at_36_3e | at_37_3f | at_38_3c | at_40 | at_41_51 | at_42_46 | at_44_45 | at_4a_4b |
    at_50_54 | at_52_53 | at_55 | at_56;

  always @(posedge clk_i or posedge rst_i) begin
    if (rst_i) begin
      fetch <= 1'b0;
      read_data_o <= 16'd0;
      index_known_o <= 1'b0;
    end else begin
      fetch <= read_strobe_i;
      if (fetch) read_data_o <= word;
      index_known_o <= known;
    end
  end

`ifdef FORMAL
`include "register_file_properties.vh"
`endif

endmodule

`default_nettype wire
