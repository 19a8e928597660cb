// SPDX-License-Identifier: Apache-2.0
//
// Slow ticks for all timers that need no better start, one clock wide.
//
// tick_us_i    _|_|_|_|_|_|_|_|_|_|_|_|_|_    may be high for ever: one clock is then 1 us
// tick_10us_o  _____________________|______    every 10th tick_us_i
// tick_50us_o  every 5th tick_10us_o
// tick_ms_o    one clock after every 20th tick_50us_o
// tick_16ms_o  every 16th tick_ms_o
//
// Latency: none for the first two (each is the input pulse itself), 1 clock for the others.

`default_nettype none

module time_base (
  input  wire clk_i,
  input  wire rst_i,
  input  wire tick_us_i,
  output wire tick_10us_o,
  output wire tick_50us_o,
  output reg  tick_ms_o,
  output wire tick_16ms_o
);

  reg [3:0] tens;
  reg [2:0] fives;
  reg [4:0] twenties;
  reg [3:0] sixteens;

  assign tick_10us_o = tick_us_i && tens == 4'd9;
  assign tick_50us_o = tick_10us_o && fives == 3'd4;
  wire ms_ends = tick_50us_o && twenties == 5'd19;
  assign tick_16ms_o = tick_ms_o && sixteens == 4'd15;

  always @(posedge clk_i or posedge rst_i) begin
    if (rst_i) begin
      tens <= 4'd0;
      fives <= 3'd0;
      twenties <= 5'd0;
      tick_ms_o <= 1'b0;
      sixteens <= 4'd0;
    end else begin
      if (tick_us_i) tens <= tick_10us_o ? 4'd0 : tens + 4'd1;
      if (tick_10us_o) fives <= tick_50us_o ? 3'd0 : fives + 3'd1;
      if (tick_50us_o) twenties <= ms_ends ? 5'd0 : twenties + 5'd1;
      tick_ms_o <= ms_ends;
      if (tick_ms_o) sixteens <= sixteens + 4'd1;
    end
  end

`ifdef PROVE_TIME_BASE
  time_base_properties properties (
    .clk_i(clk_i), .rst_i(rst_i), .tick_us_i(tick_us_i), .tick_ms_o(tick_ms_o),
    .tick_10us_o(tick_10us_o), .tick_50us_o(tick_50us_o), .tick_16ms_o(tick_16ms_o),
    .tens(tens), .fives(fives), .twenties(twenties), .sixteens(sixteens)
  );
`endif

endmodule

`default_nettype wire
