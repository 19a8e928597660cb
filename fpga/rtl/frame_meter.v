// SPDX-License-Identifier: Apache-2.0
//
// Measures the frames of one camera, in the camera's pixel clock: pixels of the first line, lines,
// lines of a wrong length. frame_record takes the results over into the control domain.
//
// frame_i     _|^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^|___________________|^^^
// line_i      ____|^^^^^|____|^^^^^|____|^^^^^|_______________________
// measuring_o __|^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^|________________|^^^
// taken_i     _________|^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^|_______________
// lines_o     --X== 0 ====X==== 1 ====X==== 2 ===X====== 3 ========X= 0
// results                                        |<---- still ---->|
//
// measuring_o and taken_i shake hands: a frame begins only when the results of the one before have
// been taken, and ends only when its beginning has been seen. Frames nearer than that (about four
// periods of the slower clock) are not measured, never measured wrongly.
// A line is line_i inside frame_i. expect_width_i is constant while frames are measured; 0 means:
// as the first line of the frame. Counts stop at 3840, more than any sensor here has.
// Latency: 2 clocks; a line's length is compared in the clock after its end.

`default_nettype none

module frame_meter (
  input  wire clk_i,
  input  wire rst_i,
  input  wire frame_i,
  input  wire line_i,
  input  wire [11:0] expect_width_i,
  input  wire taken_i,
  output reg  measuring_o,
  output reg  [11:0] lines_o,
  output reg  [11:0] width_o,
  output reg  wrong_o,
`ifdef PROVE_CAMERA_CHANNEL
  output wire closing_o,
`endif
  output wire wrong_line_o
);

  reg frame_before;
  wire begins = frame_i && !frame_before && !measuring_o && !taken_i;
  reg in_line;
  reg first;
  reg [11:0] pixels;                   // of the line, until the clock after its end
  reg closing;                         // that clock
  reg [1:0] differs;                   // in its upper and lower bits from what it should be
  reg comparable;
  wire pixel = frame_i && line_i && (measuring_o || begins);
  wire line_ends = in_line && !pixel && measuring_o;
  wire ends = measuring_o && !frame_i && taken_i && !line_ends;
  wire expecting = expect_width_i != 12'd0;

  wire [11:0] target = expecting ? expect_width_i : width_o;

  assign wrong_line_o = closing && comparable && differs != 2'd0;
`ifdef PROVE_CAMERA_CHANNEL
  assign closing_o = closing;
`endif

  always @(posedge clk_i or posedge rst_i) begin
    if (rst_i) begin
      frame_before <= 1'b1;
      measuring_o <= 1'b0;
      in_line <= 1'b0;
      first <= 1'b1;
      pixels <= 12'd0;
      closing <= 1'b0;
      differs <= 2'd0;
      comparable <= 1'b0;
      width_o <= 12'd0;
      lines_o <= 12'd0;
      wrong_o <= 1'b0;
    end else begin
      frame_before <= frame_i;
      measuring_o <= (measuring_o || begins) && !ends;
      in_line <= pixel;
      if (!in_line) pixels <= {11'd0, pixel};
      else if (pixel && pixels[11:8] != 4'hF) pixels <= pixels + 12'd1;
      closing <= line_ends;
      differs <= {pixels[11:6] != target[11:6], pixels[5:0] != target[5:0]};
      comparable <= expecting || !first;
      if (begins) begin
        first <= 1'b1;
        lines_o <= 12'd0;
        wrong_o <= 1'b0;
      end else if (closing) begin
        first <= 1'b0;
        if (first) width_o <= pixels;
        if (lines_o[11:8] != 4'hF) lines_o <= lines_o + 12'd1;
        if (wrong_line_o) wrong_o <= 1'b1;
      end
    end
  end

`ifdef PROVE_FRAME_METER
  frame_meter_properties properties (
    .clk_i(clk_i), .rst_i(rst_i), .frame_i(frame_i), .line_i(line_i),
    .expect_width_i(expect_width_i), .taken_i(taken_i), .measuring_o(measuring_o),
    .lines_o(lines_o), .width_o(width_o), .wrong_o(wrong_o), .wrong_line_o(wrong_line_o),
    .pixels(pixels), .in_line(in_line), .first(first),
    .closing(closing)
  );
`endif

endmodule

`default_nettype wire
