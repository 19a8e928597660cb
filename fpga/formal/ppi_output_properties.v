// SPDX-License-Identifier: Apache-2.0
// Properties of ppi_output: relations of the PPI's pins. All inputs are free.
`default_nettype none

module ppi_output_properties (
  input wire clk_i,
  input wire rst_i,
  input wire counter_rst_i,
  input wire first_line_i,
  input wire tag_i,
  input wire [1:0] source_i,
  input wire open_i,
  input wire [9:0] data_i,
  input wire line_i,
  input wire frame_i,
  input wire [9:0] data_o,
  input wire line_o,
  input wire frame_o,
  input wire passing_o,
  input wire first_line,
  input wire tag,
  input wire after_first,
  input wire waiting,
  input wire counted,
  input wire [7:0] number
);
  reg begun = 1'b0;
  reg live;
  reg had_open, had_frame, had_line, had_first_line_i, had_tag_i;
  reg had_first_line, had_tag, had_passing, had_line_o, had_frame_o;
  reg [9:0] had_data;
  reg [1:0] had_source;
  reg [7:0] had_number;
  reg had_counted;
  reg lines_seen;        // a line of the frame that passes has begun
  reg line_over;         // and ended
  wire in_line = had_line && had_frame && had_open;
  always @(posedge clk_i) begin
    if (!begun) assume (rst_i && counter_rst_i);
    if (counter_rst_i) assume (rst_i);
    begun <= 1'b1;
    live <= !rst_i;
    had_open <= open_i;
    had_frame <= frame_i;
    had_line <= line_i;
    had_first_line_i <= first_line_i;
    had_tag_i <= tag_i;
    had_first_line <= first_line;
    had_tag <= tag;
    had_passing <= passing_o;
    had_line_o <= line_o;
    had_frame_o <= frame_o;
    had_data <= data_i;
    had_source <= source_i;
    had_number <= number;
    had_counted <= counted;
    lines_seen <= !rst_i && passing_o && (lines_seen || line_o);
    line_over <= !rst_i && passing_o && (line_over || (lines_seen && !line_o));

    if (begun && live && !rst_i) begin
      a_closed_is_silent: assert (had_open || (!line_o && !frame_o && !passing_o));
      a_line_inside_frame: assert (!line_o || passing_o);
      a_line_is_the_source_s: assert (line_o == in_line);
      a_passing_is_the_source_s: assert (passing_o == (had_frame && had_open));
      a_raw_sync: assert (had_first_line || frame_o == passing_o);
      a_pulse_inside_line: assert (!had_first_line || !frame_o || line_o);
      a_pulse_is_the_first_line: assert (!had_first_line || frame_o == (line_o && !line_over_now));
      a_mode_fixed_while_open: assert (!had_open || (first_line == had_first_line &&
        tag == had_tag));
      a_mode_taken_while_closed: assert (had_open ||
                                         (first_line == had_first_line_i && tag == had_tag_i));
      a_data: assert (!line_o || (had_tag && !lines_seen) || data_o == had_data);
      a_tag: assert (!(line_o && had_tag && !lines_seen) || data_o == {had_source, had_number});
      a_number_counts_frames: assert (counted == (line_o && !lines_seen) &&
                                      number == had_number + {7'd0, had_counted});
    end
    if (begun && rst_i) a_reset: assert (!line_o && !frame_o && !passing_o);
    if (begun && !rst_i) begin
      // Helps the induction.
      a_after_first: assert (after_first == (passing_o && line_over_now) &&
                             (!line_over || lines_seen));
      a_waiting: assert (waiting == (!line_o && !after_first));
    end
    c_second_line: cover (begun && !rst_i && line_o && line_over);
    c_pulse_ends: cover (begun && live && !rst_i && had_frame_o && !frame_o && passing_o);
    c_tag: cover (begun && live && !rst_i && line_o && had_tag && !lines_seen);
  end
  wire line_over_now = line_over || (lines_seen && !line_o && passing_o);
endmodule

`default_nettype wire
