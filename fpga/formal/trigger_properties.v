// SPDX-License-Identifier: Apache-2.0
// The trigger pulse: its start, its length, its cameras.
`default_nettype none

module trigger_properties (
  input wire        clk_i,
  input wire        rst_i,
  input wire        tick_us_i,
  input wire [1:0]  fire_i,
  input wire [15:0] delay_us_i,
  input wire [15:0] width_us_i,
  input wire [1:0]  trigger_o,
  input wire        busy_o,
  input wire        done_o,
  input wire [16:0] count_i,
  input wire        waiting_i,
  input wire        pulsing_i,
  input wire [1:0]  cameras_i
);
  reg        begun = 1'b0;
  reg        reset = 1'b1;
  reg [1:0]  lines, wanted, fire;
  reg        busy, tick, tick2;
  reg [15:0] width_before;
  reg [15:0] delay, width;          // of this pulse
  reg [16:0] waited, high;          // ticks
  wire       high_now = trigger_o != 2'd0;
  wire       accepted = !busy && (fire != 2'd0);

  always @(posedge clk_i) begin
    if (!begun) assume (rst_i);
    begun <= 1'b1;
    reset <= rst_i;
    lines <= trigger_o;
    busy <= busy_o;
    tick <= tick_us_i;
    tick2 <= tick;
    width_before <= width_us_i;
    if (!rst_i) assume (width_us_i != 16'd0);
    fire <= fire_i;
    if (!busy_o && fire_i != 2'd0) begin
      wanted <= fire_i;
      delay <= delay_us_i;
      waited <= 17'd0;
    end else if (busy_o && !high_now && tick_us_i) begin
      waited <= waited + 17'd1;
    end
    // The width is read with the tick that starts the pulse, two clocks before it is high.
    if (!high_now) begin
      width <= width_before;
      high <= {16'd0, tick_us_i};
    end else if (tick_us_i) begin
      high <= high + 17'd1;
    end
    if (begun && !rst_i) begin
      if (!reset) begin
        a_delay_exact: assert (!(high_now && lines == 2'd0) ||
                               (tick2 && waited == {1'b0, delay} + 17'd1 + {16'd0, tick}));
        a_width_exact: assert (!(!high_now && lines != 2'd0) ||
                               (tick2 && high == {1'b0, width} + {16'd0, tick}));
        a_done: assert (done_o == (!high_now && lines != 2'd0));
        a_accepted: assert (!accepted || busy_o);
        a_ends: assert (!(busy && !busy_o) || lines != 2'd0);
        a_only_when_fired: assert (!(busy_o && !busy) || accepted);
      end
      a_same_clock: assert (trigger_o == 2'd0 || trigger_o == wanted);
      a_busy: assert (!high_now || busy_o);
      a_bounded_wait: assert (!(busy_o && !high_now) || waited <= {1'b0, delay} + 17'd1);
      a_bounded_pulse: assert (!high_now || high <= {1'b0, width});
      a_reset: assert (!reset || (trigger_o == 2'd0 && !busy_o && !done_o));
      // Helps the induction.
      a_state: assert (!(waiting_i && pulsing_i) && (!high_now || pulsing_i) &&
                       (!busy_o || (cameras_i == wanted && wanted != 2'd0)) &&
                       (!waiting_i || (waited <= {1'b0, delay} &&
                        count_i == 17'h10000 - {1'b0, delay} + waited)) &&
                       (!pulsing_i || (high_now ? count_i == 17'h10000 - {1'b0, width} + high
                        : tick && waited == {1'b0, delay} + 17'd1 &&
                          count_i == 17'h10000 - {1'b0, width_before})));
    end
    c_pulse: cover (begun && !rst_i && !reset && lines == 2'd3 && high == 17'd3 && delay == 16'd2 &&
                    done_o);
  end
endmodule

`default_nettype wire
