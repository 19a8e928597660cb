// SPDX-License-Identifier: Apache-2.0
//
// The bridge on Lattice's iCE40-HX8K breakout board (iCE40HX8K-B-EVN). Pins: ice40_hx8k.pcf.
//
//   12 MHz -> PLL -> 48 MHz for EXTCLK
//                 -> 24 MHz for the bridge, so a microsecond is exact
//   pixel clocks: pads with a way to the global nets
//
// EXTCLK comes from a double-data-rate pad: high in the first half of a period while enabled.
`default_nettype none

module ice40_hx8k_top (
  input  wire        clk12,
  input  wire        rst_n,

  input  wire        scl,
  inout  wire        sda,
  inout  wire [1:0]  branch_scl,
  inout  wire [1:0]  branch_sda,

  input  wire        left_pix_clk,
  input  wire        left_frame_valid,
  input  wire        left_line_valid,
  input  wire [9:0]  left_data,
  input  wire        right_pix_clk,
  input  wire        right_frame_valid,
  input  wire        right_line_valid,
  input  wire [9:0]  right_data,

  output wire        ppi_clk,
  output wire        ppi_fs1,
  output wire        ppi_fs2,
  output wire        ppi_fs3,
  output wire [9:0]  ppi_data,

  output wire [1:0]  servo,
  output wire        irq,
  output wire [1:0]  sensor_reset_n,
  output wire [1:0]  sensor_standby,
  output wire [1:0]  sensor_oe_n,
  output wire [1:0]  sensor_extclk,
  output wire [1:0]  trigger
);

  wire clk24;
  wire clk48;
  wire locked;
  wire rst;
  wire pix_left;
  wire pix_right;
  wire [1:0] oe;
  assign sensor_oe_n = ~oe;
  wire [1:0] extclk_wanted;
  wire [1:0] extclk_on;

  // 12 MHz * 64 = 768 MHz, / 16 = 48 MHz, / 2 = 24 MHz.
  SB_PLL40_2F_CORE #(
    .FEEDBACK_PATH("SIMPLE"), .DIVR(4'd0), .DIVF(7'd63), .DIVQ(3'd4), .FILTER_RANGE(3'd1),
    .PLLOUT_SELECT_PORTA("GENCLK"), .PLLOUT_SELECT_PORTB("GENCLK_HALF")
  ) pll (
    .REFERENCECLK(clk12), .RESETB(1'b1), .BYPASS(1'b0), .LOCK(locked),
    .PLLOUTGLOBALA(clk48), .PLLOUTGLOBALB(clk24)
  );

  SB_GB_IO #(.PIN_TYPE(6'b0000_01)) left_pad (
    .PACKAGE_PIN(left_pix_clk), .GLOBAL_BUFFER_OUTPUT(pix_left)
  );
  SB_GB_IO #(.PIN_TYPE(6'b0000_01)) right_pad (
    .PACKAGE_PIN(right_pix_clk), .GLOBAL_BUFFER_OUTPUT(pix_right)
  );

  sync_bit left_extclk (
    .clk_i(clk48), .rst_i(rst), .level_i(extclk_wanted[0]), .level_o(extclk_on[0])
  );
  sync_bit right_extclk (
    .clk_i(clk48), .rst_i(rst), .level_i(extclk_wanted[1]), .level_o(extclk_on[1])
  );
  SB_IO #(.PIN_TYPE(6'b0100_00)) left_extclk_pad (
    .PACKAGE_PIN(sensor_extclk[0]), .OUTPUT_CLK(clk48), .D_OUT_0(extclk_on[0]), .D_OUT_1(1'b0)
  );
  SB_IO #(.PIN_TYPE(6'b0100_00)) right_extclk_pad (
    .PACKAGE_PIN(sensor_extclk[1]), .OUTPUT_CLK(clk48), .D_OUT_0(extclk_on[1]), .D_OUT_1(1'b0)
  );

  wire sda_low;
  wire [1:0] branch_scl_low;
  wire [1:0] branch_sda_low;
  assign sda = sda_low ? 1'b0 : 1'bz;
  assign branch_scl[0] = branch_scl_low[0] ? 1'b0 : 1'bz;
  assign branch_scl[1] = branch_scl_low[1] ? 1'b0 : 1'bz;
  assign branch_sda[0] = branch_sda_low[0] ? 1'b0 : 1'bz;
  assign branch_sda[1] = branch_sda_low[1] ? 1'b0 : 1'bz;

  bridge_board #(.CLOCKS_PER_US(5'd24)) board (
    .clk_i(clk24),
    .locked_i(locked),
    .rst_n_i(rst_n),
    .rst_o(rst),
    .scl_i(scl),
    .sda_i(sda),
    .sda_low_o(sda_low),
    .branch_scl_i(branch_scl),
    .branch_sda_i(branch_sda),
    .branch_scl_low_o(branch_scl_low),
    .branch_sda_low_o(branch_sda_low),
    .pix_clk_i({pix_right, pix_left}),
    .frame_valid_i({right_frame_valid, left_frame_valid}),
    .line_valid_i({right_line_valid, left_line_valid}),
    .left_data_i(left_data),
    .right_data_i(right_data),
    .ppi_clk_o(ppi_clk),
    .ppi_fs1_o(ppi_fs1),
    .ppi_fs2_o(ppi_fs2),
    .ppi_fs3_o(ppi_fs3),
    .ppi_data_o(ppi_data),
    .servo_o(servo),
    .irq_o(irq),
    .sensor_reset_n_o(sensor_reset_n),
    .sensor_standby_o(sensor_standby),
    .sensor_oe_o(oe),
    .extclk_enable_o(extclk_wanted),
    .trigger_o(trigger)
  );

endmodule

`default_nettype wire
