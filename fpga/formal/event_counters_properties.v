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
  input wire working_i,
  input wire zeroing_i,
  input wire saturating_i,
  input wire [3:0] at_i,
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
  // One clock more ago: what is written now.
  reg wrote_mine, wrote_cleared, wrote_filled, wrote_filling;
  reg [7:0] had;
  reg [EVENTS-1:0] had_all;
  reg had_clear;
  always @(posedge clk_i) begin
    assume (chosen < EVENTS);
    if (!begun) assume (rst_i);
    begun <= 1'b1;
    live <= !rst_i;
    had_event <= event_i[chosen];
    had_waiting <= waiting_i[chosen];
    had_all <= waiting_i;
    had_mine <= mine && !rst_i;
    had_cleared <= cleared && !rst_i;
    had_filled <= filled && !rst_i;
    had_filling <= filling_i || rst_i;
    wrote_mine <= had_mine && !rst_i;
    wrote_cleared <= had_cleared && !rst_i;
    wrote_filled <= had_filled && !rst_i;
    wrote_filling <= had_filling || rst_i;
    had <= count_i;
    had_clear <= clear_i && !rst_i;
    if (begun && live && !rst_i) begin
      a_counts: assert (!wrote_mine || count_i == (had == 8'd255 && !wraps ? had : had + 8'd1));
      a_clears: assert (!wrote_cleared || count_i == 8'd0);
      a_keeps: assert (wrote_mine || wrote_cleared || !wrote_filled || count_i == had);
      a_zero: assert (!((wrote_filling || had_filling) && had_filled) || count_i == 8'd0);
      a_waits: assert (waiting_i[chosen] == (had_event || (had_waiting && !had_mine)));
      // Helps the induction: the second clock works on what the first one chose.
      a_at: assert ((!(had_mine || had_cleared) || (at_i == place && working_i)) &&
        zeroing_i == (had_filling || had_clear) && (!had_mine || saturating_i == !wraps));
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
