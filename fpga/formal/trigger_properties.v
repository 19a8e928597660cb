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
  input wire [15:0] count_i,
  input wire        waiting_i,
  input wire        pulsing_i,
  input wire [1:0]  cameras_i
);
  reg        begun = 1'b0;
  reg        reset = 1'b1;
  reg [1:0]  lines, wanted, fire;
  reg        busy, waiting, tick;
  reg [15:0] delay, width;          // of this pulse
  reg [16:0] waited, high;          // ticks
  wire [15:0] length = (width == 16'd0) ? 16'd1 : width;
  wire       high_now = trigger_o != 2'd0;
  wire       accepted = !busy && (fire != 2'd0);

  always @(posedge clk_i) begin
    if (!begun) assume (rst_i);
    begun <= 1'b1;
    reset <= rst_i;
    lines <= trigger_o;
    busy <= busy_o;
    tick <= tick_us_i;
    fire <= fire_i;
    if (!busy_o && fire_i != 2'd0) begin
      wanted <= fire_i;
      delay <= delay_us_i;
      waited <= 17'd0;
    end else if (busy_o && !high_now && tick_us_i) begin
      waited <= waited + 17'd1;
    end
    // The width is read with the tick that starts the pulse.
    if (!high_now) begin
      width <= width_us_i;
      high <= 17'd0;
    end else if (tick_us_i) begin
      high <= high + 17'd1;
    end
    if (begun && !rst_i) begin
      if (!reset) begin
        a_delay_exact: assert (!(high_now && lines == 2'd0) ||
                               (tick && waited == {1'b0, delay} + 17'd1));
        a_width_exact: assert (!(!high_now && lines != 2'd0) ||
                               (tick && high == {1'b0, length}));
        a_done: assert (done_o == (!high_now && lines != 2'd0));
        a_accepted: assert (!accepted || busy_o);
        a_ends: assert (!(busy && !busy_o) || lines != 2'd0);
        a_only_when_fired: assert (!(busy_o && !busy) || accepted);
      end
      a_same_clock: assert (trigger_o == 2'd0 || trigger_o == wanted);
      a_busy: assert (!high_now || busy_o);
      a_bounded_wait: assert (!(busy_o && !high_now) || waited <= {1'b0, delay});
      a_bounded_pulse: assert (!high_now || high < {1'b0, length});
      a_reset: assert (!reset || (trigger_o == 2'd0 && !busy_o && !done_o));
      // Helps the induction.
      a_state: assert (!(waiting_i && pulsing_i) && pulsing_i == high_now &&
                       (!busy_o || (cameras_i == wanted && wanted != 2'd0)) &&
                       (!waiting_i || {1'b0, count_i} == {1'b0, delay} - waited) &&
                       (!pulsing_i || {1'b0, count_i} == {1'b0, width} - high));
    end
    c_pulse: cover (begun && !rst_i && !reset && lines == 2'd3 && high == 17'd3 && delay == 16'd2 &&
                    done_o);
  end
endmodule

`default_nettype wire
