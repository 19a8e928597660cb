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
// FILL_FROM: 0; in proofs, where the filling of the memory begins.

`default_nettype none

module register_file #(
  parameter [4:0] FILL_FROM = 5'd0
) (
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
  output wire filling_o,
  output wire [3:0] fill_o,
  input  wire [3:0] memory_place_i,
  output wire memory_busy_o,
  output wire [15:0] memory_word_o,
  input  wire memory_store_i,
  input  wire [15:0] memory_data_i,
  output wire memory_stored_o,
  output wire [3:0] counter_place_o,
  output wire counter_clear_o,
  input  wire [7:0] counter_i,
  output reg  camera0_hold_o,
  output reg  camera1_hold_o,
  input  wire [15:0] build_i,
  input  wire caps_camera1_i,
  input  wire caps_router_i,
  input  wire caps_pattern_i,
  input  wire caps_trigger_i,
  input  wire caps_alternating_i,
  input  wire caps_tag_i,
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

  reg [7:0] pattern_width;
  reg [8:0] pattern_height;
  reg [7:0] pattern_hblank;
  always @(posedge clk_i or posedge rst_i) begin
    if (rst_i) begin
      ctrl_servo0_enable_o <= 1'd0;
      ctrl_servo1_enable_o <= 1'd0;
      ctrl_stream_enable_o <= 1'd0;
      irq_enable_o <= 8'd0;
      unlock_o <= 1'd0;
      wdg_ms_o <= 16'd1000;
      wdg_action_o <= 2'd2;
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
      if (write_strobe_i && index_i == 8'h08) ctrl_servo0_enable_o <= write_data_i[0];
      if (write_strobe_i && index_i == 8'h08) ctrl_servo1_enable_o <= write_data_i[1];
      if (write_strobe_i && index_i == 8'h08) ctrl_stream_enable_o <= write_data_i[8];
      if (write_strobe_i && index_i == 8'h0B) irq_enable_o <= write_data_i[7:0];
      if (write_strobe_i && index_i == 8'h0D) unlock_o <= write_data_i == 16'h4C4B;
      if (write_strobe_i && index_i == 8'h0E) wdg_ms_o <= write_data_i[15:0];
      if (write_strobe_i && index_i == 8'h0F) wdg_action_o <= write_data_i[1:0];
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
  assign pattern_width_o = {pattern_width, 4'd0};
  assign pattern_height_o = {pattern_height, 3'd0};
  assign pattern_hblank_o = {pattern_hblank, 2'd0};
  assign trigger_ctrl_fire_o = {2{write_strobe_i && index_i == 8'h40}} & write_data_i[1:0];
  assign bus_clear_o = {2{write_strobe_i && index_i == 8'h55}} & write_data_i[1:0];

  // Some registers are in a memory of 16 words, of which the hardware has one while
  // memory_busy_o is low: after reset the memory is filled, and the bus comes first.
  reg [15:0] memory [0:15];
  reg [4:0] fill;
  reg fetch;
  always @(posedge clk_i or posedge rst_i) begin
    if (rst_i) fill <= FILL_FROM;
    else if (!fill[4]) fill <= fill + 5'd1;
  end
  assign filling_o = !fill[4];
  assign fill_o = fill[3:0] ^ 4'd1;

  // Place 1 comes first and is not written, and the word has no 1 there: so the word can
  // are in the register that chooses between the sources. Both halves are filled alike.
  wire [15:0] fill_word = fill[2:0] == 3'd6 ? 16'd20000 : fill[2:0] == 3'd1 || fill[2:0] == 3'd5 ?
    16'd24000 : fill[2:0] == 3'd3 ? 16'd14400 : fill[2:0] == 3'd2 ? 16'd33600 : fill[2:0] == 3'd4 ?
    16'd480 : 16'd0;
  wire filled_here = fill[2:0] != 3'd0;
  wire in_memory = index_i == 8'h04 || index_i == 8'h07 || index_i == 8'h10 || index_i == 8'h11 ||
    index_i == 8'h12 || index_i == 8'h13 || index_i == 8'h14 || index_i == 8'h15 || index_i == 8'h18
    || index_i == 8'h19 || index_i == 8'h1A || index_i == 8'h1B || index_i == 8'h1C || index_i ==
    8'h1D;

  // A place is chosen in one clock and used in the next; without reset, so that block
  // memories can hold it.
  wire bus = write_strobe_i || read_strobe_i;
  assign memory_busy_o = filling_o || bus;
  assign memory_stored_o = memory_store_i && !memory_busy_o;
  reg [3:0] place;
  reg store;
  reg filled;
  reg [15:0] choice;
  always @(posedge clk_i or posedge rst_i) begin
    if (rst_i) begin
      store <= 1'b0;
      filled <= 1'b0;
      choice <= 16'd0;
    end else begin
      store <= filling_o ? filled_here : bus ? write_strobe_i && in_memory
        : memory_store_i;
      filled <= filling_o;
      choice <= fill_word | {16{!memory_busy_o}};
    end
  end
  wire [15:0] stored_word = filled ? choice
    : (memory_data_i & choice) | (write_data_i & ~choice);
  always @(posedge clk_i) begin
    place <= filling_o ? fill_o : !bus ? memory_place_i
      : index_i[4] ? index_i[3:0] : {index_i[0], 1'b1, 1'b1, index_i[0]};
    if (store) memory[place] <= stored_word;
  end
  assign memory_word_o = memory[place];


  // The counters stand outside; any write clears those that may be written.
  wire counted = index_i == 8'h16 || index_i == 8'h1E || index_i == 8'h35 || index_i == 8'h36 ||
    index_i == 8'h3D || index_i == 8'h3E || index_i == 8'h51 || index_i == 8'h52 || index_i == 8'h53
    || index_i == 8'h54;
  assign counter_place_o = index_i[3:0] ^ (index_i == 8'h16 || index_i == 8'h1E ? 4'd1 : 4'd0);
  assign counter_clear_o = write_strobe_i && (index_i == 8'h51 || index_i == 8'h52 || index_i ==
    8'h53 || index_i == 8'h54);


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
  reg [15:0] low_word;
  always @(posedge clk_i or posedge rst_i) begin
    if (rst_i) low_word <= 16'd0;
    else if (fetch) case (index_i)
      8'h45: low_word <= frame_time_i[15:0];
      8'h4A: low_word <= time_i[15:0];
      default: ;
    endcase
  end

  // Registers are in pairs whose indices differ in one bit: one look-up table for
  // each bit chooses between the two, or takes two bits that stand alone.
  wire at_00_02 = (index_i & 8'hFD) == 8'h00;
  wire at_02 = at_00_02 & index_i[1];
  wire at_01_03 = (index_i & 8'hFD) == 8'h01;
  wire at_01 = at_01_03 & !index_i[1];
  wire at_03 = at_01_03 & index_i[1];
  wire at_08_28 = (index_i & 8'hDF) == 8'h08;
  wire at_08 = at_08_28 & !index_i[5];
  wire at_28 = at_08_28 & index_i[5];
  wire at_09_29 = (index_i & 8'hDF) == 8'h09;
  wire at_29 = at_09_29 & index_i[5];
  wire at_0a_0b = (index_i & 8'hFE) == 8'h0A;
  wire at_0c_0d = (index_i & 8'hFE) == 8'h0C;
  wire at_0d = at_0c_0d & index_i[0];
  wire at_0e_0f = (index_i & 8'hFE) == 8'h0E;
  wire at_0e = at_0e_0f & !index_i[0];
  wire at_20_21 = (index_i & 8'hFE) == 8'h20;
  wire at_20 = at_20_21 & !index_i[0];
  wire at_21 = at_20_21 & index_i[0];
  wire at_22_23 = (index_i & 8'hFE) == 8'h22;
  wire at_22 = at_22_23 & !index_i[0];
  wire at_23 = at_22_23 & index_i[0];
  wire at_24_25 = (index_i & 8'hFE) == 8'h24;
  wire at_25 = at_24_25 & index_i[0];
  wire at_26_27 = (index_i & 8'hFE) == 8'h26;
  wire at_26 = at_26_27 & !index_i[0];
  wire at_27 = at_26_27 & index_i[0];
  wire at_2a_2b = (index_i & 8'hFE) == 8'h2A;
  wire at_30_34 = (index_i & 8'hFB) == 8'h30;
  wire at_31_39 = (index_i & 8'hF7) == 8'h31;
  wire at_32_3a = (index_i & 8'hF7) == 8'h32;
  wire at_33_3b = (index_i & 8'hF7) == 8'h33;
  wire at_37_3f = (index_i & 8'hF7) == 8'h37;
  wire at_38_3c = (index_i & 8'hFB) == 8'h38;
  wire at_40_41 = (index_i & 8'hFE) == 8'h40;
  wire at_41 = at_40_41 & index_i[0];
  wire at_42_46 = (index_i & 8'hFB) == 8'h42;
  wire at_44_45 = (index_i & 8'hFE) == 8'h44;
  wire at_48 = index_i == 8'h48;
  wire at_4a_4b = (index_i & 8'hFE) == 8'h4A;
  wire at_50 = index_i == 8'h50;
  wire at_55 = index_i == 8'h55;
  wire at_56 = index_i == 8'h56;
  wire [15:0] term_0 = {16{in_memory}} & memory_word_o;
  wire [15:0] term_1 = {16{counted}} & {8'd0, counter_i};
  wire [15:0] term_2 = {16{at_00_02}} & (index_i[1] ? {1'd0, build_i[14], 1'd0, build_i[12:11],
    1'd0, build_i[9:8], 3'd0, build_i[4:2], 1'd0, build_i[0]} : {1'd0, 1'd1, 1'd0, 2'd3, 1'd0, 2'd3,
    3'd0, 3'd7, 1'd0, 1'd1});
  wire [15:0] term_3 = {16{at_08_28}} & (index_i[5] ? {14'd0, pattern_kind_o[1:0]} : {14'd0,
    ctrl_servo1_enable_o, ctrl_servo0_enable_o});
  wire [15:0] term_4 = {16{at_09_29}} & (index_i[5] ? {9'd0, pattern_seed_o[6:0]} : {9'd0,
    status_irq_line_i, status_switching_i, status_camera1_lost_i, status_camera0_lost_i,
    status_watchdog_fired_i, status_servo1_active_i, status_servo0_active_i});
  wire [15:0] term_5 = {16{at_0a_0b}} & (index_i[0] ? {8'd0, irq_enable_o[7:0]} : {8'd0,
    irq_status_i[7:0]});
  wire [15:0] term_6 = {16{at_0e_0f}} & (index_i[0] ? {7'd0, wdg_fired_i, 6'd0, wdg_action_o[1:0]} :
    {7'd0, wdg_ms_o[8], 6'd0, wdg_ms_o[1:0]});
  wire [15:0] term_7 = {16{at_20_21}} & (index_i[0] ? {14'd0, cam_state_active_i[1:0]} : {14'd0,
    cam_select_source_o[1:0]});
  wire [15:0] term_8 = {16{at_22_23}} & (index_i[0] ? {10'd0, ppi_mode_edge1_o, ppi_mode_edge0_o,
    3'd0, ppi_mode_sync_shape_o} : {10'd0, switch_timeout_ms_o[5:4], 3'd0, switch_timeout_ms_o[0]});
  wire [15:0] term_9 = {16{at_24_25}} & (index_i[0] ? {4'd0, pattern_height_o[11:4], 4'd0} : {4'd0,
    pattern_width_o[11:4], 4'd0});
  wire [15:0] term_10 = {16{at_26_27}} & (index_i[0] ? {8'd0, pattern_vblank_o[7:2], 2'd0} : {8'd0,
    pattern_hblank_o[7:2], 2'd0});
  wire [15:0] term_11 = {16{at_2a_2b}} & (index_i[0] ? {4'd0, expect_height_o[11:0]} : {4'd0,
    expect_width_o[11:0]});
  wire [15:0] term_12 = {16{at_30_34}} & (index_i[2] ? {camera0_pixclk_khz_i[15:0]} :
    {camera0_frames_i[15:0]});
  wire [15:0] term_13 = {16{at_31_39}} & (index_i[3] ? {4'd0, camera1_lines_i[11:0]} : {4'd0,
    camera0_lines_i[11:0]});
  wire [15:0] term_14 = {16{at_32_3a}} & (index_i[3] ? {4'd0, camera1_pixels_i[11:0]} : {4'd0,
    camera0_pixels_i[11:0]});
  wire [15:0] term_15 = {16{at_33_3b}} & (index_i[3] ? {camera1_period_10us_i[15:0]} :
    {camera0_period_10us_i[15:0]});
  wire [15:0] term_16 = {16{at_37_3f}} & (index_i[3] ? {11'd0, camera1_flags_cut_i,
    camera1_flags_short_frame_i, camera1_flags_short_line_i, camera1_flags_frame_valid_i,
    camera1_flags_lost_i} : {11'd0, camera0_flags_cut_i, camera0_flags_short_frame_i,
    camera0_flags_short_line_i, camera0_flags_frame_valid_i, camera0_flags_lost_i});
  wire [15:0] term_17 = {16{at_38_3c}} & (index_i[2] ? {camera1_pixclk_khz_i[15:0]} :
    {camera1_frames_i[15:0]});
  wire [15:0] term_18 = {16{at_40_41}} & (index_i[0] ? {7'd0, trigger_delay_us_o[8], 8'd0} : {7'd0,
    trigger_ctrl_busy_i, 8'd0});
  wire [15:0] term_19 = {16{at_42_46}} & (index_i[2] ? {low_word[15:0]} :
    {trigger_width_us_o[15:0]});
  wire [15:0] term_20 = {16{at_44_45}} & (index_i[0] ? {frame_time_i[31:16]} : {skew_us_i[15:0]});
  wire [15:0] term_21 = {16{at_4a_4b}} & (index_i[0] ? {low_word[15:0]} : {time_i[31:16]});
  wire [15:0] term_22 = {16{at_41}} & {trigger_delay_us_o[15:9], 1'd0, trigger_delay_us_o[7:0]} |
    {16{at_0e}} & {wdg_ms_o[15:9], 1'd0, wdg_ms_o[7:2], 2'd0} | {16{at_27}} & {14'd0,
    pattern_vblank_o[1:0]} | {16{at_01}} & {7'd0, 1'd1, 8'd0} | {16{at_08}} & {7'd0,
    ctrl_stream_enable_o, 8'd0};
  wire [15:0] term_23 = {16{at_20}} & {cam_select_frames_each_o[6:0], cam_select_alternating_o,
    8'd0} | {16{at_48}} & {8'd0, sensor_extclk_o[1:0], sensor_oe_o[1:0], sensor_standby_o[1:0],
    sensor_reset_n_o[1:0]} | {16{at_02}} & {build_i[15], 1'd0, build_i[13], 2'd0, build_i[10], 2'd0,
    build_i[7:5], 3'd0, build_i[1], 1'd0} | {16{at_26}} & {6'd0, pattern_hblank_o[9:8], 8'd0} |
    {16{at_28}} & {13'd0, pattern_kind_o[2], 2'd0} | {16{at_0d}} & {15'd0, unlock_o} | {16{at_25}} &
    {12'd0, pattern_height_o[3], 3'd0};
  wire [15:0] term_24 = {16{at_50}} & {7'd0, i2c_diag_clear_busy_i, 2'd0,
    i2c_diag_branch_sda_i[1:0], i2c_diag_branch_scl_i[1:0], i2c_diag_sda_i, i2c_diag_scl_i} |
    {16{at_03}} & {10'd0, caps_tag_i, caps_alternating_i, caps_trigger_i, caps_pattern_i,
    caps_router_i, caps_camera1_i} | {16{at_29}} & {6'd0, pattern_seed_o[9:7], 7'd0};
  wire [15:0] term_25 = {16{at_22}} & {8'd0, switch_timeout_ms_o[7:6], 2'd0,
    switch_timeout_ms_o[3:1], 1'd0} | {16{at_21}} & {9'd0, cam_state_forced_i,
    cam_state_switching_i, cam_state_gate_open_i, 4'd0} | {16{at_56}} & {13'd0,
    branch_ctrl_bypass_o[1:0], branch_ctrl_router_enable_o} | {16{at_23}} & {7'd0, ppi_mode_tag_o,
    8'd0};
  wire [15:0] word;
`ifdef SYNTHESIS
  carry_or #(.WIDTH(23)) word_0 (.any_o(word[0]), .bits_i({term_0[0], term_1[0], term_2[0],
    term_3[0], term_4[0], term_5[0], term_6[0], term_7[0], term_8[0], term_11[0], term_12[0],
    term_13[0], term_14[0], term_15[0], term_16[0], term_17[0], term_19[0], term_20[0], term_21[0],
    term_22[0], term_23[0], term_24[0], term_25[0]}));
  carry_or #(.WIDTH(21)) word_1 (.any_o(word[1]), .bits_i({term_0[1], term_1[1], term_3[1],
    term_4[1], term_5[1], term_6[1], term_7[1], term_11[1], term_12[1], term_13[1], term_14[1],
    term_15[1], term_16[1], term_17[1], term_19[1], term_20[1], term_21[1], term_22[1], term_23[1],
    term_24[1], term_25[1]}));
  carry_or #(.WIDTH(20)) word_2 (.any_o(word[2]), .bits_i({term_0[2], term_1[2], term_2[2],
    term_4[2], term_5[2], term_10[2], term_11[2], term_12[2], term_13[2], term_14[2], term_15[2],
    term_16[2], term_17[2], term_19[2], term_20[2], term_21[2], term_22[2], term_23[2], term_24[2],
    term_25[2]}));
  carry_or #(.WIDTH(20)) word_3 (.any_o(word[3]), .bits_i({term_0[3], term_1[3], term_2[3],
    term_4[3], term_5[3], term_10[3], term_11[3], term_12[3], term_13[3], term_14[3], term_15[3],
    term_16[3], term_17[3], term_19[3], term_20[3], term_21[3], term_22[3], term_23[3], term_24[3],
    term_25[3]}));
  carry_or #(.WIDTH(22)) word_4 (.any_o(word[4]), .bits_i({term_0[4], term_1[4], term_2[4],
    term_4[4], term_5[4], term_8[4], term_9[4], term_10[4], term_11[4], term_12[4], term_13[4],
    term_14[4], term_15[4], term_16[4], term_17[4], term_19[4], term_20[4], term_21[4], term_22[4],
    term_23[4], term_24[4], term_25[4]}));
  carry_or #(.WIDTH(20)) word_5 (.any_o(word[5]), .bits_i({term_0[5], term_1[5], term_4[5],
    term_5[5], term_8[5], term_9[5], term_10[5], term_11[5], term_12[5], term_13[5], term_14[5],
    term_15[5], term_17[5], term_19[5], term_20[5], term_21[5], term_22[5], term_23[5], term_24[5],
    term_25[5]}));
  carry_or #(.WIDTH(18)) word_6 (.any_o(word[6]), .bits_i({term_0[6], term_1[6], term_4[6],
    term_5[6], term_9[6], term_10[6], term_11[6], term_12[6], term_13[6], term_14[6], term_15[6],
    term_17[6], term_19[6], term_20[6], term_21[6], term_22[6], term_23[6], term_25[6]}));
  carry_or #(.WIDTH(18)) word_7 (.any_o(word[7]), .bits_i({term_0[7], term_1[7], term_5[7],
    term_9[7], term_10[7], term_11[7], term_12[7], term_13[7], term_14[7], term_15[7], term_17[7],
    term_19[7], term_20[7], term_21[7], term_22[7], term_23[7], term_24[7], term_25[7]}));
  carry_or #(.WIDTH(18)) word_8 (.any_o(word[8]), .bits_i({term_0[8], term_2[8], term_6[8],
    term_9[8], term_11[8], term_12[8], term_13[8], term_14[8], term_15[8], term_17[8], term_18[8],
    term_19[8], term_20[8], term_21[8], term_22[8], term_23[8], term_24[8], term_25[8]}));
  carry_or #(.WIDTH(15)) word_9 (.any_o(word[9]), .bits_i({term_0[9], term_2[9], term_9[9],
    term_11[9], term_12[9], term_13[9], term_14[9], term_15[9], term_17[9], term_19[9], term_20[9],
    term_21[9], term_22[9], term_23[9], term_24[9]}));
  carry_or #(.WIDTH(13)) word_10 (.any_o(word[10]), .bits_i({term_0[10], term_9[10], term_11[10],
    term_12[10], term_13[10], term_14[10], term_15[10], term_17[10], term_19[10], term_20[10],
    term_21[10], term_22[10], term_23[10]}));
  carry_or #(.WIDTH(14)) word_11 (.any_o(word[11]), .bits_i({term_0[11], term_2[11], term_9[11],
    term_11[11], term_12[11], term_13[11], term_14[11], term_15[11], term_17[11], term_19[11],
    term_20[11], term_21[11], term_22[11], term_23[11]}));
  carry_or #(.WIDTH(10)) word_12 (.any_o(word[12]), .bits_i({term_0[12], term_2[12], term_12[12],
    term_15[12], term_17[12], term_19[12], term_20[12], term_21[12], term_22[12], term_23[12]}));
  carry_or #(.WIDTH(9)) word_13 (.any_o(word[13]), .bits_i({term_0[13], term_12[13], term_15[13],
    term_17[13], term_19[13], term_20[13], term_21[13], term_22[13], term_23[13]}));
  carry_or #(.WIDTH(10)) word_14 (.any_o(word[14]), .bits_i({term_0[14], term_2[14], term_12[14],
    term_15[14], term_17[14], term_19[14], term_20[14], term_21[14], term_22[14], term_23[14]}));
  carry_or #(.WIDTH(9)) word_15 (.any_o(word[15]), .bits_i({term_0[15], term_12[15], term_15[15],
    term_17[15], term_19[15], term_20[15], term_21[15], term_22[15], term_23[15]}));
`else  // the same at once, for simulators
  assign word = term_0 | term_1 | term_2 | term_3 | term_4 | term_5 | term_6 | term_7 | term_8 |
    term_9 | term_10 | term_11 | term_12 | term_13 | term_14 | term_15 | term_16 | term_17 | term_18
    | term_19 | term_20 | term_21 | term_22 | term_23 | term_24 | term_25;
`endif

  wire known = in_memory | counted | at_00_02 | at_01_03 | at_08_28 | at_09_29 | at_0a_0b | at_0c_0d
    | at_0e_0f | at_20_21 | at_22_23 | at_24_25 | at_26_27 | at_2a_2b | at_30_34 | at_31_39 |
    at_32_3a | at_33_3b | at_37_3f | at_38_3c | at_40_41 | at_42_46 | at_44_45 | at_48 | at_4a_4b |
    at_50 | at_55 | at_56;

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
