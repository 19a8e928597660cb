// SPDX-License-Identifier: Apache-2.0
//
// Counters of events, 8 bits each.
//
// event_i[n]     _|^|_|^|_________|^|__
// clear_i[n]     _______________|^|_____
// counter n      0 | 1 | 2 =====| 0 | 1
//
// The lowest SATURATING counters stay at 255, the others wrap. An event in the clock of a clear
// counts. Counter n is count_o[8*n +: 8]. Latency: 1 clock.

`default_nettype none

module event_counters #(
  parameter EVENTS = 10,
  parameter SATURATING = 8
) (
  input  wire clk_i,
  input  wire rst_i,
  input  wire [EVENTS-1:0] event_i,
  input  wire [EVENTS-1:0] clear_i,
  output wire [8*EVENTS-1:0] count_o
);

  genvar n;
  generate
    for (n = 0; n < EVENTS; n = n + 1) begin : counter
      reg [7:0] count;
      wire full = n < SATURATING && count == 8'd255;
      always @(posedge clk_i or posedge rst_i) begin
        if (rst_i) count <= 8'd0;
        else if (clear_i[n]) count <= {7'd0, event_i[n]};
        else if (event_i[n] && !full) count <= count + 8'd1;
      end
      assign count_o[8*n +: 8] = count;
    end
  endgenerate

`ifdef PROVE_EVENT_COUNTERS
  event_counters_properties #(.EVENTS(EVENTS), .SATURATING(SATURATING)) properties (
    .clk_i(clk_i), .rst_i(rst_i), .event_i(event_i), .clear_i(clear_i), .count_o(count_o)
  );
`endif

endmodule

`default_nettype wire
