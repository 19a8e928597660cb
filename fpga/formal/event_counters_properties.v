// SPDX-License-Identifier: Apache-2.0
// Properties of event_counters, for one counter chosen by the solver.
`default_nettype none

module event_counters_properties #(
  parameter EVENTS = 10,
  parameter SATURATING = 8
) (
  input wire clk_i,
  input wire rst_i,
  input wire [EVENTS-1:0] event_i,
  input wire [EVENTS-1:0] clear_i,
  input wire [8*EVENTS-1:0] count_o
);
  (* anyconst *) wire [3:0] chosen;
  wire [7:0] count = count_o[{chosen, 3'd0} +: 8];
  wire wraps = chosen >= SATURATING;

  reg begun = 1'b0;
  reg live, had_event, had_clear;
  reg [7:0] had;
  always @(posedge clk_i) begin
    assume (chosen < EVENTS);
    if (!begun) assume (rst_i);
    begun <= 1'b1;
    live <= !rst_i;
    had_event <= event_i[chosen];
    had_clear <= clear_i[chosen];
    had <= count;
    if (begun && live && !rst_i) begin
      a_counts: assert (!had_event || had_clear
        || count == (had == 8'd255 && !wraps ? had : had + 8'd1));
      a_clears: assert (!had_clear || count == {7'd0, had_event});
      a_keeps: assert (had_event || had_clear || count == had);
      c_counts: cover (count == 8'd3);
      c_cleared: cover (had_clear && had == 8'd2);
    end
    if (begun && rst_i) a_reset: assert (count == 8'd0);
  end
endmodule

`default_nettype wire
