// SPDX-License-Identifier: Apache-2.0
//
// The control domain's side of frame_meter: takes the results of each frame over while they stand
// still, and counts the frames of one camera.
//
// measuring_i   __|^^^^^^^^^^^^^^^^^^^^|_____________   from frame_meter, any phase
// taken_o       ______|^^^^^^^^^^^^^^^^^^^^^^|_______   back to frame_meter
// start_o       ____|^|______________________________
// lines_o       ==== frame before ==========X= frame
// results       ________________________|<->|________   end: two to three clocks after measuring_i
//
// While hold_i is high the size (lines_o, pixels_o) and its flags stay those of the frame that was
// the last when hold_i rose, so that they belong to the count in frames_o that was read with it;
// the count continues, and wraps. frame_error_o: the frame that ends has the wrong height
// (expect_height_i = 0: not that of the frame before).

`default_nettype none

module frame_record (
  input  wire clk_i,
  input  wire rst_i,
  input  wire hold_i,
  input  wire measuring_i,
  input  wire [11:0] lines_i,
  input  wire [11:0] width_i,
  input  wire wrong_i,
  input  wire [11:0] expect_height_i,
`ifdef PROVE_CAMERA_CHANNEL
  output wire meta_o,
  output wire finish_o,
`endif
  output wire taken_o,
  output wire start_o,
  output wire frame_error_o,
  output wire frame_valid_o,
  output reg  [15:0] frames_o,
  output reg  [11:0] lines_o,
  output reg  [11:0] pixels_o,
  output reg  short_line_o,
  output reg  short_frame_o
);

  wire measuring;
  sync_bit frame_level (
    .clk_i(clk_i),
    .rst_i(rst_i),
    .level_i(measuring_i),
`ifdef PROVE_CAMERA_CHANNEL
    .meta_o(meta_o),
`endif
    .level_o(measuring)
  );

  reg was_measuring;
  always @(posedge clk_i or posedge rst_i) begin
    if (rst_i) was_measuring <= 1'b0;
    else was_measuring <= measuring;
  end

  assign frame_valid_o = measuring;
  assign taken_o = was_measuring;
  assign start_o = measuring && !was_measuring;
  wire finish = !measuring && was_measuring;

  // Before the first frame there is nothing to compare with.
  wire expecting = expect_height_i != 12'd0;
  wire wrong_height = expecting ? lines_i != expect_height_i
                                : lines_i != lines_o && lines_o != 12'd0;
  assign frame_error_o = finish && wrong_height;

  always @(posedge clk_i or posedge rst_i) begin
    if (rst_i) begin
      frames_o <= 16'd0;
      lines_o <= 12'd0;
      pixels_o <= 12'd0;
      short_line_o <= 1'b0;
      short_frame_o <= 1'b0;
    end else if (finish) begin
      frames_o <= frames_o + 16'd1;
      if (!hold_i) begin
        lines_o <= lines_i;
        pixels_o <= width_i;
        short_line_o <= wrong_i;
        short_frame_o <= wrong_height;
      end
    end
  end

`ifdef PROVE_CAMERA_CHANNEL
  assign finish_o = finish;
`endif
`ifdef PROVE_FRAME_RECORD
  frame_record_properties properties (
    .clk_i(clk_i), .rst_i(rst_i), .hold_i(hold_i), .measuring(measuring),
    .was_measuring(was_measuring), .lines_i(lines_i), .width_i(width_i),
    .wrong_i(wrong_i),
    .expect_height_i(expect_height_i), .start_o(start_o), .finish(finish),
    .wrong_height(wrong_height), .frame_error_o(frame_error_o), .frames_o(frames_o),
    .lines_o(lines_o), .pixels_o(pixels_o), .short_line_o(short_line_o),
    .short_frame_o(short_frame_o)
  );
`endif

endmodule

`default_nettype wire
