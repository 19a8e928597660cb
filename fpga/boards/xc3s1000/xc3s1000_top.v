// SPDX-License-Identifier: Apache-2.0
//
// The bridge on the BF537's FPGA daughter card (Spartan-3 XC3S1000). Pins: xc3s1000_pins.ucf, to be
// filled in from the card's schematic; timing: xc3s1000_timing.ucf; build: build.tcl.
//
//   25 MHz -> IBUFG, BUFG -> bridge
//                         -> DCM -> 25 MHz * 23 / 12 = 47.917 MHz -> BUFG for EXTCLK
//   pixel clocks -> IBUFG, BUFG
//
// The PPI clock is made of LUTs on purpose: a BUFGMUX waits for an edge of the clock that it leaves,
// and so hangs on a camera that has stopped (UG331, "Clock Buffers/Multiplexers"). A LUT does not
// glitch while one input changes, or inputs that do not matter: clock_gate changes an enable only
// while its clock is low, and only one enable is set. The synthesis puts a BUFG behind the LUTs.
// Six of the eight global buffers are used.
`default_nettype none

module xc3s1000_top (
  input  wire        clk25_pad,
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

  wire clk25_in;
  wire clk25;
  wire clk48_dcm;
  wire clk48;
  wire locked;
  wire rst;
  wire left_in;
  wire right_in;
  wire pix_left;
  wire pix_right;
  wire [1:0] oe;
  assign sensor_oe_n = ~oe;
  wire [1:0] extclk_wanted;
  wire [1:0] extclk_on;

  IBUFG clk25_ibufg (.I(clk25_pad), .O(clk25_in));
  BUFG clk25_bufg (.I(clk25_in), .O(clk25));
  IBUFG left_ibufg (.I(left_pix_clk), .O(left_in));
  BUFG left_bufg (.I(left_in), .O(pix_left));
  IBUFG right_ibufg (.I(right_pix_clk), .O(right_in));
  BUFG right_bufg (.I(right_in), .O(pix_right));

  DCM #(
    .CLKFX_MULTIPLY(23), .CLKFX_DIVIDE(12), .CLKIN_PERIOD(40.0), .CLK_FEEDBACK("NONE"),
    .DFS_FREQUENCY_MODE("LOW"), .DLL_FREQUENCY_MODE("LOW"), .STARTUP_WAIT("FALSE")
  ) dcm (
    .CLKIN(clk25_in), .CLKFB(1'b0), .RST(1'b0), .DSSEN(1'b0),
    .PSCLK(1'b0), .PSEN(1'b0), .PSINCDEC(1'b0),
    .CLKFX(clk48_dcm), .LOCKED(locked)
  );
  BUFG clk48_bufg (.I(clk48_dcm), .O(clk48));

  sync_bit left_extclk (
    .clk_i(clk48), .rst_i(rst), .level_i(extclk_wanted[0]), .level_o(extclk_on[0])
  );
  sync_bit right_extclk (
    .clk_i(clk48), .rst_i(rst), .level_i(extclk_wanted[1]), .level_o(extclk_on[1])
  );
  FDDRRSE left_extclk_pad (
    .C0(clk48), .C1(!clk48), .CE(1'b1), .D0(extclk_on[0]), .D1(1'b0), .R(1'b0), .S(1'b0),
    .Q(sensor_extclk[0])
  );
  FDDRRSE right_extclk_pad (
    .C0(clk48), .C1(!clk48), .CE(1'b1), .D0(extclk_on[1]), .D1(1'b0), .R(1'b0), .S(1'b0),
    .Q(sensor_extclk[1])
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
    .clk_i(clk25),
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
