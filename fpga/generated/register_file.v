// SPDX-License-Identifier: Apache-2.0
// Made by fpga/tools/registers.py from fpga/registers.rdl; do not edit.
//
// Registers of the bridge between the I2C target and the hardware.
//
//            ___     ___     ___     ___     ___     ___     ___
// clk_i    _|   |___|   |___|   |___|   |___|   |___|   |___|   |__
// index_i  =X== index, held for at least two clocks ==============
//                  _______
// write_strobe_i _|       |_______________________________________
// committed_o    _________|^^^^^^^|_______________________________
// a port _o      =================X= new value ===================
//                  _______
// read_strobe_i  _|       |_______________________________________
// read_data_o    =================X= word, held ==================
//
// A write is compared with its limits in the first clock and stored in the second. A number outside
// its limits is moved to the nearer one; a code without a name is not stored; what is only for the
// unlocked map is not stored while it is locked.
// Ports: <register>[_<field>] with _o for what software sets, _i for what hardware tells,
// _clear_o and _set_o for pulses of one clock. Latency: 2 clocks for reads and writes.

`default_nettype none

module register_file (
  input  wire clk_i,
  input  wire rst_i,
  input  wire [7:0] index_i,
  output reg  index_known_o,
  input  wire reading_i,
  input  wire read_strobe_i,
  output reg  [15:0] read_data_o,
  input  wire write_strobe_i,
  input  wire [15:0] write_data_i,
  output wire committed_o,
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
  output wire [15:0] servo0_min_q4_o,
  output wire [15:0] servo0_max_q4_o,
  output wire [15:0] servo0_safe_q4_o,
  output reg  [11:0] servo0_slew_q4_o,
  input  wire [15:0] servo0_frames_i,
  output reg  [15:0] servo1_target_q4_o,
  input  wire [15:0] servo1_actual_q4_i,
  output wire [15:0] servo1_min_q4_o,
  output wire [15:0] servo1_max_q4_o,
  output wire [15:0] servo1_safe_q4_o,
  output reg  [11:0] servo1_slew_q4_o,
  input  wire [15:0] servo1_frames_i,
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
  input  wire [31:0] frame_time_i,
  output reg  [1:0] sensor_reset_n_o,
  output reg  [1:0] sensor_standby_o,
  output reg  [1:0] sensor_oe_o,
  output reg  [1:0] sensor_extclk_o,
  input  wire [31:0] time_i,
  output wire        time_set_o,
  output wire [31:0] time_value_o,
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

  // Limits of the register at the index.
  reg [15:0] lowest;
  reg [15:0] highest;
  reg unlock_only;
  always @* begin
    lowest = 16'd0;
    highest = 16'hFFFF;
    unlock_only = 1'b0;
    case (index_i)
      8'h07: begin  // servo_period_us
        lowest = 16'd15000;
        highest = 16'd25000;
        unlock_only = 1'b1;
      end
      8'h0E: begin  // wdg_ms
        lowest = unlock_o ? 16'd0 : 16'd1;
      end
      8'h10: begin  // servo0_target_q4
        lowest = 16'd9600;
        highest = 16'd38400;
      end
      8'h12: begin  // servo0_min_q4
        lowest = 16'd9600;
        highest = servo0_max_q4_o;
        unlock_only = 1'b1;
      end
      8'h13: begin  // servo0_max_q4
        lowest = servo0_min_q4_o;
        highest = 16'd38400;
        unlock_only = 1'b1;
      end
      8'h14: begin  // servo0_safe_q4
        lowest = 16'd9600;
        highest = 16'd38400;
      end
      8'h15: begin  // servo0_slew_q4
        highest = 16'd4095;
      end
      8'h18: begin  // servo1_target_q4
        lowest = 16'd9600;
        highest = 16'd38400;
      end
      8'h1A: begin  // servo1_min_q4
        lowest = 16'd9600;
        highest = servo1_max_q4_o;
        unlock_only = 1'b1;
      end
      8'h1B: begin  // servo1_max_q4
        lowest = servo1_min_q4_o;
        highest = 16'd38400;
        unlock_only = 1'b1;
      end
      8'h1C: begin  // servo1_safe_q4
        lowest = 16'd9600;
        highest = 16'd38400;
      end
      8'h1D: begin  // servo1_slew_q4
        highest = 16'd4095;
      end
      8'h22: begin  // switch_timeout_ms
        lowest = 16'd1;
        highest = 16'd255;
      end
      8'h24: begin  // pattern_width
        lowest = 16'd16;
        highest = 16'd4095;
      end
      8'h25: begin  // pattern_height
        lowest = 16'd1;
        highest = 16'd4095;
      end
      8'h26: begin  // pattern_hblank
        lowest = 16'd8;
        highest = 16'd1023;
      end
      8'h27: begin  // pattern_vblank
        lowest = 16'd1;
        highest = 16'd255;
      end
      8'h2A: begin  // expect_width
        highest = 16'd4095;
      end
      8'h2B: begin  // expect_height
        highest = 16'd4095;
      end
      8'h42: begin  // trigger_width_us
        lowest = 16'd1;
      end
      default: ;
    endcase
  end

  // First clock: compare. Second clock: store what the limits allow.
  reg below;
  reg above;
  reg committed;
  always @(posedge clk_i or posedge rst_i) begin
    if (rst_i) begin
      below <= 1'b0;
      above <= 1'b0;
      committed <= 1'b0;
    end else begin
      below <= write_data_i < lowest;
      above <= write_data_i > highest;
      committed <= write_strobe_i && index_known_o && (unlock_o || !unlock_only);
    end
  end
  wire [15:0] value = below ? lowest : above ? highest : write_data_i;
  assign committed_o = committed;

  reg [11:0] servo0_min_q4;
  reg [11:0] servo0_max_q4;
  reg [11:0] servo0_safe_q4;
  reg [11:0] servo1_min_q4;
  reg [11:0] servo1_max_q4;
  reg [11:0] servo1_safe_q4;
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
      servo0_min_q4 <= 12'd900;
      servo0_max_q4 <= 12'd2100;
      servo0_safe_q4 <= 12'd1500;
      servo0_slew_q4_o <= 12'd480;
      servo1_target_q4_o <= 16'd24000;
      servo1_min_q4 <= 12'd900;
      servo1_max_q4 <= 12'd2100;
      servo1_safe_q4 <= 12'd1500;
      servo1_slew_q4_o <= 12'd480;
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
      pattern_hblank_o <= 10'd142;
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
      if ((committed && index_i == 8'h04)) scratch_o <= value[15:0];
      if ((committed && index_i == 8'h07)) servo_period_us_o <= value[14:0];
      if ((committed && index_i == 8'h08)) ctrl_servo0_enable_o <= value[0];
      if ((committed && index_i == 8'h08)) ctrl_servo1_enable_o <= value[1];
      if ((committed && index_i == 8'h08)) ctrl_stream_enable_o <= value[8];
      if ((committed && index_i == 8'h0B)) irq_enable_o <= value[7:0];
      if ((committed && index_i == 8'h0D)) unlock_o <= value == 16'h4C4B;
      if ((committed && index_i == 8'h0E)) wdg_ms_o <= value[15:0];
      if ((committed && index_i == 8'h0F) && value[1:0] <= 2'd2) wdg_action_o <= value[1:0];
      if ((committed && index_i == 8'h10)) servo0_target_q4_o <= value[15:0];
      if ((committed && index_i == 8'h12)) servo0_min_q4 <= value[15:4];
      if ((committed && index_i == 8'h13)) servo0_max_q4 <= value[15:4];
      if ((committed && index_i == 8'h14)) servo0_safe_q4 <= value[15:4];
      if ((committed && index_i == 8'h15)) servo0_slew_q4_o <= value[11:0];
      if ((committed && index_i == 8'h18)) servo1_target_q4_o <= value[15:0];
      if ((committed && index_i == 8'h1A)) servo1_min_q4 <= value[15:4];
      if ((committed && index_i == 8'h1B)) servo1_max_q4 <= value[15:4];
      if ((committed && index_i == 8'h1C)) servo1_safe_q4 <= value[15:4];
      if ((committed && index_i == 8'h1D)) servo1_slew_q4_o <= value[11:0];
      if ((committed && index_i == 8'h20) && value[1:0] <= 2'd2) cam_select_source_o <= value[1:0];
      if ((committed && index_i == 8'h20)) cam_select_alternating_o <= value[8];
      if ((committed && index_i == 8'h20)) cam_select_frames_each_o <= value[15:9];
      if ((committed && index_i == 8'h22)) switch_timeout_ms_o <= value[7:0];
      if ((committed && index_i == 8'h23)) ppi_mode_sync_shape_o <= value[0];
      if ((committed && index_i == 8'h23)) ppi_mode_edge0_o <= value[4];
      if ((committed && index_i == 8'h23)) ppi_mode_edge1_o <= value[5];
      if ((committed && index_i == 8'h23)) ppi_mode_tag_o <= value[8];
      if ((committed && index_i == 8'h24)) pattern_width_o <= value[11:0];
      if ((committed && index_i == 8'h25)) pattern_height_o <= value[11:0];
      if ((committed && index_i == 8'h26)) pattern_hblank_o <= value[9:0];
      if ((committed && index_i == 8'h27)) pattern_vblank_o <= value[7:0];
      if ((committed && index_i == 8'h28) && value[2:0] <= 3'd4) pattern_kind_o <= value[2:0];
      if ((committed && index_i == 8'h29)) pattern_seed_o <= value[9:0];
      if ((committed && index_i == 8'h2A)) expect_width_o <= value[11:0];
      if ((committed && index_i == 8'h2B)) expect_height_o <= value[11:0];
      if ((committed && index_i == 8'h41)) trigger_delay_us_o <= value[15:0];
      if ((committed && index_i == 8'h42)) trigger_width_us_o <= value[15:0];
      if ((committed && index_i == 8'h48)) sensor_reset_n_o <= value[1:0];
      if ((committed && index_i == 8'h48)) sensor_standby_o <= value[3:2];
      if ((committed && index_i == 8'h48)) sensor_oe_o <= value[5:4];
      if ((committed && index_i == 8'h48)) sensor_extclk_o <= value[7:6];
      if ((committed && index_i == 8'h56)) branch_ctrl_router_enable_o <= value[0];
      if ((committed && index_i == 8'h56) && value[2:1] <= 2'd2) branch_ctrl_bypass_o <= value[2:1];
    end
  end

  assign ctrl_soft_reset_o = (committed && index_i == 8'h08) & value[14];
  assign irq_status_clear_o = {8{(committed && index_i == 8'h0A)}} & value[7:0];
  assign irq_test_o = {8{(committed && index_i == 8'h0C)}} & value[7:0];
  assign wdg_fired_clear_o = (committed && index_i == 8'h0F) & value[8];
  assign servo0_min_q4_o = {servo0_min_q4, 4'd0};
  assign servo0_max_q4_o = {servo0_max_q4, 4'd0};
  assign servo0_safe_q4_o = {servo0_safe_q4, 4'd0};
  assign servo1_min_q4_o = {servo1_min_q4, 4'd0};
  assign servo1_max_q4_o = {servo1_max_q4, 4'd0};
  assign servo1_safe_q4_o = {servo1_safe_q4, 4'd0};
  assign trigger_ctrl_fire_o = {2{(committed && index_i == 8'h40)}} & value[1:0];
  assign time_set_o = (committed && index_i == 8'h4B);
  assign time_value_o = {pair_owner == 2'd3 ? pair_word : time_i[31:16], value};
  assign i2c_timeouts_clear_o = (committed && index_i == 8'h51);
  assign i2c_protocol_errors_clear_o = (committed && index_i == 8'h52);
  assign branch_errors_clear_o = (committed && index_i == 8'h53);
  assign spikes_clear_o = (committed && index_i == 8'h54);
  assign bus_clear_o = {2{(committed && index_i == 8'h55)}} & value[1:0];

  // A snapshot lasts from the first word of a block until the transfer leaves it.
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

  // Half of a 32-bit value, and whose half it is.
  reg [15:0] pair_word;
  reg [1:0] pair_owner;
  reg fetch;
  always @(posedge clk_i or posedge rst_i) begin
    if (rst_i) begin
      pair_word <= 16'd0;
      pair_owner <= 2'd0;
    end else begin
      if (fetch) case (index_i)
        8'h45: begin pair_word <= frame_time_i[15:0]; pair_owner <= 2'd1; end
        8'h46: pair_owner <= 2'd0;
        8'h4A: begin pair_word <= time_i[15:0]; pair_owner <= 2'd2; end
        8'h4B: pair_owner <= 2'd0;
        default: ;
      endcase
      if (committed && index_i == 8'h4A) begin pair_word <= value; pair_owner <= 2'd3; end
      if (committed && index_i == 8'h4B) pair_owner <= 2'd0;
    end
  end

  reg [15:0] word;
  reg known;
  always @* begin
    known = 1'b1;
    case (index_i)
      8'h00: word = 16'h5B1D;  // id
      8'h01: word = {8'h1, 8'h0};  // version
      8'h02: word = build_i;  // build
      8'h03: word = {10'd0, caps_tag_i, caps_alternating_i, caps_trigger_i, caps_pattern_i, caps_router_i, caps_camera1_i};  // caps
      8'h04: word = scratch_o;  // scratch
      8'h07: word = {1'd0, servo_period_us_o};  // servo_period_us
      8'h08: word = {7'd0, ctrl_stream_enable_o, 6'd0, ctrl_servo1_enable_o, ctrl_servo0_enable_o};  // ctrl
      8'h09: word = {9'd0, status_irq_line_i, status_switching_i, status_camera1_lost_i, status_camera0_lost_i, status_watchdog_fired_i, status_servo1_active_i, status_servo0_active_i};  // status
      8'h0A: word = {8'd0, irq_status_i};  // irq_status
      8'h0B: word = {8'd0, irq_enable_o};  // irq_enable
      8'h0C: word = 16'd0;  // irq_test
      8'h0D: word = {15'd0, unlock_o};  // unlock
      8'h0E: word = wdg_ms_o;  // wdg_ms
      8'h0F: word = {7'd0, wdg_fired_i, 6'd0, wdg_action_o};  // wdg
      8'h10: word = servo0_target_q4_o;  // servo0_target_q4
      8'h11: word = servo0_actual_q4_i;  // servo0_actual_q4
      8'h12: word = servo0_min_q4_o;  // servo0_min_q4
      8'h13: word = servo0_max_q4_o;  // servo0_max_q4
      8'h14: word = servo0_safe_q4_o;  // servo0_safe_q4
      8'h15: word = {4'd0, servo0_slew_q4_o};  // servo0_slew_q4
      8'h16: word = servo0_frames_i;  // servo0_frames
      8'h18: word = servo1_target_q4_o;  // servo1_target_q4
      8'h19: word = servo1_actual_q4_i;  // servo1_actual_q4
      8'h1A: word = servo1_min_q4_o;  // servo1_min_q4
      8'h1B: word = servo1_max_q4_o;  // servo1_max_q4
      8'h1C: word = servo1_safe_q4_o;  // servo1_safe_q4
      8'h1D: word = {4'd0, servo1_slew_q4_o};  // servo1_slew_q4
      8'h1E: word = servo1_frames_i;  // servo1_frames
      8'h20: word = {cam_select_frames_each_o, cam_select_alternating_o, 6'd0, cam_select_source_o};  // cam_select
      8'h21: word = {9'd0, cam_state_forced_i, cam_state_switching_i, cam_state_gate_open_i, 2'd0, cam_state_active_i};  // cam_state
      8'h22: word = {8'd0, switch_timeout_ms_o};  // switch_timeout_ms
      8'h23: word = {7'd0, ppi_mode_tag_o, 2'd0, ppi_mode_edge1_o, ppi_mode_edge0_o, 3'd0, ppi_mode_sync_shape_o};  // ppi_mode
      8'h24: word = {4'd0, pattern_width_o};  // pattern_width
      8'h25: word = {4'd0, pattern_height_o};  // pattern_height
      8'h26: word = {6'd0, pattern_hblank_o};  // pattern_hblank
      8'h27: word = {8'd0, pattern_vblank_o};  // pattern_vblank
      8'h28: word = {13'd0, pattern_kind_o};  // pattern_kind
      8'h29: word = {6'd0, pattern_seed_o};  // pattern_seed
      8'h2A: word = {4'd0, expect_width_o};  // expect_width
      8'h2B: word = {4'd0, expect_height_o};  // expect_height
      8'h30: word = camera0_frames_i;  // camera0_frames
      8'h31: word = {4'd0, camera0_lines_i};  // camera0_lines
      8'h32: word = {4'd0, camera0_pixels_i};  // camera0_pixels
      8'h33: word = camera0_period_10us_i;  // camera0_period_10us
      8'h34: word = camera0_pixclk_khz_i;  // camera0_pixclk_khz
      8'h35: word = {8'd0, camera0_short_lines_i};  // camera0_short_lines
      8'h36: word = {8'd0, camera0_short_frames_i};  // camera0_short_frames
      8'h37: word = {11'd0, camera0_flags_cut_i, camera0_flags_short_frame_i, camera0_flags_short_line_i, camera0_flags_frame_valid_i, camera0_flags_lost_i};  // camera0_flags
      8'h38: word = camera1_frames_i;  // camera1_frames
      8'h39: word = {4'd0, camera1_lines_i};  // camera1_lines
      8'h3A: word = {4'd0, camera1_pixels_i};  // camera1_pixels
      8'h3B: word = camera1_period_10us_i;  // camera1_period_10us
      8'h3C: word = camera1_pixclk_khz_i;  // camera1_pixclk_khz
      8'h3D: word = {8'd0, camera1_short_lines_i};  // camera1_short_lines
      8'h3E: word = {8'd0, camera1_short_frames_i};  // camera1_short_frames
      8'h3F: word = {11'd0, camera1_flags_cut_i, camera1_flags_short_frame_i, camera1_flags_short_line_i, camera1_flags_frame_valid_i, camera1_flags_lost_i};  // camera1_flags
      8'h40: word = {7'd0, trigger_ctrl_busy_i, 8'd0};  // trigger_ctrl
      8'h41: word = trigger_delay_us_o;  // trigger_delay_us
      8'h42: word = trigger_width_us_o;  // trigger_width_us
      8'h44: word = skew_us_i;  // skew_us
      8'h45: word = frame_time_i[31:16];  // frame_time_high
      8'h46: word = pair_owner == 2'd1 ? pair_word : frame_time_i[15:0];  // frame_time_low
      8'h48: word = {8'd0, sensor_extclk_o, sensor_oe_o, sensor_standby_o, sensor_reset_n_o};  // sensor
      8'h4A: word = time_i[31:16];  // time_high
      8'h4B: word = pair_owner == 2'd2 ? pair_word : time_i[15:0];  // time_low
      8'h50: word = {7'd0, i2c_diag_clear_busy_i, 2'd0, i2c_diag_branch_sda_i, i2c_diag_branch_scl_i, i2c_diag_sda_i, i2c_diag_scl_i};  // i2c_diag
      8'h51: word = {8'd0, i2c_timeouts_i};  // i2c_timeouts
      8'h52: word = {8'd0, i2c_protocol_errors_i};  // i2c_protocol_errors
      8'h53: word = {8'd0, branch_errors_i};  // branch_errors
      8'h54: word = {8'd0, spikes_i};  // spikes
      8'h55: word = 16'd0;  // bus_clear
      8'h56: word = {13'd0, branch_ctrl_bypass_o, branch_ctrl_router_enable_o};  // branch_ctrl
      default: begin
        word = 16'd0;
        known = 1'b0;
      end
    endcase
  end

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
