// SPDX-License-Identifier: Apache-2.0
// The watchdog fires when exactly `period` whole milliseconds have passed since the last kick, and
// never otherwise.
`default_nettype none

module watchdog_properties (
  input wire        clk_i,
  input wire        rst_i,
  input wire        tick_ms_i,
  input wire [15:0] period_ms_i,
  input wire [1:0]  action_i,
  input wire        arm_i,
  input wire        kick_i,
  input wire        clear_i,
  input wire        fired_o,
  input wire        event_o,
  input wire        hold_o,
  input wire        safe_o,
  input wire        off_o,
  input wire        partial_i,
  input wire [16:0] ms_i,
  input wire        over_i,
  input wire        load_i,
  input wire        armed_i
);
  reg        begun = 1'b0;
  reg        reset = 1'b1;
  reg        armed;
  reg        fired, clear, kick;
  // Time since the kick, and the period that was there in the clock after it.
  reg [15:0] silent_ms, period;
  reg        begun_ms;              // a tick came since the kick
  reg        counting;              // a period runs
  wire       again = kick_i || clear_i || !armed;
  reg        fresh;                 // the clock after a kick
  wire       due = counting && !fresh && !again && tick_ms_i && begun_ms &&
      (silent_ms + 16'd1 == period);
  reg        was_due, due_before;

  always @(posedge clk_i) begin
    if (!begun) assume (rst_i);
    begun <= 1'b1;
    reset <= rst_i;
    fired <= fired_o;
    clear <= clear_i;
    kick <= kick_i;
    due_before <= due && !rst_i;
    was_due <= due_before && !again && !rst_i;
    if (rst_i) begin
      armed <= 1'b0;
      fresh <= 1'b1;
      counting <= 1'b0;
      silent_ms <= 16'd0;
      begun_ms <= 1'b0;
    end else begin
      armed <= armed || arm_i;
      fresh <= again;
      if (fresh) begin
        counting <= (period_ms_i != 16'd0) && !(fired_o && !clear_i);
        period <= period_ms_i;
        silent_ms <= 16'd0;
        begun_ms <= 1'b0;
      end else if (tick_ms_i && counting) begin
        begun_ms <= 1'b1;
        if (begun_ms) silent_ms <= silent_ms + 16'd1;
        if (begun_ms && silent_ms + 16'd1 == period) counting <= 1'b0;
      end
    end
    if (begun && !rst_i) begin
      if (!reset) begin
        a_fires_when_due: assert (!was_due || (fired_o && event_o));
        a_never_else: assert (!(fired_o && !fired) || was_due);
        a_event_once: assert (event_o == was_due);
        a_stays: assert (!fired || fired_o || clear);
        a_cleared: assert (!clear || !fired_o);
      end
      a_not_armed: assert (armed || !fired_o);
      a_reset: assert (!reset || (!fired_o && !event_o));
      a_actions: assert ({hold_o, safe_o, off_o} ==
                         (!fired_o ? 3'b000 : action_i == 2'd0 ? 3'b100 :
                          action_i == 2'd1 ? 3'b010 : 3'b001));
      c_fires: cover (fired_o && silent_ms == 16'd2);
      c_cleared: cover (fired && clear && !fired_o);
      // Helps the induction.
      a_load: assert (load_i == fresh);
      a_armed: assert (armed_i == armed);
      a_left: assert (fresh || !counting || (silent_ms < period
        && partial_i == !begun_ms && ms_i == 17'h10000 - {1'b0, period} + {1'b0, silent_ms}));
      a_over: assert (fresh || counting || fired_o || (ms_i[16] && (over_i || due_before)));
      a_not_fired: assert (fresh || !counting || !fired_o);
      a_not_over: assert (!due_before || (!over_i && ms_i[16] && !fresh && !counting && !fired_o));
    end
  end
endmodule

`default_nettype wire
