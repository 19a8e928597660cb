// SPDX-License-Identifier: Apache-2.0
//
// The bridge for one camera on an UPduino 3 (iCE40UP5K-SG48). Pins: ice40_up5k.pcf.
//
// The package has 39 pins, two cameras need 59: this build has the left camera with its upper 8
// bits and the upper 8 bits of the PPI. The camera has its own oscillator of at most 30 MHz,
// OE and STANDBY strapped to run, no trigger; reset is by power or by CTRL. CAPS does not know: the
// right camera shows as lost for ever.
`default_nettype none

module ice40_up5k_top (
  input  wire        clk12,

  input  wire        scl,
  inout  wire        sda,
  inout  wire        branch_scl,
  inout  wire        branch_sda,

  input  wire        left_pix_clk,
  input  wire        left_frame_valid,
  input  wire        left_line_valid,
  input  wire [9:2]  left_data,

  output wire        ppi_clk,
  output wire        ppi_fs1,
  output wire        ppi_fs2,
  output wire [9:2]  ppi_data,

  output wire [1:0]  servo,
  output wire        irq,
  output wire        sensor_reset_n
);

  wire clk24;
  wire locked;
  wire pix_left;
  wire [1:0] unused_data;
  wire [1:0] reset_n;

  // 12 MHz * 64 = 768 MHz, / 32 = 24 MHz.
  SB_PLL40_CORE #(
    .FEEDBACK_PATH("SIMPLE"), .DIVR(4'd0), .DIVF(7'd63), .DIVQ(3'd5), .FILTER_RANGE(3'd1),
    .PLLOUT_SELECT("GENCLK")
  ) pll (
    .REFERENCECLK(clk12), .RESETB(1'b1), .BYPASS(1'b0), .LOCK(locked), .PLLOUTGLOBAL(clk24)
  );

  SB_GB_IO #(.PIN_TYPE(6'b0000_01)) left_pad (
    .PACKAGE_PIN(left_pix_clk), .GLOBAL_BUFFER_OUTPUT(pix_left)
  );

  wire sda_low;
  wire [1:0] branch_scl_low;
  wire [1:0] branch_sda_low;
  assign sda = sda_low ? 1'b0 : 1'bz;
  assign branch_scl = branch_scl_low[0] ? 1'b0 : 1'bz;
  assign branch_sda = branch_sda_low[0] ? 1'b0 : 1'bz;

  bridge_board #(.CLOCKS_PER_US(5'd24)) board (
    .clk_i(clk24),
    .locked_i(locked),
    .rst_n_i(1'b1),
    .rst_o(),
    .scl_i(scl),
    .sda_i(sda),
    .sda_low_o(sda_low),
    .branch_scl_i({1'b1, branch_scl}),
    .branch_sda_i({1'b1, branch_sda}),
    .branch_scl_low_o(branch_scl_low),
    .branch_sda_low_o(branch_sda_low),
    .pix_clk_i({1'b0, pix_left}),
    .frame_valid_i({1'b0, left_frame_valid}),
    .line_valid_i({1'b0, left_line_valid}),
    .left_data_i({left_data, 2'b00}),
    .right_data_i(10'd0),
    .ppi_clk_o(ppi_clk),
    .ppi_fs1_o(ppi_fs1),
    .ppi_fs2_o(ppi_fs2),
    .ppi_fs3_o(),
    .ppi_data_o({ppi_data, unused_data}),
    .servo_o(servo),
    .irq_o(irq),
    .sensor_reset_n_o(reset_n),
    .sensor_standby_o(),
    .sensor_oe_o(),
    .extclk_enable_o(),
    .trigger_o()
  );
  assign sensor_reset_n = reset_n[0];

endmodule

`default_nettype wire
