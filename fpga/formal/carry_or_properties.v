// SPDX-License-Identifier: Apache-2.0
// What carry_or promises.
`default_nettype none

module carry_or_properties #(
  parameter WIDTH = 8
) (
  input wire [WIDTH-1:0] bits_i,
  input wire any_o
);
  always @* begin
    a_any: assert (any_o == |bits_i);
    c_one: cover (any_o && bits_i[WIDTH-1]);
  end
endmodule

`default_nettype wire
