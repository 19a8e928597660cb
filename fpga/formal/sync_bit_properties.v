// SPDX-License-Identifier: Apache-2.0
// What sync_bit promises.
`default_nettype none

module sync_bit_properties #(
  parameter RESET_LEVEL = 1'b0
) (
  input wire clk_i,
  input wire rst_i,
  input wire level_i,
  input wire level_o,
  input wire meta_i
);
  reg begun = 1'b0;
  reg [1:0] seen;

  always @(posedge clk_i) begin
    if (!begun) assume (rst_i);
    begun <= 1'b1;
    seen <= rst_i ? {2{RESET_LEVEL}} : {seen[0], level_i};
  end

  always @(posedge clk_i) if (begun && !rst_i) begin
    a_first: assert (meta_i == seen[0]);
    a_two_edges: assert (level_o == seen[1]);
    c_changes: cover (level_o != RESET_LEVEL);
  end
  always @(posedge clk_i) if (begun && rst_i) begin
    a_reset: assert (level_o == RESET_LEVEL);
  end
endmodule

`default_nettype wire
