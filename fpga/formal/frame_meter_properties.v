// SPDX-License-Identifier: Apache-2.0
// Properties of frame_meter. Frames and lines are free, including noise; of the other side only the
// handshake is assumed: taken_i follows measuring_o.
`default_nettype none

module frame_meter_properties (
  input wire clk_i,
  input wire rst_i,
  input wire frame_i,
  input wire line_i,
  input wire [11:0] expect_width_i,
  input wire taken_i,
  input wire measuring_o,
  input wire [11:0] lines_o,
  input wire [11:0] width_o,
  input wire wrong_o,
  input wire wrong_line_o,
  input wire [11:0] pixels,
  input wire in_line,
  input wire first,
  input wire closing
);
  reg begun = 1'b0;
  reg live, had_frame, had_measuring, had_taken, had_wrong, had_wrong_line;
  reg [11:0] had_lines, had_width, had_expected;
  // The same counts with a bit more: these never overflow within what is compared.
  reg [12:0] true_pixels, true_lines, true_width;
  reg in_line_before;
  // A line's end, and what belongs to it, one clock later.
  reg ended, ended_second;
  reg [11:0] ended_pixels, ended_expected, ended_width;
  wire counting = measuring_o || (frame_i && !had_frame && !taken_i && live_frame);
  reg live_frame;
  wire pixel = frame_i && line_i && counting;
  wire line_ended = in_line_before && !pixel;
  wire [11:0] pixels_held = true_pixels >= 13'hF00 ? 12'hF00 : true_pixels[11:0];
  wire [11:0] lines_held = true_lines >= 13'hF00 ? 12'hF00 : true_lines[11:0];
  always @(posedge clk_i) begin
    if (!begun) assume (rst_i);
    begun <= 1'b1;
    live <= !rst_i;
    live_frame <= 1'b1;
    had_frame <= frame_i || rst_i;
    had_measuring <= measuring_o;
    had_taken <= taken_i;
    had_lines <= lines_o;
    had_width <= width_o;
    had_wrong <= wrong_o;
    had_wrong_line <= wrong_line_o;
    had_expected <= expect_width_i;
    in_line_before <= pixel && !rst_i;
    true_pixels <= rst_i || !pixel ? 13'd0 : true_pixels == 13'h1000 ? 13'h1000 :
      true_pixels + 13'd1;
    if (rst_i || (frame_i && !had_frame && !measuring_o && !taken_i)) true_lines <= 13'd0;
    else if (ended && true_lines != 13'h1000) true_lines <= true_lines + 13'd1;
    ended <= line_ended && !rst_i;
    ended_second <= true_lines != 13'd0;
    ended_pixels <= pixels_held;
    ended_expected <= expect_width_i;
    ended_width <= width_o;

    if (begun && live && !rst_i) begin
      a_begins_at_a_frame_s_start: assert (!(measuring_o && !had_measuring) ||
                                           (frame_rose && !had_taken));
      a_ends_at_a_frame_s_end: assert (!(!measuring_o && had_measuring) || (!had_frame &&
        had_taken));
      a_ends_when_taken: assert (!(had_measuring && !had_frame && had_taken && !ended) ||
                                 !measuring_o);
      // Between frames the results are stable.
      a_still: assert (had_measuring || measuring_o || in_line_was ||
                       (lines_o == had_lines && width_o == had_width && wrong_o == had_wrong));
      a_lines_saturate: assert (lines_o >= had_lines || (measuring_o && !had_measuring));
      a_wrong_line_marks_the_frame: assert (!had_wrong_line || wrong_o);
    end
    if (begun && !rst_i) begin
      a_pixels: assert (pixels == (in_line_before ? pixels_held : ended ? ended_pixels : 12'd0) &&
                        true_pixels <= 13'h1000);
      a_lines: assert (lines_o == lines_held && true_lines <= 13'h1000);
      a_wrong_line: assert (wrong_line_o == (ended && (ended_expected != 12'd0
                              ? ended_pixels != ended_expected
                              : ended_second && ended_pixels != ended_width)));
      a_closing: assert (closing == ended && (!closing || measuring_o));
      a_first: assert (!measuring_o || first == (true_lines == 13'd0));
      a_in_line: assert (in_line == in_line_before);
      a_line_is_measured: assert (!in_line || measuring_o);
      a_width_is_the_first_line_s: assert (!width_known || width_o == first_pixels);
    end
    if (begun && rst_i) a_reset: assert (!measuring_o && lines_o == 12'd0);
    c_two_lines: cover (begun && !rst_i && !measuring_o && lines_o == 12'd2);
    c_wrong_line: cover (begun && !rst_i && wrong_line_o && expect_width_i == 12'd0);
  end

  reg frame_rose, in_line_was, width_known;
  reg [11:0] first_pixels;
  reg had_frame_2;
  always @(posedge clk_i) begin
    frame_rose <= frame_i && !had_frame;
    in_line_was <= in_line_before || pixel;
    if (rst_i || (frame_i && !had_frame && !measuring_o && !taken_i)) width_known <= 1'b0;
    else if (ended && true_lines == 13'd0) begin
      width_known <= 1'b1;
      first_pixels <= ended_pixels;
    end
  end
endmodule

`default_nettype wire
