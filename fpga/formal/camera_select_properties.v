// SPDX-License-Identifier: Apache-2.0
// Properties of camera_select, for any behaviour of clock, gate, requests and cameras.
`default_nettype none

module camera_select_properties (
  input wire clk_i,
  input wire rst_i,
  input wire tick_ms_i,
  input wire stream_i,
  input wire [1:0] request_i,
  input wire alternating_i,
  input wire [6:0] frames_each_i,
  input wire [7:0] timeout_ms_i,
  input wire [1:0] lost_i,
  input wire clock_busy_i,
  input wire gate_open_i,
  input wire frame_start_i,
  input wire [1:0] active_o,
  input wire [2:0] select_o,
  input wire gate_o,
  input wire gate_reset_o,
  input wire force_o,
  input wire switching_o,
  input wire forced_o,
  input wire ending_o,
  input wire switched_o,
  input wire timed_out_o,
  input wire [1:0] state,
  input wire [1:0] target,
  input wire [8:0] wait_ms,
  input wire [1:0] settled,
  input wire [7:0] remaining,
  input wire [1:0] wanted
);
  localparam [1:0] IDLE = 2'd0;
  localparam [1:0] STOP = 2'd1;
  localparam [1:0] CHANGE = 2'd2;
  localparam [1:0] START = 2'd3;

  reg begun = 1'b0;
  reg live;
  reg [1:0] had_state, had_active, had_wanted, had_lost, had_target;
  reg [2:0] had_select;
  reg had_busy, had_gate_reset, had_force, had_timed_out, had_switched, had_stream, had_open;
  reg had_forced, had_alternating;
  reg [2:0] off_clocks;       // clocks in a row without any clock busy, in STOP
  reg [7:0] ticks;            // milliseconds in this state
  reg [7:0] limit;            // the time-out when the state began
  reg [6:0] frames;           // started since the source changed
  reg [6:0] frames_wanted;
  wire waiting = state == STOP || state == START;
  wire active_lost = (active_o == 2'd0 && lost_i[0]) || (active_o == 2'd1 && lost_i[1]);
  reg had_active_lost, had_other_lost;
  always @(posedge clk_i) begin
    if (!begun) assume (rst_i);
    begun <= 1'b1;
    live <= !rst_i;
    had_state <= state;
    had_active <= active_o;
    had_wanted <= wanted;
    had_target <= target;
    had_select <= select_o;
    had_busy <= clock_busy_i;
    had_gate_reset <= gate_reset_o;
    had_force <= force_o;
    had_forced <= forced_o;
    had_timed_out <= timed_out_o;
    had_switched <= switched_o;
    had_stream <= stream_i;
    had_open <= gate_open_i;
    had_alternating <= alternating_i;
    had_active_lost <= active_lost;
    had_other_lost <= (active_o == 2'd0 && lost_i[1]) || (active_o == 2'd1 && lost_i[0]);
    off_clocks <= rst_i || state != STOP || clock_busy_i ? 3'd0
                  : off_clocks == 3'd4 ? 3'd4 : off_clocks + 3'd1;
    if (rst_i || !waiting) begin
      ticks <= 8'd0;
      limit <= timeout_ms_i;
    end else begin
      ticks <= ticks + {7'd0, tick_ms_i && ticks != 8'd255};
    end
    if (rst_i) begin
      frames <= 7'd0;
      frames_wanted <= 7'd1;
    end else if (state == CHANGE) begin
      frames <= 7'd0;
      frames_wanted <= frames_each_i == 7'd0 ? 7'd1 : frames_each_i;
    end else if (frame_start_i && frames != 7'd127) begin
      frames <= frames + 7'd1;
    end

    if (begun && !rst_i) begin
      a_one_source: assert (select_o == 3'b000 || select_o == 3'b001 || select_o == 3'b010 ||
                            select_o == 3'b100);
      a_clock_is_the_active_source_s: assert (state == STOP || state == CHANGE ? select_o == 3'b000
        : select_o == (active_o == 2'd0 ? 3'b001 : active_o == 2'd1 ? 3'b010 : 3'b100));
      a_gate_reset_only_without_a_clock: assert (gate_reset_o == (state == CHANGE));
      a_gate_closed_in_a_change: assert (!(state == STOP || state == CHANGE) || !gate_o);
      a_force_only_in_a_change: assert (!force_o || state == STOP || state == CHANGE);
      a_switching: assert (switching_o == (state != IDLE));
      // After the time-out every wait is over, or clock_switch gets the command to cut.
      a_stop_forces_in_time: assert (state != STOP || ticks <= limit || force_o);
      a_start_ends_in_time: assert (state != START || ticks <= limit);
      a_events_exclude: assert (!(switched_o && timed_out_o));
      // Helps the induction.
      a_wait: assert (!waiting || wait_ms[8]
        || wait_ms == 9'h100 - {1'b0, limit} + {1'b0, ticks});
      a_ticks: assert (!waiting || wait_ms[8] || ticks <= limit);
      a_sources_exist: assert (active_o != 2'd3 && target != 2'd3);
      a_settled: assert (state != STOP || (off_clocks[2] ? settled == 2'd3 :
        settled == off_clocks[1:0]));
      a_remaining: assert (frames >= frames_wanted ? remaining[7]
        : remaining == 8'h80 - {1'b0, frames_wanted} + {1'b0, frames});
    end
    if (begun && live && !rst_i) begin
      a_source_changes_without_a_clock: assert (active_o == had_active || had_state == CHANGE);
      a_off_before_the_change: assert (!(state == CHANGE && had_state != CHANGE) ||
        off_clocks == 3'd4);
      a_change_is_what_was_wanted: assert (!(had_state == CHANGE) || active_o == had_target);
      a_stop_takes_the_wish: assert (!(state == STOP && had_state == IDLE) ||
                                     (target == had_wanted && target != active_o));
      a_idle_follows_the_wish: assert (!(had_state == IDLE && had_wanted != had_active) ||
                                       state == STOP);
      a_idle_stays: assert (!(had_state == IDLE && had_wanted == had_active) || state == IDLE);
      a_order: assert (state == had_state || state == had_state + 2'd1);
      a_change_is_one_clock: assert (had_state != CHANGE || state == START);
      a_lost_source_is_forced: assert (!(had_state == STOP && state == STOP && had_active_lost) ||
                                       force_o);
      a_lost_start_gives_up: assert (!(had_state == START && had_active_lost) || state == IDLE);
      a_force_has_a_reason: assert (!(force_o && !had_force) || had_active_lost ||
        had_wait[8]);
      a_force_stays: assert (!(had_force && state == STOP) || force_o);
      a_forced_is_told: assert (!(had_state == STOP && state == CHANGE) || forced_o == had_force);
      a_forced_stands: assert (forced_o == had_forced || (had_state == STOP && state == CHANGE));
      a_switched_is_the_end: assert (!had_switched || (had_state == START && state == IDLE &&
                                     (had_stream ? had_open : had_busy)));
      a_end_is_told: assert (!(had_state == START && state == IDLE) || had_switched ||
        had_timed_out);
      a_force_is_told: assert (!(force_o && !had_force) || had_timed_out);
      a_gate_follows_the_stream: assert (!gate_o || had_stream);
      a_alternates_after_its_frames: assert (!(had_alternating && had_state == IDLE &&
        state == STOP &&
        !had_active[1]) || had_frames >= had_frames_wanted || had_active_lost);
      a_never_to_a_lost_camera: assert (!(had_alternating && had_state == IDLE && state == STOP &&
        !had_active[1]) || !had_other_lost);
      a_alternates: assert (!(had_alternating && had_state == IDLE && !had_active[1] &&
        had_frames >= had_frames_wanted && !had_other_lost) || (state == STOP &&
        target == {1'b0, !had_active[0]}));
      a_pattern_for_the_rest: assert (had_alternating || !(had_state == IDLE && state == STOP) ||
                                      target == (had_request[1] ? 2'd2 : had_request));
    end
    c_change: cover (begun && !rst_i && switched_o && active_o == 2'd1);
    c_forced: cover (begun && !rst_i && forced_o && state == IDLE);
    c_given_up: cover (begun && !rst_i && timed_out_o && state == START);
    c_alternated: cover (begun && live && !rst_i && alternating_i && active_o == 2'd1 &&
                         state == IDLE && stream_i);
  end
  reg [8:0] had_wait;
  reg [6:0] had_frames, had_frames_wanted;
  reg [1:0] had_request;
  always @(posedge clk_i) begin
    had_wait <= wait_ms;
    had_frames <= frames;
    had_frames_wanted <= frames_wanted;
    had_request <= request_i;
  end
endmodule

`default_nettype wire
