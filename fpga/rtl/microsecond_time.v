// SPDX-License-Identifier: Apache-2.0
//
// Time since reset in microseconds, wrapping after 71.6 minutes, and a tick for all timers that
// count milliseconds.
//
// tick_us_i  _|^|_____|^|_____|^|____    one clock for each microsecond; may be high for ever
// time_us_o  ==X= n ==|= n+1 =|= n+2     changes at the clock after the tick
// tick_ms_o  _________________|^|____    one clock after each 1000th tick
//
// Latency: 1 clock.

`default_nettype none

module microsecond_time (
  input  wire clk_i,
  input  wire rst_i,
  input  wire tick_us_i,
  output reg  [31:0] time_us_o,
  output reg  tick_ms_o
);

  always @(posedge clk_i or posedge rst_i) begin
    if (rst_i) time_us_o <= 32'd0;
    else if (tick_us_i) time_us_o <= time_us_o + 32'd1;
  end

  reg [9:0] count;
  always @(posedge clk_i or posedge rst_i) begin
    if (rst_i) begin
      count <= 10'd0;
      tick_ms_o <= 1'b0;
    end else begin
      tick_ms_o <= tick_us_i && count == 10'd999;
      if (tick_us_i) count <= count == 10'd999 ? 10'd0 : count + 10'd1;
    end
  end

`ifdef FORMAL
  microsecond_time_properties properties (
    .clk_i(clk_i), .rst_i(rst_i), .tick_us_i(tick_us_i), .time_us_o(time_us_o),
    .tick_ms_o(tick_ms_o), .count_i(count)
  );
`endif

endmodule

`default_nettype wire
