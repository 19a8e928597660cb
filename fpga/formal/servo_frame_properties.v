// SPDX-License-Identifier: Apache-2.0
// Properties of servo_frame; servo_pwm_properties.v relies on the assertions marked (*).
`default_nettype none

module servo_frame_properties (
  input wire        clk_i,
  input wire        rst_i,
  input wire        tick_us_i,
  input wire [14:0] period_us_i,
  input wire        frame_o,
  input wire        channel_o,
  input wire [1:0]  load_o,
  input wire [11:0] phase_us_o,
  input wire        early_o,
  input wire [4:0]  sub_clock_o,
  input wire [14:0] phase_i,
  input wire [14:0] period_i
);
  reg        begun = 1'b0;
  reg        fresh;
  reg        first_us;         // in the first microsecond of a frame
  reg [14:0] wanted;           // the last good period at the end of a frame's first microsecond
  wire [14:0] ticks, now;
  wire [4:0]  clocks, sub;
  wire        long_us;

  servo_clockwork clockwork (
    .clk_i(clk_i), .rst_i(rst_i), .fresh_i(fresh), .frame_i(frame_o), .ticks_o(ticks),
    .clocks_o(clocks), .long_o(long_us), .now_o(now), .sub_o(sub)
  );

  always @(posedge clk_i) begin
    if (!begun) assume (rst_i);
    // a_range of the register file.
    assume (period_us_i >= 15'd15000 && period_us_i <= 15'd25000);
    begun <= 1'b1;
    fresh <= tick_us_i && !rst_i;
    if (rst_i) begin
      wanted <= 15'd20000;
      first_us <= 1'b0;
    end else begin
      first_us <= (frame_o || first_us) && !tick_us_i;
      if (tick_us_i && (frame_o || first_us)) begin
        wanted <= period_us_i;
      end
    end
  end

  reg        channel_before;
  reg [2:0]  same;              // clocks in which it was that
  always @(posedge clk_i) begin
    channel_before <= channel_o;
    same <= rst_i || channel_o != channel_before ? 3'd0 : same == 3'd7 ? same : same + 3'd1;
  end

  reg        reset_before = 1'b0;
  always @(posedge clk_i) begin
    reset_before <= rst_i;
    if (begun && !rst_i) begin
      // A frame starts exactly this many ticks after the last one, in the clock after the tick.
      a_period_exact: assert (!frame_o || (ticks + 15'd1 == wanted));
      a_never_late: assert (now < wanted || now == 15'd0);
      a_period_range: assert (period_i >= 15'd15000 && period_i <= 15'd25000);  // (*)
      a_frame_fresh: assert (!frame_o || fresh);                              // (*)
      a_early: assert (early_o == (now != 15'd0 && now < 15'd4096));          // (*)
      a_phase: assert (!early_o || phase_us_o == now[11:0]);                  // (*)
      a_sub: assert (reset_before || sub_clock_o == sub);                     // (*)
      // A width changes 32 and 64 us after the start, for a channel that servo_width has had for a
      // while.
      a_load: assert (load_o == ({now == 15'd63, now == 15'd31} & {2{tick_us_i}}));  // (*)
      a_settled: assert (!(load_o[0] && channel_before) && !(load_o[1] && !channel_before)
        && (load_o == 2'd0 || same >= 3'd5));                                 // (*)
      c_load: cover (load_o[1]);
      c_frame: cover (frame_o);
      c_period: cover (wanted == 15'd15001 && period_i == wanted);
      // Helps the induction.
      a_state: assert (period_i == wanted && phase_i != 15'd0 && phase_i <= period_i &&
                       (phase_i == period_i ? now == 15'd0 : now == phase_i) &&
                       (first_us || frame_o) == (now == 15'd0));
      a_same: assert (now == 15'd0 || now > 15'd63
        || ({2'd0, same} + 5'd3 >= (now[4:0] > 5'd8 ? 5'd8 : now[4:0])
            && (now[4:0] < 5'd3 || channel_before == channel_o)));
    end
  end
endmodule

`default_nettype wire
