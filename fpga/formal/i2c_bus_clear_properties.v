// SPDX-License-Identifier: Apache-2.0
// Nine clocks and a STOP, START at most once, all within 106 ticks.
`default_nettype none

module i2c_bus_clear_properties (
  input wire       clk_i,
  input wire       rst_i,
  input wire       tick_us_i,
  input wire       go_i,
  input wire       sda_i,
  input wire       scl_low_o,
  input wire       sda_low_o,
  input wire       done_o,
  input wire       busy_i,
  input wire       started_i,
  input wire [3:0] phase_i,
  input wire [3:0] clock_i
);
  reg       begun = 1'b0;
  reg       reset = 1'b1;
  reg       scl_low, sda_low, busy, go, sda, done, tick;
  reg [3:0] rises;                  // of SCL in this run, the present clock included
  reg       stopped;                // the last edge was a STOP
  reg       start_sent, free_start;
  reg       zero_sent;              // SDA was low at a rise of SCL
  reg [6:0] ticks;
  wire      rise = scl_low && !scl_low_o;
  wire      start = !scl_low && !scl_low_o && !sda_low && sda_low_o;
  wire      stop = !scl_low && !scl_low_o && sda_low && !sda_low_o;
  wire      begin_run = busy_i && !busy;
  wire [3:0] rises_now = begin_run ? 4'd0 : rises + {3'd0, rise};
  wire      stopped_now = !begin_run && (stop || (stopped && sda_low_o == sda_low &&
                                                  scl_low_o == scl_low));

  always @(posedge clk_i) begin
    if (!begun) assume (rst_i);
    begun <= 1'b1;
    reset <= rst_i;
    scl_low <= scl_low_o;
    sda_low <= sda_low_o;
    busy <= busy_i && !rst_i;
    go <= go_i;
    sda <= sda_i;
    done <= done_o;
    tick <= tick_us_i;
    rises <= rst_i ? 4'd0 : rises_now;
    stopped <= !rst_i && stopped_now;
    start_sent <= !rst_i && !begin_run && busy_i && (start || start_sent);
    free_start <= !rst_i && !begin_run && busy_i && ((start && sda) || free_start);
    zero_sent <= !rst_i && !begin_run && busy_i && ((rise && sda_low_o) || zero_sent);
    ticks <= (rst_i || !busy_i) ? 7'd0 : ticks + {6'd0, tick_us_i};
    if (begun && !rst_i && !reset) begin
      a_nine_clocks_and_stop: assert (!done_o || (rises == 4'd10 && stopped_now));
      a_ends_with_done: assert (!(busy && !busy_i) || done_o);
      a_done_once: assert (!done_o || (busy && !busy_i && !done));
      a_free_when_idle: assert (busy_i || (!scl_low_o && !sda_low_o));
      // The ticks of a run are those of its phases, so there are 105 of them.
      a_bounded: assert (!busy_i || begin_run || (ticks < 7'd105 &&
                         ticks == (clock_i == 4'd15 ? {3'd0, phase_i} - 7'd5 :
                                   7'd5 + {3'd0, clock_i} * 7'd10 + {3'd0, phase_i})));
      a_only_on_command: assert (!begin_run || go);
      a_sda_moves_low: assert (sda_low_o == sda_low || (scl_low && scl_low_o) || start || stop);
      a_start_when_free: assert (!start || (rises < 4'd10 && !free_start &&
                                            (sda || rises == 4'd0)));
      a_start_first: assert (!scl_low_o || start_sent || begin_run);
      a_one_zero: assert (!(rise && sda_low_o) || (!zero_sent && rises == 4'd9));
      a_one_stop: assert (!stop || rises == 4'd10);
      // Helps the induction.
      a_rises: assert (!busy_i || (rises_now == ((clock_i == 4'd15) ? 4'd0 :
                                   clock_i + {3'd0, phase_i > 4'd5}) &&
                       (clock_i == 4'd15 || clock_i <= 4'd9) && phase_i <= 4'd9));
      a_lines: assert (!busy_i || (scl_low_o == (phase_i <= 4'd5 && clock_i != 4'd15) &&
                       (!sda_low_o || clock_i == 4'd9 || start_sent || start)));
      a_sent: assert (!busy_i || clock_i == 4'd15 || start_sent);
      a_zero: assert (!busy_i || !zero_sent || (clock_i == 4'd9 && phase_i > 4'd5));
      a_sda_of_clock: assert (!busy_i || begin_run || clock_i == 4'd9 || phase_i <= 4'd2 ||
                              phase_i > 4'd6 || !sda_low_o);
      a_tail: assert (!(busy_i && clock_i == 4'd9) || sda_low_o == (phase_i > 4'd2) ||
                      phase_i <= 4'd2);
      a_started: assert (!busy_i || started_i == ((start && sda) || (free_start && !begin_run)));
      a_first: assert (!busy_i || clock_i != 4'd15 || (phase_i >= 4'd5 &&
                       sda_low_o == (phase_i > 4'd6) && (phase_i > 4'd6 || !started_i) &&
                       (start || start_sent || phase_i <= 4'd6)));
    end
    c_first_clock: cover (begun && !rst_i && !reset && start_sent && rise);
  end
endmodule

`default_nettype wire
