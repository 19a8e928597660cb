// SPDX-License-Identifier: Apache-2.0
// Properties of pixel_capture: each output is the pins as they were before one edge of the clock.
// One step of the proof is a step of time; clock, pins and choice of the edge are free.
`default_nettype none

module pixel_capture_properties #(
  parameter BITS = 10
) (
  input wire clk_i,
  input wire rst_i,
  input wire falling,
  input wire [BITS-1:0] data_i,
  input wire line_i,
  input wire frame_i,
  input wire [BITS-1:0] data_o,
  input wire line_o,
  input wire frame_o,
  input wire [BITS+1:0] stored
);
  (* gclk *) wire now;
  reg begun = 1'b0;
  reg live = 1'b0;  // two steps after reset
  reg clk_before, falling_before;
  reg [BITS+1:0] pins_before, out_before;
  wire [BITS+1:0] pins = {data_i, line_i, frame_i};
  wire [BITS+1:0] out = {data_o, line_o, frame_o};
  wire fall = !clk_i && clk_before;
  wire [BITS+1:0] at_fall = fall ? pins_before : last_fall;
  reg [BITS+1:0] last_fall;
  reg [1:0] falls;  // since reset
  always @(posedge now) begin
    assume (rst_i == !begun);
    begun <= 1'b1;
    clk_before <= clk_i;
    falling_before <= falling;
    pins_before <= pins;
    out_before <= out;
    last_fall <= at_fall;
    live <= begun;
    falls <= !live ? 2'd0 : fall ? {falls[0], 1'b1} : falls;
    if (begun && falls[0]) begin
      a_only_at_rising_edges: assert ((clk_i && !clk_before) || out == out_before);
      a_rising: assert (!(clk_i && !clk_before) || falling_before || out == pins_before);
      a_falling: assert (!(clk_i && !clk_before) || !falling_before || out == at_fall);
    end
    // Helps the induction.
    if (begun && falls[0]) a_stored: assert (stored == at_fall);
    if (rst_i) a_reset: assert (out == 1);  // frame high, the rest low
    c_falling: cover (begun && falls[1] && falling && out != pins_before && line_o);
  end
endmodule

`default_nettype wire
