// SPDX-License-Identifier: Apache-2.0
//
// The two scenes of fpga/README.md, simulated: a transfer to the left sensor, and a change of the
// camera. tools/waveforms.py draws the signals of this module between `shown` rising and falling.
// Parameter SCENE: 0 transfer, 1 camera.
`timescale 1ns / 1ps
module waveform_bench;
  parameter SCENE = 0;
  localparam integer QUARTER_NS = SCENE == 0 ? 625 : 250;  // of an SCL period: 400 kHz, 1 MHz

  reg shown = 1'b0;

  // ---- clocks; the cameras' drift against each other
  reg clk = 1'b0;
  reg tick = 1'b0;
  reg rst = 1'b1;
  reg left_pixclk = 1'b0;
  reg right_pixclk = 1'b0;
  integer phase = 0;
  always #20 clk = !clk;
  always #10.4 left_pixclk = !left_pixclk;
  always #10.5 right_pixclk = !right_pixclk;
  always @(negedge clk) begin
    phase <= phase == 24 ? 0 : phase + 1;
    tick <= phase == 24;
  end

  // ---- buses: what each side pulls down
  reg  master_scl = 1'b1;
  reg  master_sda = 1'b1;
  wire dsp_low;
  wire [1:0] scl_low;
  wire [1:0] sda_low;
  wire left_low;
  wire right_low;
  wire scl = master_scl;
  wire sda = master_sda && !dsp_low;
  wire left_scl = !scl_low[0];
  wire left_sda = !sda_low[0] && !left_low;
  wire right_scl = !scl_low[1];
  wire right_sda = !sda_low[1] && !right_low;
  waveform_sensor left_sensor (.scl_i(left_scl), .sda_i(left_sda), .sda_low_o(left_low));
  waveform_sensor right_sensor (.scl_i(right_scl), .sda_i(right_sda), .sda_low_o(right_low));

  // ---- cameras: frames of 4 lines of 24 pixels, the right one's a little longer
  wire left_fv, left_lv, right_fv, right_lv;
  waveform_camera #(.BLANK(70)) left_camera (.clk_i(left_pixclk), .fv_o(left_fv), .lv_o(left_lv));
  waveform_camera #(.BLANK(90)) right_camera (
    .clk_i(right_pixclk), .fv_o(right_fv), .lv_o(right_lv)
  );

  wire ppi_clk, ppi_fs1, ppi_fs2, irq;
  bridge_core core (
    .rst_i(rst), .clk_i(clk), .tick_us_i(tick),
    .scl_i(scl), .sda_i(sda), .sda_low_o(dsp_low),
    .branch_scl_i({right_scl, left_scl}), .branch_sda_i({right_sda, left_sda}),
    .branch_scl_low_o(scl_low), .branch_sda_low_o(sda_low),
    .pix_clk_i({right_pixclk, left_pixclk}), .frame_valid_i({right_fv, left_fv}),
    .line_valid_i({right_lv, left_lv}), .left_data_i(10'h0AA), .right_data_i(10'h155),
    .ppi_clk_o(ppi_clk), .ppi_fs1_o(ppi_fs1), .ppi_fs2_o(ppi_fs2), .ppi_fs3_o(), .ppi_data_o(),
    .servo_o(), .irq_o(irq), .sensor_reset_n_o(), .sensor_standby_o(), .sensor_oe_o(),
    .sensor_extclk_enable_o(), .trigger_o()
  );

  // ---- the DSP
  task start;
    begin
      master_sda = 1'b0;
      #(2 * QUARTER_NS) master_scl = 1'b0;
    end
  endtask

  task send(input [7:0] value);
    integer i;
    begin
      for (i = 8; i >= 0; i = i - 1) begin
        #QUARTER_NS master_sda = i == 0 ? 1'b1 : value[i - 1];
        #QUARTER_NS master_scl = 1'b1;
        #(2 * QUARTER_NS) master_scl = 1'b0;
      end
    end
  endtask

  task stop;
    begin
      #QUARTER_NS master_sda = 1'b0;
      #QUARTER_NS master_scl = 1'b1;
      #(2 * QUARTER_NS) master_sda = 1'b1;
      #(2 * QUARTER_NS);
    end
  endtask

  task write(input [7:0] index, input [15:0] value);
    begin
      start;
      send(8'h58);
      send(index);
      send(value[15:8]);
      send(value[7:0]);
      stop;
    end
  endtask

  initial begin
    $dumpfile("dump.vcd");
    $dumpvars(1, waveform_bench);
    #1000 rst = 1'b0;
    #300000;  // the bus clear after reset
    if (SCENE == 0) begin
      shown = 1'b1;
      #3000 start;
      send(8'hB8);  // 0x5C, write
      send(8'h03);
      stop;
      #3000 shown = 1'b0;
    end else begin
      write(8'h48, 16'h00F3);  // sensors run
      write(8'h0B, 16'h0002);  // interrupt: switched
      write(8'h08, 16'h0100);  // stream
      #20000;
      fork
        write(8'h20, 16'h0001);  // the right camera
        #(34 * 4 * QUARTER_NS) shown = 1'b1;
      join
      #9000 shown = 1'b0;
    end
    $finish;
  end
endmodule

// Bus model of a sensor: acknowledges its address 0x5D, and the data written after it.
module waveform_sensor (
  input  wire scl_i,
  input  wire sda_i,
  output reg  sda_low_o
);
  integer bits = 0;         // clocked of this byte, after START one less
  reg listening = 1'b0;     // START was seen, and no other address
  reg address = 1'b0;       // this byte is the address
  reg [7:0] word;
  initial sda_low_o = 1'b0;
  always @(negedge sda_i) if (scl_i) begin
    bits = -1;
    listening = 1'b1;
    address = 1'b1;
  end
  always @(posedge sda_i) if (scl_i) listening = 1'b0;
  always @(posedge scl_i) word = {word[6:0], sda_i};
  always @(negedge scl_i) begin
    bits = bits + 1;
    if (bits == 8) begin
      listening = listening && (!address || word[7:1] == 7'h5D);
      address = 1'b0;
      #300 sda_low_o = listening;
    end else if (bits == 9) begin
      bits = 0;
      #300 sda_low_o = 1'b0;
    end
  end
endmodule

// Frame and line valid as a sensor makes them, at the falling edges of its clock.
module waveform_camera #(
  parameter BLANK = 70
) (
  input  wire clk_i,
  output reg  fv_o,
  output reg  lv_o
);
  localparam LINES = 4;
  localparam WIDTH = 24;
  localparam GAP = 8;
  integer x = 0;
  integer y = 0;
  initial begin
    fv_o = 1'b0;
    lv_o = 1'b0;
  end
  always @(negedge clk_i) begin
    x = x + 1;
    if (x == (y == LINES ? BLANK : WIDTH + GAP)) begin
      x = 0;
      y = y == LINES ? 0 : y + 1;
    end
    fv_o <= y != LINES;
    lv_o <= y != LINES && x >= GAP / 2 && x < GAP / 2 + WIDTH;
  end
endmodule
