// SPDX-License-Identifier: Apache-2.0
//
// What every board has in common: the bridge, its microsecond and its reset.
//
//   board's clock, locked_i, rst_n_i --> board_reset, tick_prescaler --> bridge_core
//
// The top joins *_low_o and *_i at open-drain pads.
// CLOCKS_PER_US: of clk_i. The bridge takes its sub-microsecond servo edges as if it were 25; with
// 24 such an edge is up to 41 ns from its place.
// extclk_enable_o belongs to clk_i; a board that makes EXTCLK takes it over into that clock.
`default_nettype none

module bridge_board #(
  parameter [4:0] CLOCKS_PER_US = 5'd25,
  parameter [15:0] BUILD = 16'd0
) (
  input  wire        clk_i,
  input  wire        locked_i,
  input  wire        rst_n_i,
  output wire        rst_o,

  input  wire        scl_i,
  input  wire        sda_i,
  output wire        sda_low_o,
  input  wire [1:0]  branch_scl_i,
  input  wire [1:0]  branch_sda_i,
  output wire [1:0]  branch_scl_low_o,
  output wire [1:0]  branch_sda_low_o,

  input  wire [1:0]  pix_clk_i,
  input  wire [1:0]  frame_valid_i,
  input  wire [1:0]  line_valid_i,
  input  wire [9:0]  left_data_i,
  input  wire [9:0]  right_data_i,

  output wire        ppi_clk_o,
  output wire        ppi_fs1_o,
  output wire        ppi_fs2_o,
  output wire        ppi_fs3_o,
  output wire [9:0]  ppi_data_o,

  output wire [1:0]  servo_o,
  output wire        irq_o,
  output wire [1:0]  sensor_reset_n_o,
  output wire [1:0]  sensor_standby_o,
  output wire [1:0]  sensor_oe_o,
  output wire [1:0]  extclk_enable_o,
  output wire [1:0]  trigger_o
);

  wire tick_us;

  board_reset power_on (
    .clk_i(clk_i), .locked_i(locked_i), .rst_n_i(rst_n_i), .rst_o(rst_o)
  );
  tick_prescaler #(.CLOCKS(CLOCKS_PER_US)) microsecond (
    .clk_i(clk_i), .rst_i(rst_o), .tick_us_o(tick_us)
  );

  bridge_core #(.BUILD(BUILD)) core (
    .rst_i(rst_o),
    .clk_i(clk_i),
    .tick_us_i(tick_us),
    .scl_i(scl_i),
    .sda_i(sda_i),
    .sda_low_o(sda_low_o),
    .branch_scl_i(branch_scl_i),
    .branch_sda_i(branch_sda_i),
    .branch_scl_low_o(branch_scl_low_o),
    .branch_sda_low_o(branch_sda_low_o),
    .pix_clk_i(pix_clk_i),
    .frame_valid_i(frame_valid_i),
    .line_valid_i(line_valid_i),
    .left_data_i(left_data_i),
    .right_data_i(right_data_i),
    .ppi_clk_o(ppi_clk_o),
    .ppi_fs1_o(ppi_fs1_o),
    .ppi_fs2_o(ppi_fs2_o),
    .ppi_fs3_o(ppi_fs3_o),
    .ppi_data_o(ppi_data_o),
    .servo_o(servo_o),
    .irq_o(irq_o),
    .sensor_reset_n_o(sensor_reset_n_o),
    .sensor_standby_o(sensor_standby_o),
    .sensor_oe_o(sensor_oe_o),
    .sensor_extclk_enable_o(extclk_enable_o),
    .trigger_o(trigger_o)
  );

endmodule

`default_nettype wire
