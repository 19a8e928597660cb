// SPDX-License-Identifier: Apache-2.0
// Properties of event_counters, for one counter chosen by the solver.
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
  input wire read_i,
  input wire [3:0] place_i,
  input wire [7:0] count_o,
  input wire [EVENTS-1:0] waiting_i,
  input wire [EVENTS-1:0] turn_i,
  input wire step_i,
  input wire zero_i,
  input wire wraps_i,
  input wire [3:0] at_i,              // place in memory, of the clock before
  input wire filling_i,
  input wire [3:0] fill_i,
  output wire [3:0] chosen_place_o,
  input wire [7:0] count_i            // the counter at that place
);
  (* anyconst *) wire [3:0] chosen;
  wire [3:0] place = PLACES[{chosen, 2'd0} +: 4];
  assign chosen_place_o = place;
  wire mine = turn_i[chosen] && !filling_i && !clear_i && !read_i;
  wire cleared = clear_i && place_i == place && !filling_i;
  wire wraps = chosen >= SATURATING;
  wire filled = !(filling_i || had_filling) ||
      (had_filling && live && (had_fill ^ 4'd1) > (place ^ 4'd1));

  reg begun = 1'b0;
  reg live, had_event, had_waiting, had_mine, had_cleared, had_filled, had_filling;
  reg [7:0] had;
  reg [3:0] had_fill;
  reg [EVENTS-1:0] had_all, had_turn;
  reg had_had_mine, had_had_cleared, was, had_read, had_clear;
  reg [3:0] had_place_i;
  reg [3:0] had_turn_place;
  reg [3:0] turn_place;
  integer i;
  always @* begin
    turn_place = 4'd0;
    for (i = 0; i < EVENTS; i = i + 1) if (turn_i[i]) turn_place = PLACES[4*i +: 4];
  end
  always @(posedge clk_i) begin
    assume (chosen < EVENTS);
    if (!begun) assume (rst_i);
    // As the register file fills its own memory; here it may end at any place.
    if (rst_i) assume (filling_i && fill_i == 4'd1);
    else if (begun) assume (!filling_i ||
        (had_filling && fill_i == (((had_fill ^ 4'd1) + {3'd0, live}) ^ 4'd1)));
    had_fill <= fill_i;
    begun <= 1'b1;
    live <= !rst_i;
    had_event <= event_i[chosen];
    had_waiting <= waiting_i[chosen];
    had_all <= waiting_i;
    had_turn <= turn_i;
    had_turn_place <= turn_place;
    had_read <= read_i;
    had_clear <= clear_i;
    had_place_i <= place_i;
    had_mine <= mine;
    had_cleared <= cleared;
    had_filled <= filled;
    had_filling <= filling_i;
    had <= count_i;
    had_had_mine <= had_mine && live && !rst_i;
    had_had_cleared <= had_cleared && live && !rst_i;
    was <= live && !rst_i;
    if (begun && live && was && !rst_i) begin
      a_counts: assert (!had_had_mine || count_i == (had == 8'd255 && !wraps ? had : had + 8'd1));
      a_clears: assert (!had_had_cleared || count_i == 8'd0);
      a_keeps: assert (had_had_mine || had_had_cleared || !had_filled || count_i == had);
    end
    if (begun && live && !rst_i) begin
      a_zero: assert (!((had_filling || filling_i) && filled) || count_i == 8'd0);
      a_waits: assert (waiting_i[chosen] == (had_event || (had_waiting && !had_mine)));
      a_first_comes_first: assert (!had_mine || (had_all & ((10'd1 << chosen) - 10'd1)) == 10'd0);
      a_read: assert (!had_read || had_filling || had_place_i != place || count_o == count_i);
      c_counts: cover (count_i == 8'd3 && !filling_i);
      c_cleared: cover (had_had_cleared && !had_mine && !had_filling);
      // Helps the induction.
      a_step: assert (step_i == (had_turn != 10'd0 && !had_filling && !had_clear && !had_read)
        && zero_i == (had_filling || had_clear) && !(step_i && zero_i));
      a_at: assert (!(step_i || zero_i) || at_i == (had_filling ? had_fill
        : had_clear ? had_place_i : had_turn_place));
      a_wraps: assert (!had_mine || wraps_i == wraps);
    end
    if (begun && !rst_i) begin
      a_one_turn: assert ((turn_i & (turn_i - 10'd1)) == 10'd0
        && (turn_i & ~waiting_i) == 10'd0 && (turn_i != 10'd0 || waiting_i == 10'd0));
    end
    if (begun && rst_i) a_reset: assert (waiting_i == 10'd0);
  end
endmodule

`default_nettype wire
