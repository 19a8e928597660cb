// SPDX-License-Identifier: Apache-2.0
// Watchdog over the DSP: fires when no register was written for period_ms_i.
//
//   arm_i     ___|''''''''''''''''''''''''''''''''''''''''''   a servo was enabled: armed from now
//   kick_i    ___|'|______|'|_________________________________
//   tick_ms_i              (|) |  |  |  | period_ms of them
//   fired_o   _______________________________________|'''''|__
//   event_o   _______________________________________|'|______
//   clear_i   _________________________________________|'|____   (counts as a kick)
//
// The period is read in the clock after a kick, so a write of the period that is itself the kick
// counts with the new value. Period 0: off. Arming lasts until reset. Once fired it stays so, and
// does not fire again, until clear_i. What the servos do meanwhile: action 0 hold their width,
// 1 go to the safe position, 2 and 3 no pulses.
//
// Milliseconds are those of tick_ms_i. The one in which the kick comes does not count, so it fires
// period_ms_i to period_ms_i + 1 milliseconds after the last kick: in the second clock after the
// last tick, if no kick comes until then. The count goes up from -period_ms_i until its sign
// changes.
`default_nettype none

module watchdog (
  input  wire        clk_i,
  input  wire        rst_i,
  input  wire        tick_ms_i,
  input  wire [15:0] period_ms_i,
  input  wire [1:0]  action_i,
  input  wire        arm_i,
  input  wire        kick_i,
  input  wire        clear_i,
`ifdef PROVE_MOTION
  output wire        armed_o,
`endif
  output wire        fired_o,
  output wire        event_o,
  output wire        hold_o,
  output wire        safe_o,
  output wire        off_o
);
  reg [16:0] ms;                    // -what is left; the highest bit is 1 when nothing is
  reg        over;                  // that has been seen
  reg        armed;
  reg        fired;
  reg        event_q;
  reg        load;
  reg        partial;               // the millisecond of the kick is not over

  wire kick = kick_i || clear_i || !armed;
  wire expire = ms[16] && !over && !load && !kick && !fired;

  always @(posedge clk_i or posedge rst_i) begin
    if (rst_i) begin
      ms <= 17'h10000;
      over <= 1'b1;
      armed <= 1'b0;
      fired <= 1'b0;
      event_q <= 1'b0;
      load <= 1'b1;
      partial <= 1'b1;
    end else begin
      armed <= armed || arm_i;
      load <= kick;
      partial <= load || (partial && !tick_ms_i);
      over <= load || ms[16];
      event_q <= expire;
      fired <= expire || (fired && !clear_i);
      if (load || (tick_ms_i && !partial && !ms[16])) begin
        ms <= (load ? {1'b0, ~period_ms_i} : ms) + 17'd1;
      end
    end
  end

  assign fired_o = fired;
  assign event_o = event_q;
  assign hold_o = fired && (action_i == 2'd0);
  assign safe_o = fired && (action_i == 2'd1);
  assign off_o = fired && action_i[1];

`ifdef PROVE_MOTION
  assign armed_o = armed;
`elsif FORMAL
  watchdog_properties properties (
    .clk_i(clk_i), .rst_i(rst_i), .tick_ms_i(tick_ms_i), .period_ms_i(period_ms_i),
    .action_i(action_i), .arm_i(arm_i), .kick_i(kick_i), .clear_i(clear_i), .fired_o(fired_o),
    .event_o(event_o), .hold_o(hold_o), .safe_o(safe_o), .off_o(off_o),
    .partial_i(partial), .ms_i(ms),
    .over_i(over), .load_i(load), .armed_i(armed)
  );
`endif
endmodule

`default_nettype wire
