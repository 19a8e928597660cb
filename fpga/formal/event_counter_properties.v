// SPDX-License-Identifier: Apache-2.0
// What event_counter promises.
`default_nettype none

module event_counter_properties #(
  parameter BITS = 8
) (
  input wire clk_i,
  input wire rst_i,
  input wire event_i,
  input wire clear_i,
  input wire [BITS-1:0] count_o
);
  reg begun = 1'b0;
  reg running, occurred, cleared;
  reg [BITS-1:0] was;

  always @(posedge clk_i) begin
    if (!begun) assume (rst_i);
    begun <= 1'b1;
    running <= !rst_i;
    occurred <= event_i;
    cleared <= clear_i;
    was <= count_o;
  end

  always @(posedge clk_i) if (begun && running && !rst_i) begin
    a_clears: assert (!cleared || count_o == {{BITS-1{1'b0}}, occurred});
    a_counts: assert (cleared || !occurred || &was || count_o == was + 1'b1);
    a_saturates: assert (cleared || !(&was) || &count_o);
    a_keeps: assert (cleared || occurred || count_o == was);
    c_saturated: cover (&was && occurred);
  end
  always @(posedge clk_i) if (begun && rst_i) begin
    a_reset: assert (count_o == {BITS{1'b0}});
  end
endmodule

`default_nettype wire
