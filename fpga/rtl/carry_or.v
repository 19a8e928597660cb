// SPDX-License-Identifier: Apache-2.0
//
// any_o = |bits_i, written as the borrow of 0 - bits_i: on the carry chain of an FPGA the joining
// of many bits takes no look-up tables beyond those that make the bits.
//
// bits_i  =X= 000 =X= 010 =X= 000 =
// any_o   ____|^^^^^^^|___________
//
// WIDTH: number of bits. No clock.

`default_nettype none

module carry_or #(
  parameter WIDTH = 8
) (
  input  wire [WIDTH-1:0] bits_i,
  output wire any_o
);

  wire [WIDTH-1:0] unused_difference;
  assign {any_o, unused_difference} = {WIDTH+1{1'b0}} - {1'b0, bits_i};

`ifdef PROVE_CARRY_OR
  carry_or_properties #(.WIDTH(WIDTH)) properties (
    .bits_i(bits_i), .any_o(any_o)
  );
`endif

endmodule

`default_nettype wire
