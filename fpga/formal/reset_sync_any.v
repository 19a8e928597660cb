// SPDX-License-Identifier: Apache-2.0
// Replaces reset_sync where a proof does not depend on the length of its reset: the reset ends at
// any edge of the clock after rst_i.
`default_nettype none

module reset_sync #(
  parameter STAGES = 4
) (
  input  wire clk_i,
  input  wire rst_i,
  input  wire request_i,
  output wire rst_o
);
  (* anyseq *) wire later;
  reg active;
  always @(posedge clk_i or posedge rst_i) begin
    if (rst_i) active <= 1'b1;
    else active <= active && later;
  end
  assign rst_o = active;
endmodule

`default_nettype wire
