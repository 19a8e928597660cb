// SPDX-License-Identifier: Apache-2.0
//
// Everything that belongs to one camera: its pins in its own clock domain, and its meters.
//
//   pins --> pixel_capture --> data_o, line_o, frame_o     (domain of pixel_clk_i)
//                 |
//            frame_meter  <== handshake ==>  frame_record --> counts  (domain of clk_i)
//   pixel_clk_i ----------- clock_meter ----------------> activity_o, lost_o
//
// The domain of the camera is in reset from rst_i until two edges of its own clock after it; a
// camera without a clock stays in reset, with frame_o high (see pixel_capture).

`default_nettype none

module camera_channel (
  input  wire clk_i,
  input  wire rst_i,
  input  wire strobe_50us_i,
  input  wire hold_i,
  input  wire falling_i,
  input  wire [11:0] expect_width_i,
  input  wire [11:0] expect_height_i,
  input  wire pixel_clk_i,
  input  wire [9:0] data_i,
  input  wire line_i,
  input  wire frame_i,
  output wire [9:0] data_o,
  output wire line_o,
  output wire frame_o,
  output wire activity_o,
  output wire lost_o,
  output wire start_o,
  output wire wrong_line_o,
  output wire wrong_frame_o,
  output wire frame_valid_o,
  output wire short_line_o,
  output wire short_frame_o,
  output wire [15:0] frames_o,
  output wire [11:0] lines_o,
  output wire [11:0] pixels_o
);

  wire pixel_rst;
  reset_sync #(.STAGES(2)) pixel_reset (
    .clk_i(pixel_clk_i),
    .rst_i(rst_i),
    .request_i(1'b0),
    .rst_o(pixel_rst)
  );

  pixel_capture #(.BITS(10)) capture (
    .clk_i(pixel_clk_i),
    .rst_i(pixel_rst),
    .falling_i(falling_i),
    .data_i(data_i),
    .line_i(line_i),
    .frame_i(frame_i),
    .data_o(data_o),
    .line_o(line_o),
    .frame_o(frame_o)
  );

  wire taken;
  wire taken_there;
`ifdef PROVE_CAMERA_CHANNEL
  wire taken_meta;
  wire measuring_meta;
  wire finish;
  wire closing;
`endif
  sync_bit taken_level (
    .clk_i(pixel_clk_i),
    .rst_i(pixel_rst),
    .level_i(taken),
`ifdef PROVE_CAMERA_CHANNEL
    .meta_o(taken_meta),
`endif
    .level_o(taken_there)
  );

  wire measuring;
  wire [11:0] lines;
  wire [11:0] width;
  wire wrong;
  wire wrong_line;
  frame_meter meter (
    .clk_i(pixel_clk_i),
    .rst_i(pixel_rst),
    .frame_i(frame_o),
    .line_i(line_o),
    .expect_width_i(expect_width_i),
    .taken_i(taken_there),
    .measuring_o(measuring),
    .lines_o(lines),
    .width_o(width),
    .wrong_o(wrong),
`ifdef PROVE_CAMERA_CHANNEL
    .closing_o(closing),
`endif
    .wrong_line_o(wrong_line)
  );

  sync_pulse wrong_lines (
    .from_clk_i(pixel_clk_i),
    .from_rst_i(pixel_rst),
    .pulse_i(wrong_line),
    .to_clk_i(clk_i),
    .to_rst_i(rst_i),
    .pulse_o(wrong_line_o)
  );

  frame_record record (
    .clk_i(clk_i),
    .rst_i(rst_i),
    .hold_i(hold_i),
    .measuring_i(measuring),
    .lines_i(lines),
    .width_i(width),
    .wrong_i(wrong),
    .expect_height_i(expect_height_i),
`ifdef PROVE_CAMERA_CHANNEL
    .meta_o(measuring_meta),
    .finish_o(finish),
`endif
    .taken_o(taken),
    .start_o(start_o),
    .frame_error_o(wrong_frame_o),
    .frame_valid_o(frame_valid_o),
    .frames_o(frames_o),
    .lines_o(lines_o),
    .pixels_o(pixels_o),
    .short_line_o(short_line_o),
    .short_frame_o(short_frame_o)
  );

  clock_meter clock_watch (
    .clk_i(clk_i),
    .rst_i(rst_i),
    .pixel_clk_i(pixel_clk_i),
    .pixel_rst_i(pixel_rst),
    .strobe_i(strobe_50us_i),
    .activity_o(activity_o),
    .lost_o(lost_o)
  );

`ifdef PROVE_CAMERA_CHANNEL
  camera_channel_properties properties (
    .clk_i(clk_i), .rst_i(rst_i), .pixel_clk_i(pixel_clk_i),
    .measuring(measuring), .lines(lines), .width(width), .wrong(wrong), .taken(taken),
    .taken_there(taken_there), .frame_valid(frame_valid_o),
    .measuring_meta(measuring_meta), .taken_meta(taken_meta), .finish(finish), .closing(closing)
  );
`endif

endmodule

`default_nettype wire
