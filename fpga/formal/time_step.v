// SPDX-License-Identifier: Apache-2.0
// One step of the proof's time as a delay: it breaks the loop that runs through asynchronous clears.
`default_nettype none

module time_step (
  input  wire level_i,
  output reg  level_o
);
  (* gclk *) wire now;
  always @(posedge now) level_o <= level_i;
endmodule

`default_nettype wire
