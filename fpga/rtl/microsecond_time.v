// SPDX-License-Identifier: Apache-2.0
//
// Time since reset in microseconds, wrapping after 71.6 minutes.
//
// tick_us_i  _|^|_____|^|_____|^|____    one clock for each microsecond; may be high for ever
// time_us_o  ==X= n ==|= n+1 =|= n+2     changes at the clock after the tick
//
// Latency: 1 clock.

`default_nettype none

module microsecond_time (
  input  wire clk_i,
  input  wire rst_i,
  input  wire tick_us_i,
  output reg  [31:0] time_us_o
);

  always @(posedge clk_i or posedge rst_i) begin
    if (rst_i) time_us_o <= 32'd0;
    else if (tick_us_i) time_us_o <= time_us_o + 32'd1;
  end

`ifdef FORMAL
  microsecond_time_properties properties (
    .clk_i(clk_i), .rst_i(rst_i), .tick_us_i(tick_us_i), .time_us_o(time_us_o)
  );
`endif

endmodule

`default_nettype wire
