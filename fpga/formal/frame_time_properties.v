// SPDX-License-Identifier: Apache-2.0
// Properties of frame_time. Starts, ticks and time are free.
`default_nettype none

module frame_time_properties (
  input wire clk_i,
  input wire rst_i,
  input wire tick_us_i,
  input wire [31:0] time_us_i,
  input wire ppi_start_i,
  input wire start_left_i,
  input wire start_right_i,
  input wire [15:0] skew_us_o,
  input wire [31:0] frame_time_o,
  input wire [14:0] since,
  input wire last_right,
  input wire passed_over,
  input wire [14:0] distance,
  input wire left_later
);
  reg begun = 1'b0;
  reg live, had_ppi, had_left, had_right, had_last_right, had_passed_over;
  reg [31:0] had_time, had_frame_time;
  reg [14:0] ticks, had_ticks, had_distance;   // since the last start of any camera
  reg [15:0] had_skew;
  wire [15:0] plus = {1'b0, had_ticks};
  wire [15:0] minus = 16'd0 - {1'b0, had_ticks};
  always @(posedge clk_i) begin
    if (!begun) assume (rst_i);
    begun <= 1'b1;
    live <= !rst_i;
    had_ppi <= ppi_start_i;
    had_left <= start_left_i;
    had_right <= start_right_i;
    had_last_right <= last_right;
    had_passed_over <= passed_over;
    had_time <= time_us_i;
    had_frame_time <= frame_time_o;
    had_skew <= skew_us_o;
    had_ticks <= ticks;
    had_distance <= distance;
    ticks <= rst_i || start_left_i || start_right_i ? 15'd0
             : ticks + {14'd0, tick_us_i && ticks != 15'h7FFF};
    if (begun && live && !rst_i) begin
      a_frame_time: assert (frame_time_o == (had_ppi ? had_time : had_frame_time));
      a_both_is_zero: assert (!(had_left && had_right) || skew_us_o == 16'd0);
      a_right_after_left: assert (!(had_right && !had_left) || skew_us_o == had_skew ||
                                  (skew_us_o == plus && !had_last_right));
      a_left_after_right: assert (!(had_left && !had_right) || skew_us_o == had_skew ||
                                  (skew_us_o == minus && had_last_right));
      a_still_without_starts: assert (had_left || had_right || skew_us_o == had_skew);
      a_smaller_is_taken: assert (!(had_left != had_right && had_left == had_last_right &&
        had_ticks <= had_distance) || skew_us_o == (had_left ? minus : plus));
      a_second_is_taken: assert (!(had_left != had_right && had_left == had_last_right &&
        had_passed_over) || skew_us_o == (had_left ? minus : plus));
      a_larger_is_passed_over: assert (!(had_left != had_right && had_left == had_last_right &&
        had_ticks > had_distance && !had_passed_over) || (skew_us_o == had_skew && passed_over));
    end
    if (begun && !rst_i) begin
      a_since: assert (since == ticks);
      a_sign: assert (distance == 15'd0 || skew_us_o[15] == left_later);
    end
    if (begun && rst_i) a_reset: assert (skew_us_o == 16'd0 && frame_time_o == 32'd0);
    c_negative: cover (begun && !rst_i && skew_us_o == 16'hFFFD);
    c_positive: cover (begun && !rst_i && skew_us_o == 16'd2);
  end
endmodule

`default_nettype wire
