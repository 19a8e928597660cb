// SPDX-License-Identifier: Apache-2.0
//
// Takes the pins of one camera into the domain of its pixel clock, at the edge that the sensor's
// clock setting leaves in the middle of the data.
//
//                       ___     ___     ___     ___     ___     ___
// clk_i               _|   |___|   |___|   |___|   |___|   |___|   |__
// pins, falling_i = 0  ======X= p0  =X= p1  =X= p2  =X================   change at falling edges
// data_o               ==========X= p0  =X= p1  =X= p2  =X============   rising edge
// pins, falling_i = 1  ==X= p0  =X= p1  =X= p2  =X====================   change at rising edges
// data_o               ==========X= p0  =X= p1  =X= p2  =X============   falling, then rising edge
//
// In reset frame_o is high: a frame may be under way, and only a frame whose start was seen counts.
// falling_i may come from another domain: it crosses here. A change of it may spoil one pixel.
// BITS: data pins. Latency: half a period (falling_i = 0: the pin to the register itself).

`default_nettype none

module pixel_capture #(
  parameter BITS = 10
) (
  input  wire clk_i,
  input  wire rst_i,
  input  wire falling_i,
  input  wire [BITS-1:0] data_i,
  input  wire line_i,
  input  wire frame_i,
  output reg  [BITS-1:0] data_o,
  output reg  line_o,
  output reg  frame_o
);

  wire falling;
  sync_bit edge_choice (
    .clk_i(clk_i),
    .rst_i(rst_i),
    .level_i(falling_i),
    .level_o(falling)
  );

  reg [BITS-1:0] falling_data;
  reg falling_line;
  reg falling_frame;
  always @(negedge clk_i or posedge rst_i) begin
    if (rst_i) begin
      falling_data <= {BITS{1'b0}};
      falling_line <= 1'b0;
      falling_frame <= 1'b1;
    end else begin
      falling_data <= data_i;
      falling_line <= line_i;
      falling_frame <= frame_i;
    end
  end

  always @(posedge clk_i or posedge rst_i) begin
    if (rst_i) begin
      data_o <= {BITS{1'b0}};
      line_o <= 1'b0;
      frame_o <= 1'b1;
    end else begin
      data_o <= falling ? falling_data : data_i;
      line_o <= falling ? falling_line : line_i;
      frame_o <= falling ? falling_frame : frame_i;
    end
  end

`ifdef PROVE_PIXEL_CAPTURE
  pixel_capture_properties #(.BITS(BITS)) properties (
    .clk_i(clk_i), .rst_i(rst_i), .falling(falling), .data_i(data_i), .line_i(line_i),
    .frame_i(frame_i), .data_o(data_o), .line_o(line_o), .frame_o(frame_o),
    .stored({falling_data, falling_line, falling_frame})
  );
`endif

endmodule

`default_nettype wire
