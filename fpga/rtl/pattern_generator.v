// SPDX-License-Identifier: Apache-2.0
//
// A test picture with exact timing, in place of a camera, for bring-up.
//
// rows           | row 0           | row 1           | vblank rows     | row 0
// frame_o        _|^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^|_________________|^^^^^
// line_o         __________|^^^^^^^|_________|^^^^^^^|________________________
//                  hblank    width   hblank    width
//
// A row is hblank_i clocks of blanking and width_i pixels; a frame is height_i rows with frame_o
// high and vblank_i rows with frame_o low: (hblank + width) * (height + vblank) clocks. 0 counts
// as 4096. When a number changes, one frame may have any size up to 4096 x 4096; it ends like
// every other.
// run_i is looked at where a frame would start: frames are whole. Without it blanking continues.
// kind_i: 0 ramp: column + row * (width + 1) + frame * height * (width + 1), frames since run_i
// began;
// 1 checker: squares of 16 x 16, 0 or 1023; 2 prbs: x^10 + x^7 + 1 from seed_i with its bit 0 set,
// new in each frame; 3 walking ones: one bit, from bit 0 in each frame; 4 constant: seed_i.
// Latency: data_o belongs to line_o of the same clock.

`default_nettype none

module pattern_generator (
  input  wire clk_i,
  input  wire rst_i,
  input  wire run_i,
  input  wire [11:0] width_i,
  input  wire [11:0] height_i,
  input  wire [9:0] hblank_i,
  input  wire [7:0] vblank_i,
  input  wire [2:0] kind_i,
  input  wire [9:0] seed_i,
  output reg  frame_o,
  output wire line_o,
  output wire [9:0] data_o
);

  localparam [2:0] RAMP = 3'd0;
  localparam [2:0] CHECKER = 3'd1;
  localparam [2:0] WALKING = 3'd3;

  reg visible;
  reg [11:0] x_next;       // 1 at a part's first clock
  reg x_16;                // bit 4 of the column, which counts from 0
  reg [11:0] y;
  reg [9:0] value;
  reg field_ends;          // with this row; known in its second clock, which every row has

  assign line_o = visible && frame_o;

  wire [11:0] y_next = y + 12'd1;
  wire part_ends = x_next == (visible ? width_i : {2'd0, hblank_i});
  wire row_ends = visible && part_ends;
  wire frame_ends = row_ends && field_ends && frame_o;
  wire may_start = row_ends && field_ends && !frame_o;
  wire starts = may_start && run_i;
  wire stands = may_start && !run_i;

  always @(posedge clk_i or posedge rst_i) begin
    if (rst_i) begin
      visible <= 1'b0;
      frame_o <= 1'b0;
      x_next <= 12'd1;
      x_16 <= 1'b0;
      y <= 12'd0;
      field_ends <= 1'b0;
    end else if (!stands) begin
      field_ends <= y_next == (frame_o ? height_i : {4'd0, vblank_i});
      if (part_ends) visible <= !visible;
      x_next <= part_ends ? 12'd1 : x_next + 12'd1;
      x_16 <= !part_ends && x_next[4];
      if (row_ends) y <= field_ends ? 12'd0 : y_next;
      if (frame_ends || starts) frame_o <= !frame_o;
    end
  end

  // The ramp continues through all frames, with one more for each row, so that no two rows are
  // equal.
  wire ramp = kind_i == RAMP;
  wire walking = kind_i == WALKING;
  wire load = ramp ? stands : !frame_o;
  wire step = frame_o && (visible || (ramp && part_ends)) && !kind_i[2];
  wire [9:0] seed = {10{load && !ramp && !walking}} & seed_i;
  wire [9:0] ones = {{9{ramp}}, !kind_i[2]};
  wire [9:0] next = ramp ? value + 10'd1
                         : {value[8:0], walking ? value[9] : value[9] ^ value[6]};

  always @(posedge clk_i or posedge rst_i) begin
    if (rst_i) value <= 10'h3FF;
    else if (load || step) value <= (load ? ones : next) | seed;
  end

  assign data_o = kind_i == CHECKER ? {10{x_16 ^ y[4]}} : value;

`ifdef PROVE_PATTERN_GENERATOR
  pattern_generator_properties properties (
    .clk_i(clk_i), .rst_i(rst_i), .run_i(run_i), .width_i(width_i), .height_i(height_i),
    .hblank_i(hblank_i), .vblank_i(vblank_i), .kind_i(kind_i), .seed_i(seed_i),
    .frame_o(frame_o), .line_o(line_o), .data_o(data_o), .visible(visible), .x(x_next - 12'd1),
    .x_16(x_16), .y(y),
    .value(value), .field_ends(field_ends)
  );
`endif

endmodule

`default_nettype wire
