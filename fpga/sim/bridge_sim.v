// SPDX-License-Identifier: Apache-2.0
// The bridge as seen by bridge_model.cpp: groups of pins joined to words, one word per event group.
//
// Names and order only, except for the tick: it comes from a flip-flop, as on the board, which also
// saves the simulation all logic behind it at every change of an input. I2C lines are joined
// outside. tick_next_i: the next rising edge of clk_i has the tick; sampled at the falling edge.
// falling_counts_o: 0: a falling edge of clk_i changes nothing but the tick: no flip-flop of the
// core that uses it, those of the pattern's clock, would change. watched_o: the cameras whose
// frames could go to the PPI next; both while the core alternates.
`default_nettype none
module bridge_sim (
    input  wire        rst_i,
    input  wire        clk_i,
    input  wire        tick_next_i,
    input  wire [ 1:0] pix_clk_i,
    input  wire        scl_i,
    input  wire        sda_i,
    input  wire [ 1:0] branch_scl_i,
    input  wire [ 1:0] branch_sda_i,
    input  wire [ 1:0] frame_valid_i,
    input  wire [ 1:0] line_valid_i,
    input  wire [ 9:0] left_data_i,
    input  wire [ 9:0] right_data_i,
    output wire        sda_low_o,
    output wire [ 3:0] branch_low_o,  // SDA of both, SCL of both
    output wire [ 1:0] servo_o,
    output wire        irq_o,
    output wire        ppi_clk_o,
    output wire [12:0] ppi_o,         // FS3, FS2, FS1, data
    output wire [ 9:0] sensor_o,      // trigger, extclk, oe, standby, reset_n of both
    output wire        falling_counts_o,
    output wire [ 1:0] watched_o
);
  reg tick_us;
  always @(negedge clk_i) tick_us <= tick_next_i;

  assign falling_counts_o = core.video.stream.clocks.select_i[2] ||
      core.video.stream.clocks.asked[2] || core.video.stream.clocks.enabled[2];

  genvar camera;
  generate
    for (camera = 0; camera < 2; camera = camera + 1) begin : watch
      assign watched_o[camera] = core.video.stream.alternating_i ||
          core.video.stream.active_o == camera || core.video.stream.selector.wanted == camera ||
          (core.video.stream.switching_o && core.video.stream.selector.target == camera);
    end
  endgenerate

  bridge_core core (
      .rst_i(rst_i),
      .clk_i(clk_i),
      .tick_us_i(tick_us),
      .scl_i(scl_i),
      .sda_i(sda_i),
      .sda_low_o(sda_low_o),
      .branch_scl_i(branch_scl_i),
      .branch_sda_i(branch_sda_i),
      .branch_scl_low_o(branch_low_o[1:0]),
      .branch_sda_low_o(branch_low_o[3:2]),
      .pix_clk_i(pix_clk_i),
      .frame_valid_i(frame_valid_i),
      .line_valid_i(line_valid_i),
      .left_data_i(left_data_i),
      .right_data_i(right_data_i),
      .ppi_clk_o(ppi_clk_o),
      .ppi_fs1_o(ppi_o[10]),
      .ppi_fs2_o(ppi_o[11]),
      .ppi_fs3_o(ppi_o[12]),
      .ppi_data_o(ppi_o[9:0]),
      .servo_o(servo_o),
      .irq_o(irq_o),
      .sensor_reset_n_o(sensor_o[1:0]),
      .sensor_standby_o(sensor_o[3:2]),
      .sensor_oe_o(sensor_o[5:4]),
      .sensor_extclk_enable_o(sensor_o[7:6]),
      .trigger_o(sensor_o[9:8])
  );
endmodule
`default_nettype wire
