// SPDX-License-Identifier: Apache-2.0
//
// The microsecond: one clock in CLOCKS, out of a flip-flop.
//
// tick_us_o  ____|'|____________________|'|____    CLOCKS = 25
`default_nettype none

module tick_prescaler #(
  parameter [4:0] CLOCKS = 5'd25
) (
  input  wire clk_i,
  input  wire rst_i,
  output reg  tick_us_o
);

  reg [4:0] count;

  always @(posedge clk_i or posedge rst_i) begin
    if (rst_i) begin
      count <= 5'd0;
      tick_us_o <= 1'b0;
    end else begin
      tick_us_o <= count == CLOCKS - 5'd1;
      count <= count == CLOCKS - 5'd1 ? 5'd0 : count + 5'd1;
    end
  end

endmodule

`default_nettype wire
