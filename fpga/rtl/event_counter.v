// SPDX-License-Identifier: Apache-2.0
//
// Counts events up to its greatest value and stays there; clear_i starts again, and an event in the
// same clock counts.
//
// event_i  _|^|___|^|_______________
// clear_i  __________________|^|____
// count_o  =0=X=1====X=2======X=0===
//
// BITS: width of the count. Latency: 1 clock.

`default_nettype none

module event_counter #(
  parameter BITS = 8
) (
  input  wire clk_i,
  input  wire rst_i,
  input  wire event_i,
  input  wire clear_i,
  output reg  [BITS-1:0] count_o
);

  wire full = &count_o;

  always @(posedge clk_i or posedge rst_i) begin
    if (rst_i) count_o <= {BITS{1'b0}};
    else if (clear_i) count_o <= {{BITS-1{1'b0}}, event_i};
    else if (event_i && !full) count_o <= count_o + 1'b1;
  end

`ifdef PROVE_EVENT_COUNTER
  event_counter_properties #(.BITS(BITS)) properties (
    .clk_i(clk_i), .rst_i(rst_i), .event_i(event_i), .clear_i(clear_i), .count_o(count_o)
  );
`endif

endmodule

`default_nettype wire
