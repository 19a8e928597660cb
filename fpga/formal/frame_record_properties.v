// SPDX-License-Identifier: Apache-2.0
// Properties of frame_record: which event changes which count, and that nothing else does.
`default_nettype none

module frame_record_properties (
  input wire clk_i,
  input wire rst_i,
  input wire hold_i,
  input wire measuring,
  input wire was_measuring,
  input wire [11:0] lines_i,
  input wire [11:0] width_i,
  input wire wrong_i,
  input wire [11:0] expect_height_i,
  input wire start_o,
  input wire finish,
  input wire wrong_height,
  input wire frame_error_o,
  input wire [15:0] frames_o,
  input wire [11:0] lines_o,
  input wire [11:0] pixels_o,
  input wire short_line_o,
  input wire short_frame_o
);
  reg begun = 1'b0;
  reg live, fell, held, had_wrong, had_error, level;
  reg [15:0] had_frames;
  reg [11:0] had_lines, had_pixels, had_lines_i, had_width_i, had_expected;
  reg had_short_line, had_short_frame;
  wire expected_wrong = had_expected != 12'd0 ? had_lines_i != had_expected
                                              : had_lines != 12'd0 && had_lines_i != had_lines;
  always @(posedge clk_i) begin
    if (!begun) assume (rst_i);
    begun <= 1'b1;
    live <= !rst_i;
    level <= measuring && !rst_i;
    fell <= !measuring && level;
    held <= hold_i;
    had_wrong <= wrong_i;
    had_error <= frame_error_o;
    had_frames <= frames_o;
    had_lines <= lines_o;
    had_pixels <= pixels_o;
    had_lines_i <= lines_i;
    had_width_i <= width_i;
    had_expected <= expect_height_i;
    had_short_line <= short_line_o;
    had_short_frame <= short_frame_o;
    if (begun && live && !rst_i) begin
      a_frames_count_ends: assert (frames_o == had_frames + {15'd0, fell});
      a_sizes_taken_at_the_end: assert (!(fell && !held) ||
        (lines_o == had_lines_i && pixels_o == had_width_i && short_line_o == had_wrong));
      a_sizes_stand_still: assert ((fell && !held) || (lines_o == had_lines &&
        pixels_o == had_pixels && short_line_o == had_short_line &&
        short_frame_o == had_short_frame));
      a_height_compared: assert (!(fell && !held) || short_frame_o == expected_wrong);
      a_error_is_told: assert (had_error == (fell && expected_wrong));
      a_start_at_rise: assert (start_o == (measuring && !level));
      a_taken_follows: assert (was_measuring == level);
    end
    if (begun && rst_i) a_reset: assert (frames_o == 16'd0 && lines_o == 12'd0);
    c_short_frame: cover (begun && live && !rst_i && short_frame_o);
    c_held: cover (begun && live && !rst_i && fell && held);
  end
endmodule

`default_nettype wire
