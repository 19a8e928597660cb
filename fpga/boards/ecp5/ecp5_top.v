// SPDX-License-Identifier: Apache-2.0
//
// The bridge on an ULX3S (ECP5, CABGA381). Pins: ecp5.lpf.
//
//   25 MHz -> bridge
//          -> PLL -> 25 MHz * 23 / 12 = 47.917 MHz for EXTCLK
//
// wifi_en low keeps the ESP32 in reset: it shares pins with both cameras.
`default_nettype none

module ecp5_top (
  input  wire        clk_25mhz,
  input  wire        rst_n,
  output wire        wifi_en,

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

  wire clk48;
  wire feedback;
  wire locked;
  wire rst;
  wire [1:0] oe;
  assign sensor_oe_n = ~oe;
  wire [1:0] extclk_wanted;
  wire [1:0] extclk_on;

  assign wifi_en = 1'b0;

  // 25 MHz * 23 = 575 MHz, / 12.
  EHXPLLL #(
    .CLKI_DIV(1), .CLKFB_DIV(1), .FEEDBK_PATH("CLKOP"),
    .CLKOP_ENABLE("ENABLED"), .CLKOP_DIV(23), .CLKOP_CPHASE(11), .CLKOP_FPHASE(0),
    .CLKOS_ENABLE("ENABLED"), .CLKOS_DIV(12), .CLKOS_CPHASE(11), .CLKOS_FPHASE(0)
  ) pll (
    .CLKI(clk_25mhz), .CLKFB(feedback), .CLKOP(feedback), .CLKOS(clk48), .LOCK(locked),
    .RST(1'b0), .STDBY(1'b0), .ENCLKOP(1'b0), .ENCLKOS(1'b0), .PHASESEL0(1'b0),
    .PHASESEL1(1'b0), .PHASEDIR(1'b1), .PHASESTEP(1'b1), .PHASELOADREG(1'b1), .PLLWAKESYNC(1'b0)
  );

  sync_bit left_extclk (
    .clk_i(clk48), .rst_i(rst), .level_i(extclk_wanted[0]), .level_o(extclk_on[0])
  );
  sync_bit right_extclk (
    .clk_i(clk48), .rst_i(rst), .level_i(extclk_wanted[1]), .level_o(extclk_on[1])
  );
  ODDRX1F left_extclk_pad (
    .SCLK(clk48), .RST(1'b0), .D0(extclk_on[0]), .D1(1'b0), .Q(sensor_extclk[0])
  );
  ODDRX1F right_extclk_pad (
    .SCLK(clk48), .RST(1'b0), .D0(extclk_on[1]), .D1(1'b0), .Q(sensor_extclk[1])
  );

  wire sda_low;
  wire [1:0] branch_scl_low;
  wire [1:0] branch_sda_low;
  assign sda = sda_low ? 1'b0 : 1'bz;
  assign branch_scl[0] = branch_scl_low[0] ? 1'b0 : 1'bz;
  assign branch_scl[1] = branch_scl_low[1] ? 1'b0 : 1'bz;
  assign branch_sda[0] = branch_sda_low[0] ? 1'b0 : 1'bz;
  assign branch_sda[1] = branch_sda_low[1] ? 1'b0 : 1'bz;

  bridge_board board (
    .clk_i(clk_25mhz),
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
    .pix_clk_i({right_pix_clk, left_pix_clk}),
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
