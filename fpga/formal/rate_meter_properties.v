// SPDX-License-Identifier: Apache-2.0
// Properties of rate_meter: a value is the number of steps between two marks of its own camera, or
// 65535; it changes only in its own turn, and not while it is held.
`default_nettype none

module rate_meter_properties (
  input wire clk_i,
  input wire rst_i,
  input wire tick_10us_i,
  input wire tick_16ms_i,
  input wire [1:0] hold_i,
  input wire [1:0] activity_i,
  input wire [1:0] start_i,
  input wire [15:0] clock0_khz_o,
  input wire [15:0] clock1_khz_o,
  input wire [15:0] period0_10us_o,
  input wire [15:0] period1_10us_o,
  input wire [1:0] turn,
  input wire armed,
  input wire [15:0] count
);
  reg begun = 1'b0;
  reg live;
  // One counter for each value, from mark to mark, that does not know of turns.
  reg [15:0] steps0, steps1, steps2, steps3;
  reg [1:0] had_hold, had_turn;
  reg had_16ms, had_armed, had_full;
  reg [1:0] had_start;
  reg [15:0] had_count, had0, had1, had2, had3, was0, was1, was2, was3;
  always @(posedge clk_i) begin
    if (!begun) assume (rst_i);
    begun <= 1'b1;
    live <= !rst_i;
    had_hold <= hold_i;
    had_turn <= turn;
    had_16ms <= tick_16ms_i;
    had_start <= start_i;
    had_armed <= armed;
    had_full <= count == 16'hFFFF;
    had_count <= count;
    was0 <= steps0;
    was1 <= steps1;
    was2 <= steps2;
    was3 <= steps3;
    had0 <= clock0_khz_o;
    had1 <= clock1_khz_o;
    had2 <= period0_10us_o;
    had3 <= period1_10us_o;
    steps0 <= rst_i || tick_16ms_i ? 16'd0 : steps0 + {15'd0, activity_i[0] && steps0 != 16'hFFFF};
    steps1 <= rst_i || tick_16ms_i ? 16'd0 : steps1 + {15'd0, activity_i[1] && steps1 != 16'hFFFF};
    steps2 <= rst_i || start_i[0] ? 16'd0 : steps2 + {15'd0, tick_10us_i && steps2 != 16'hFFFF};
    steps3 <= rst_i || start_i[1] ? 16'd0 : steps3 + {15'd0, tick_10us_i && steps3 != 16'hFFFF};
    if (begun && live && !rst_i) begin
      a_clock0: assert (clock0_khz_o == had0 || (clock0_khz_o == was0 && had_16ms && !had_hold[0]));
      a_clock1: assert (clock1_khz_o == had1 || (clock1_khz_o == was1 && had_16ms && !had_hold[1]));
      a_period0: assert (period0_10us_o == had2 || (!had_hold[0] && (period0_10us_o == 16'hFFFF ||
                         (period0_10us_o == was2 && had_start[0]))));
      a_period1: assert (period1_10us_o == had3 || (!had_hold[1] && (period1_10us_o == 16'hFFFF ||
                         (period1_10us_o == was3 && had_start[1]))));
      a_value_is_stored: assert (!(had_armed && had_16ms && had_turn == 2'd0 && !had_hold[0]) ||
                                 clock0_khz_o == was0);
      a_turns_in_order: assert (turn == had_turn || turn == had_turn + 2'd1);
      // Every turn ends: a mark ends it, and without marks the counter saturates.
      a_mark_ends_a_turn: assert (!(had_armed && (had_turn[1] ? had_start[had_turn[0]] :
        had_16ms)) ||
                                  turn != had_turn);
      a_full_ends_a_turn: assert (!(had_full && had_turn[1]) || turn != had_turn);
      a_no_wrap: assert (count >= had_count || count == 16'd0);
      a_wraps_at_marks_only: assert (!(had_count != 16'd0 && count == 16'd0) || had_full ||
                                     had_16ms || had_start != 2'd0);
    end
    if (begun && !rst_i) begin
      // Helps the induction.
      a_count: assert (!armed || count == (turn == 2'd0 ? steps0 : turn == 2'd1 ? steps1 :
                                           turn == 2'd2 ? steps2 : steps3));
    end
    c_round: cover (begun && live && !rst_i && had_turn == 2'd3 && turn == 2'd0);
  end
endmodule

`default_nettype wire
