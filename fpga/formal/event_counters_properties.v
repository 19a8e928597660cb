// SPDX-License-Identifier: Apache-2.0
// What event_counters promises, for one counter that the solver chooses.
`default_nettype none

module event_counters_properties #(
  parameter EVENTS = 10,
  parameter SATURATING = 8,
  parameter [4*EVENTS-1:0] PLACES = 40'd0
) (
  input wire clk_i,
  input wire rst_i,
  input wire [EVENTS-1:0] event_i,
  input wire clear_i,
  input wire [3:0] place_i,
  input wire [7:0] count_o,
  input wire [EVENTS-1:0] waiting_i,
  input wire [EVENTS-1:0] turn_i,
  input wire filling_i,
  input wire [4:0] fill_i,
  output wire [3:0] chosen_place_o,
  input wire [7:0] count_i            // the counter that stands there
);
  (* anyconst *) wire [3:0] chosen;
  wire [3:0] place = PLACES[{chosen, 2'd0} +: 4];
  assign chosen_place_o = place;
  wire mine = turn_i[chosen] && !filling_i && !clear_i;
  wire cleared = clear_i && place_i == place && !filling_i;
  wire wraps = chosen >= SATURATING;
  wire filled = !filling_i || fill_i[3:0] > place;

  reg begun = 1'b0;
  reg live, had_event, had_waiting, had_mine, had_cleared, had_filled, had_filling;
  reg [7:0] had;
  reg [EVENTS-1:0] had_all;
  always @(posedge clk_i) begin
    assume (chosen < EVENTS);
    if (!begun) assume (rst_i);
    begun <= 1'b1;
    live <= !rst_i;
    had_event <= event_i[chosen];
    had_waiting <= waiting_i[chosen];
    had_all <= waiting_i;
    had_mine <= mine;
    had_cleared <= cleared;
    had_filled <= filled;
    had_filling <= filling_i;
    had <= count_i;
    if (begun && live && !rst_i) begin
      a_counts: assert (!had_mine || count_i == (had == 8'd255 && !wraps ? had : had + 8'd1));
      a_clears: assert (!had_cleared || count_i == 8'd0);
      a_keeps: assert (had_mine || had_cleared || !had_filled || count_i == had);
      a_zero: assert (!((had_filling || filling_i) && filled) || count_i == 8'd0);
      a_waits: assert (waiting_i[chosen] == (had_event || (had_waiting && !had_mine)));
      a_first_comes_first: assert (!had_mine || (had_all & ((10'd1 << chosen) - 10'd1)) == 10'd0);
    end
    if (begun && !rst_i) begin
      a_read: assert (place_i != place || count_o == count_i);
      a_one_turn: assert ((turn_i & (turn_i - 10'd1)) == 10'd0
        && (turn_i & ~waiting_i) == 10'd0 && (turn_i != 10'd0 || waiting_i == 10'd0));
    end
    if (begun && rst_i) a_reset: assert (waiting_i == 10'd0 && filling_i);
  end
endmodule

`default_nettype wire
