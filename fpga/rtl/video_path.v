// SPDX-License-Identifier: Apache-2.0
//
// The pixel path: two cameras and the pattern generator in, the DSP's PPI out, and all that is
// measured on the way. Ports without a domain of their own belong to clk_i.
//
//   camera 0 pins -> camera_channel --+
//   camera 1 pins -> camera_channel --+-> stream_switch -> PPI
//                pattern_generator ---+
//   ticks -> rate_meter (clock, period), frame_time (skew, time of a frame)
//
//                 frame of camera 0        switch       frame of camera 1
// ppi_frame_o  ___|^^^^^^^^^^^^^^^^^^^|______________________|^^^^^^^^^^^^^^^^^^^|__
// ppi_clock_o  |||||||||||||||||||||||||__________||||||||||||||||||||||||||||||
//
// Latency of a pixel: half a period (sampling edge to the falling edge that launches it), and one
// period more when the camera is sampled at falling edges counted from that edge.
// camera*_wanted_i: the camera should be running; only then is a lost clock an event.

`default_nettype none

module video_path (
  input  wire clk_i,
  input  wire rst_i,
  input  wire tick_us_i,
  input  wire tick_ms_i,
  input  wire tick_10us_i,
  input  wire tick_50us_i,
  input  wire tick_16ms_i,
  input  wire [31:0] time_us_i,

  input  wire stream_i,
  input  wire [1:0] request_i,
  input  wire alternating_i,
  input  wire [6:0] frames_each_i,
  input  wire [7:0] timeout_ms_i,
  input  wire first_line_i,
  input  wire tag_i,
  input  wire [1:0] falling_i,
  input  wire [1:0] wanted_i,
  input  wire [1:0] hold_i,
  input  wire [11:0] expect_width_i,
  input  wire [11:0] expect_height_i,
  input  wire [11:0] pattern_width_i,
  input  wire [11:0] pattern_height_i,
  input  wire [9:0] pattern_hblank_i,
  input  wire [7:0] pattern_vblank_i,
  input  wire [2:0] pattern_kind_i,
  input  wire [9:0] pattern_seed_i,

  input  wire camera0_clk_i,
  input  wire [9:0] camera0_data_i,
  input  wire camera0_line_i,
  input  wire camera0_frame_i,
  input  wire camera1_clk_i,
  input  wire [9:0] camera1_data_i,
  input  wire camera1_line_i,
  input  wire camera1_frame_i,

  output wire ppi_clock_o,
  output wire [9:0] ppi_data_o,
  output wire ppi_line_o,
  output wire ppi_frame_o,

  output wire [1:0] active_o,
  output wire gate_open_o,
  output wire switching_o,
  output wire forced_o,
  output wire [1:0] lost_o,
  output wire [1:0] cut_o,
  output wire [1:0] frame_valid_o,
  output wire [1:0] wrong_line_o,
  output wire [1:0] wrong_frame_o,
  output wire [1:0] short_line_o,
  output wire [1:0] short_frame_o,
  output wire [15:0] camera0_frames_o,
  output wire [11:0] camera0_lines_o,
  output wire [11:0] camera0_pixels_o,
  output wire [15:0] camera0_period_10us_o,
  output wire [15:0] camera0_pixclk_khz_o,
  output wire [15:0] camera1_frames_o,
  output wire [11:0] camera1_lines_o,
  output wire [11:0] camera1_pixels_o,
  output wire [15:0] camera1_period_10us_o,
  output wire [15:0] camera1_pixclk_khz_o,
  output wire [15:0] skew_us_o,
  output wire [31:0] frame_time_o,

  output wire event_frame_start_o,
  output wire event_switched_o,
  output wire event_timed_out_o,
  output wire event_clock_lost_o,
  output wire event_line_error_o
);

  wire [9:0] data0;
  wire line0;
  wire frame0;
  wire [9:0] data1;
  wire line1;
  wire frame1;
  wire [1:0] activity;
  wire [1:0] start;

  camera_channel camera0 (
    .clk_i(clk_i),
    .rst_i(rst_i),
    .strobe_50us_i(tick_50us_i),
    .hold_i(hold_i[0]),
    .falling_i(falling_i[0]),
    .expect_width_i(expect_width_i),
    .expect_height_i(expect_height_i),
    .pixel_clk_i(camera0_clk_i),
    .data_i(camera0_data_i),
    .line_i(camera0_line_i),
    .frame_i(camera0_frame_i),
    .data_o(data0),
    .line_o(line0),
    .frame_o(frame0),
    .activity_o(activity[0]),
    .lost_o(lost_o[0]),
    .start_o(start[0]),
    .wrong_line_o(wrong_line_o[0]),
    .wrong_frame_o(wrong_frame_o[0]),
    .frame_valid_o(frame_valid_o[0]),
    .short_line_o(short_line_o[0]),
    .short_frame_o(short_frame_o[0]),
    .frames_o(camera0_frames_o),
    .lines_o(camera0_lines_o),
    .pixels_o(camera0_pixels_o)
  );

  camera_channel camera1 (
    .clk_i(clk_i),
    .rst_i(rst_i),
    .strobe_50us_i(tick_50us_i),
    .hold_i(hold_i[1]),
    .falling_i(falling_i[1]),
    .expect_width_i(expect_width_i),
    .expect_height_i(expect_height_i),
    .pixel_clk_i(camera1_clk_i),
    .data_i(camera1_data_i),
    .line_i(camera1_line_i),
    .frame_i(camera1_frame_i),
    .data_o(data1),
    .line_o(line1),
    .frame_o(frame1),
    .activity_o(activity[1]),
    .lost_o(lost_o[1]),
    .start_o(start[1]),
    .wrong_line_o(wrong_line_o[1]),
    .wrong_frame_o(wrong_frame_o[1]),
    .frame_valid_o(frame_valid_o[1]),
    .short_line_o(short_line_o[1]),
    .short_frame_o(short_frame_o[1]),
    .frames_o(camera1_frames_o),
    .lines_o(camera1_lines_o),
    .pixels_o(camera1_pixels_o)
  );

  wire [9:0] pattern_data;
  wire pattern_line;
  wire pattern_frame;
  pattern_generator pattern (
    .clk_i(clk_i),
    .rst_i(rst_i),
    .run_i(stream_i && active_o[1]),
    .width_i(pattern_width_i),
    .height_i(pattern_height_i),
    .hblank_i(pattern_hblank_i),
    .vblank_i(pattern_vblank_i),
    .kind_i(pattern_kind_i),
    .seed_i(pattern_seed_i),
    .frame_o(pattern_frame),
    .line_o(pattern_line),
    .data_o(pattern_data)
  );

  stream_switch stream (
    .clk_i(clk_i),
    .rst_i(rst_i),
    .tick_us_i(tick_us_i),
    .tick_ms_i(tick_ms_i),
    .stream_i(stream_i),
    .request_i(request_i),
    .alternating_i(alternating_i),
    .frames_each_i(frames_each_i),
    .timeout_ms_i(timeout_ms_i),
    .first_line_i(first_line_i),
    .tag_i(tag_i),
    .lost_i(lost_o),
    .clock0_i(camera0_clk_i),
    .data0_i(data0),
    .line0_i(line0),
    .frame0_i(frame0),
    .clock1_i(camera1_clk_i),
    .data1_i(data1),
    .line1_i(line1),
    .frame1_i(frame1),
    .pattern_data_i(pattern_data),
    .pattern_line_i(pattern_line),
    .pattern_frame_i(pattern_frame),
    .active_o(active_o),
    .gate_open_o(gate_open_o),
    .switching_o(switching_o),
    .forced_o(forced_o),
    .cut_o(cut_o),
    .switched_o(event_switched_o),
    .timed_out_o(event_timed_out_o),
    .frame_start_o(event_frame_start_o),
    .ppi_clock_o(ppi_clock_o),
    .ppi_data_o(ppi_data_o),
    .ppi_line_o(ppi_line_o),
    .ppi_frame_o(ppi_frame_o)
  );

  rate_meter rates (
    .clk_i(clk_i),
    .rst_i(rst_i),
    .tick_10us_i(tick_10us_i),
    .tick_16ms_i(tick_16ms_i),
    .hold_i(hold_i),
    .activity_i(activity),
    .start_i(start),
    .clock0_khz_o(camera0_pixclk_khz_o),
    .clock1_khz_o(camera1_pixclk_khz_o),
    .period0_10us_o(camera0_period_10us_o),
    .period1_10us_o(camera1_period_10us_o)
  );

  frame_time times (
    .clk_i(clk_i),
    .rst_i(rst_i),
    .tick_us_i(tick_us_i),
    .time_us_i(time_us_i),
    .ppi_start_i(event_frame_start_o),
    .start_left_i(start[0]),
    .start_right_i(start[1]),
    .skew_us_o(skew_us_o),
    .frame_time_o(frame_time_o)
  );

  // A camera that is switched on without a clock is reported too: missing rises with wanted_i.
  wire [1:0] missing = lost_o & wanted_i;
  reg [1:0] missing_before;
  always @(posedge clk_i or posedge rst_i) begin
    if (rst_i) missing_before <= 2'b00;
    else missing_before <= missing;
  end
  assign event_clock_lost_o = |(missing & ~missing_before);
  assign event_line_error_o = |{wrong_line_o, wrong_frame_o};

`ifdef PROVE_VIDEO_PATH
  video_path_properties properties (
    .clk_i(clk_i), .rst_i(rst_i), .lost_i(lost_o), .wanted_i(wanted_i),
    .wrong_line_i(wrong_line_o), .wrong_frame_i(wrong_frame_o),
    .event_clock_lost_o(event_clock_lost_o), .event_line_error_o(event_line_error_o)
  );
`endif

endmodule

`default_nettype wire
