// SPDX-License-Identifier: Apache-2.0
// What clock_switch promises. One step of the proof is a step of time: each of the clocks, and
// choice, hold, force and tick, may change at any of them; a clock may stop and come back at any
// of them. time_step.v gives the output one step to clear the chains; a clock that comes back in
// the very step in which force arrives stays off.
`default_nettype none

module clock_switch_properties #(
  parameter STUCK = 5
) (
  input wire clk_i,
  input wire rst_i,
  input wire tick_us_i,
  input wire [2:0] select_i,
  input wire hold_i,
  input wire force_i,
  input wire [2:0] clocks,
  input wire clock_o,
  input wire [2:0] asked,
  input wire [2:0] enabled,
  input wire [STUCK-1:0] low,
  input wire [STUCK-1:0] high,
  input wire stop
);

  (* gclk *) wire now;
  reg begun = 1'b0;
  reg clk_before;
  reg tick_before;
  reg clock_before;
  reg hold_before;
  reg [2:0] clocks_before;
  reg [2:0] enabled_before;
  reg [2:0] select_before;
  always @(posedge now) begin
    begun <= 1'b1;
    clk_before <= clk_i;
    tick_before <= tick_us_i;
    clock_before <= clock_o;
    hold_before <= hold_i;
    clocks_before <= clocks;
    enabled_before <= enabled;
    select_before <= select_i;
    // Reset is at the start only; one source at most is asked for.
    assume (rst_i == !begun);
    assume (select_i == 3'b000 || select_i == 3'b001 || select_i == 3'b010 || select_i == 3'b100);
  end

  wire rises = clock_o && !clock_before;
  wire falls = !clock_o && clock_before;
  wire [2:0] rising = clocks & ~clocks_before;
  wire [2:0] falling = ~clocks & clocks_before;
  wire [2:0] busy = asked | enabled;

  // The output has been high, or low, at every step since that edge of a source.
  reg [2:0] high_since_rise;
  reg [2:0] low_since_fall;
  always @(posedge now) begin
    high_since_rise <= (high_since_rise | rising) & {3{clock_o}};
    low_since_fall <= (low_since_fall | falling) & {3{!clock_o}};
    if (!begun) low_since_fall <= 3'b000;
  end

  // Ticks that clk_i has taken since the output changed.
  reg [2:0] stood;
  wire [4:0] chain = clock_before ? high : low;
  wire [2:0] stood_now = clk_i && !clk_before && tick_before && stood != 3'd7 ? stood + 3'd1 :
    stood;
  always @(posedge now) stood <= !begun || rises || falls ? 3'd0 : stood_now;

  always @(posedge now) begin
    if (begun) begin
      a_one_enabled: assert (enabled == 3'b000 || enabled == 3'b001 || enabled == 3'b010 ||
                             enabled == 3'b100);
      a_one_leg: assert (busy == 3'b000 || busy == 3'b001 || busy == 3'b010 || busy == 3'b100);
      a_output_is_enabled: assert (!clock_o || |(enabled & clocks));
      // The only edge that is not an edge of a source is the fall, by force, of a source that stays
      // high.
      a_rise_is_a_source_s: assert (!rises || |(rising & enabled_before & enabled));
      a_fall_is_a_source_s: assert (!falls || |(falling & enabled_before) || stop);
      a_forced_fall_is_late: assert (!falls || |(falling & enabled_before) ||
                                     stood_now >= STUCK - 1);
      // A high phase of the output is a whole high phase of a source (or forced: see above).
      a_high_phase_whole: assert (!falls || |(falling & enabled_before & high_since_rise) || stop);
      // A low phase of the output contains the whole low phase of the source that ends it.
      a_low_phase_whole: assert (!rises || |(rising & enabled & low_since_fall));
      // A clock that moves ends by its own edge, and not while it is held.
      a_force_spares_moving_clocks: assert (!(|(enabled_before & ~enabled)) ||
        |(enabled_before & ~enabled & falling) || stood_now >= STUCK - 1);
      a_hold: assert (!(|(enabled_before & ~enabled)) || !hold_before || stop);
      // Force removes every source once the output has stopped.
      a_force_acts: assert (!(force_i && stood >= STUCK + 1) || busy == 3'b000);
      // Helps the induction.
      a_high_before: assert (!clock_before || |(high_since_rise & enabled_before & clocks_before));
      a_low_before: assert (clock_before || (
        ~clocks_before & enabled_before & ~low_since_fall) == 3'b000);
      a_chains_1: assert (!(low[1] || high[1]) || stood_now >= 1);
      a_chains_2: assert (!(low[2] || high[2]) || stood_now >= 2);
      a_chains_3: assert (!(low[3] || high[3]) || stood_now >= 3);
      a_chains_4: assert (!(low[4] || high[4]) || stood_now >= 4);
      a_filled: assert ((stood < 2 || chain[0]) && (stood < 3 || chain[1]) && (stood < 4 ||
        chain[2]) &&
                        (stood < 5 || chain[3]) && (stood < 6 || chain[4]));
    end
    c_first: cover (begun && rises && enabled == 3'b001);
    c_changes: cover (begun && rises && enabled == 3'b100 && low_since_fall[0]);
    c_forced_high: cover (begun && falls && stop);
    c_forced_low: cover (begun && stop && !falls && |enabled_before);
  end
endmodule

`default_nettype wire
