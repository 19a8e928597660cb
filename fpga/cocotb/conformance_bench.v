// SPDX-License-Identifier: Apache-2.0
// The bridge on a bus for the conformance test: clock, tick and the wired AND of the lines.
// Compiled with the RTL or with a netlist of it.
`timescale 1ns / 1ps
module conformance_bench;
  reg  clk = 1'b0;
  reg  rst = 1'b1;
  reg  tick = 1'b0;
  reg  [4:0] phase = 5'd0;
  reg  master_scl = 1'b1;
  reg  master_sda = 1'b1;
  wire target_low;
  wire [1:0] branch_scl_low, branch_sda_low, servo;
  wire irq;
  wire scl = master_scl;
  wire sda = master_sda && !target_low;

  always #20 clk = !clk;
  always @(negedge clk) begin
    phase <= phase == 5'd24 ? 5'd0 : phase + 5'd1;
    tick <= phase == 5'd24;
  end

  bridge_core core (
    .rst_i(rst), .clk_i(clk), .tick_us_i(tick),
    .scl_i(scl), .sda_i(sda), .sda_low_o(target_low),
    .branch_scl_i(~branch_scl_low), .branch_sda_i(~branch_sda_low),
    .branch_scl_low_o(branch_scl_low), .branch_sda_low_o(branch_sda_low),
    .pix_clk_i(2'b00), .frame_valid_i(2'b00), .line_valid_i(2'b00),
    .left_data_i(10'd0), .right_data_i(10'd0),
    .ppi_clk_o(), .ppi_fs1_o(), .ppi_fs2_o(), .ppi_fs3_o(), .ppi_data_o(),
    .servo_o(servo), .irq_o(irq),
    .sensor_reset_n_o(), .sensor_standby_o(), .sensor_oe_o(), .sensor_extclk_enable_o(),
    .trigger_o()
  );
endmodule
