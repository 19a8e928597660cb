// SPDX-License-Identifier: Apache-2.0
// Properties of pattern_generator: exact geometry and values. The numbers are constant, at least 1
// and otherwise free; run_i is free.
`default_nettype none

module pattern_generator_properties (
  input wire clk_i,
  input wire rst_i,
  input wire run_i,
  input wire [11:0] width_i,
  input wire [11:0] height_i,
  input wire [9:0] hblank_i,
  input wire [7:0] vblank_i,
  input wire [2:0] kind_i,
  input wire [9:0] seed_i,
  input wire frame_o,
  input wire line_o,
  input wire [9:0] data_o,
  input wire visible,
  input wire [11:0] x,
  input wire x_16,
  input wire [11:0] y,
  input wire [9:0] value,
  input wire field_ends
);
  reg begun = 1'b0;
  reg live, had_frame, had_line, had_run;
  reg [11:0] width, height;
  reg [9:0] hblank, seed;
  reg [7:0] vblank;
  reg [2:0] kind;
  // Measured from the outputs alone.
  reg [11:0] pixels;      // of the line, before this clock
  reg [11:0] gap;         // clocks since the frame began or a line ended, before this clock
  reg [11:0] rows;        // lines that ended in this frame
  reg [12:0] low_clocks;  // of the present row of the vertical blanking
  reg [7:0] low_rows;
  reg [9:0] ramp;         // what the ramp must show
  reg [9:0] last_pixel;
  wire [12:0] row_clocks = {1'b0, width} + {3'd0, hblank};
  wire last_low = low_rows == vblank - 8'd1 && low_clocks == row_clocks - 13'd1;
  always @(posedge clk_i) begin
    if (!begun) assume (rst_i);
    begun <= 1'b1;
    if (begun) assume (width_i == width && height_i == height && hblank_i == hblank &&
                       vblank_i == vblank && kind_i == kind && seed_i == seed);
    assume (width_i != 12'd0 && height_i != 12'd0 && hblank_i != 10'd0 && vblank_i != 8'd0);
    width <= width_i;
    height <= height_i;
    hblank <= hblank_i;
    vblank <= vblank_i;
    kind <= kind_i;
    seed <= seed_i;
    live <= !rst_i;
    had_frame <= frame_o && !rst_i;
    had_line <= line_o && !rst_i;
    had_run <= run_i;
    last_pixel <= data_o;
    if (rst_i) begin
      pixels <= 12'd0;
      gap <= 12'd0;
      rows <= 12'd0;
      low_clocks <= 13'd0;
      low_rows <= 8'd0;
    end else if (frame_o) begin
      low_clocks <= 13'd0;
      low_rows <= 8'd0;
      pixels <= line_o ? pixels_now + 12'd1 : 12'd0;
      gap <= line_o ? 12'd0 : gap_now + 12'd1;
      rows <= rows_now;
    end else begin
      pixels <= 12'd0;
      gap <= 12'd0;
      rows <= 12'd0;
      if (!last_low) begin
        low_clocks <= low_clocks == row_clocks - 13'd1 ? 13'd0 : low_clocks + 13'd1;
        low_rows <= low_rows + {7'd0, low_clocks == row_clocks - 13'd1};
      end
    end
    if (rst_i || (!frame_o && last_low && !run_i)) ramp <= 10'h3FF;
    else ramp <= ramp + {9'd0, frame_o && (line_o || gap_now + 12'd1 == {2'd0, hblank})};

    if (begun && live && !rst_i) begin
      a_line_not_longer: assert (!line_o || pixels_now < width);
      a_line_not_shorter: assert (!(had_line && !line_o) || pixels == width);
      a_blanking_before_line: assert (!(line_o && !had_line) || gap == {2'd0, hblank});
      a_blanking_not_longer: assert (!frame_o || line_o || gap_now < {2'd0, hblank});
      a_line_inside_frame: assert (!line_o || frame_o);
      a_frame_ends_with_its_last_line: assert (!(had_frame && !frame_o) ||
                                               (had_line && rows + 12'd1 == height));
      a_no_more_lines: assert (!frame_o || rows_now < height);
      a_starts_after_the_blanking: assert (!(frame_o && !had_frame) || was_last_low);
      a_starts_on_run: assert (!(frame_o && !had_frame) || had_run);
      a_starts_at_once: assert (!(was_last_low && had_run) || frame_o);
    end
    if (begun && !rst_i) begin
      a_ramp: assert (!(line_o && kind_i == 3'd0) || data_o == ramp);
      a_checker: assert (!(line_o && kind_i == 3'd1) ||
        data_o == {10{pixels_now[4] ^ rows_now[4]}});
      a_prbs_first: assert (!(line_o && kind_i == 3'd2 && rows_now == 12'd0 &&
        pixels_now == 12'd0) ||
                            data_o == (seed_i | 10'd1));
      a_prbs: assert (!(line_o && had_line && kind_i == 3'd2) ||
                      data_o == {last_pixel[8:0], last_pixel[9] ^ last_pixel[6]});
      a_walking_first: assert (!(line_o && kind_i == 3'd3 && rows_now == 12'd0 &&
                                 pixels_now == 12'd0) || data_o == 10'd1);
      a_walking: assert (!(line_o && had_line && kind_i == 3'd3) ||
                         data_o == {last_pixel[8:0], last_pixel[9]});
      a_constant: assert (!(line_o && kind_i[2]) || data_o == seed_i);
      // Helps the induction.
      a_state: assert (x == (!visible ? (frame_o ? gap_now : low_clocks[11:0])
                                      : frame_o ? pixels_now : low_clocks[11:0] - {2'd0,
                                        hblank_i}));
      a_column: assert (x_16 == x[4]);
      a_rows: assert (y == (frame_o ? rows_now : {4'd0, low_rows}) &&
                      (frame_o || (low_clocks < row_clocks_i && low_rows < vblank_i)));
      a_field: assert ((!visible && x == 12'd0) ||
        field_ends == (y + 12'd1 == (frame_o ? height_i : {4'd0, vblank_i})));
      a_visible: assert (frame_o || visible == (low_clocks >= {3'd0, hblank_i}));
      a_ramp_value: assert (kind_i != 3'd0 || value == ramp);
      a_walking_one: assert (kind_i != 3'd3 || !frame_o ||
                             (value != 10'd0 && (value & (value - 10'd1)) == 10'd0));
      a_value_at_start: assert (!frame_o || rows_now != 12'd0 || pixels_now != 12'd0 ||
        value == (kind_i == 3'd2 ? seed_i | 10'd1 : kind_i == 3'd3 ? 10'd1 :
                  kind_i == 3'd4 ? seed_i : value));
      a_prbs_never_stuck: assert (!frame_o || kind_i != 3'd2 || value != 10'd0);
      a_value_constant: assert (!frame_o || !kind_i[2] || value == seed_i);
    end
    if (begun && rst_i) a_reset: assert (!frame_o && !line_o);
    c_frame: cover (begun && live && !rst_i && had_frame && !frame_o && width == 12'd3 &&
                    height == 12'd2 && hblank == 10'd2);
    c_second_frame: cover (begun && live && !rst_i && frame_o && !had_frame);
  end
  reg was_last_low;
  always @(posedge clk_i) was_last_low <= !rst_i && !frame_o && last_low;
  wire [12:0] row_clocks_i = {1'b0, width_i} + {3'd0, hblank_i};
  // The measured numbers of this clock: a line that ended ends now.
  wire [11:0] pixels_now = pixels;
  wire [11:0] gap_now = gap;
  wire [11:0] rows_now = rows + {11'd0, had_line && frame_o && !line_o};
endmodule

`default_nettype wire
