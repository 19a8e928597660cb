// SPDX-License-Identifier: Apache-2.0
// For finding a trace to a cover statement: it is where the assertion of the opposite fails.
`default_nettype none

(* techmap_celltype = "$cover" *)
module cover_search (
  input wire A,
  input wire EN
);
  \$assert search (.A(!A), .EN(EN));
endmodule

`default_nettype wire
