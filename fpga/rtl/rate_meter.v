// SPDX-License-Identifier: Apache-2.0
//
// Pixel clock (kHz) and frame period (10 us) of both cameras, with one counter in turn:
//
// turn      0: clock of 0 | 1: clock of 1 | 2: period of 0 | 3: period of 1 | 0 ...
// mark      ___|_________|_|____________|___|_____________|____   16 ms tick, or start of a frame
// armed     ___|^^^^^^^^^|_|^^^^^^^^^^^^|___|^^^^^^^^^^^^^|____
// counter      counts 16 periods of the pixel clock, or ticks of 10 us, from mark to mark
//
// A round takes 64 ms and up to four frame periods. Where no frame comes for 655.35 ms the period
// reads 65535; both values stay at 65535 and do not wrap. hold_i[n] keeps the values of camera n.
// The first measurement of a turn starts at a mark, so a value is exact to one count.

`default_nettype none

module rate_meter (
  input  wire clk_i,
  input  wire rst_i,
  input  wire tick_10us_i,
  input  wire tick_16ms_i,
  input  wire [1:0] hold_i,
  input  wire [1:0] activity_i,
  input  wire [1:0] start_i,
  output reg  [15:0] clock0_khz_o,
  output reg  [15:0] clock1_khz_o,
  output reg  [15:0] period0_10us_o,
  output reg  [15:0] period1_10us_o
);

  reg [1:0] turn;
  reg armed;
  reg [15:0] count;

  wire camera = turn[0];
  wire periods = turn[1];
  wire full;                           // the carry out of the counter
  wire [15:0] count_next;
  assign {full, count_next} = {1'b0, count} + 17'd1;
  wire mark = periods ? start_i[camera] : tick_16ms_i;
  wire step = periods ? tick_10us_i : activity_i[camera];
  // A camera without frames must not stop the round; a frame that never starts counts like one
  // that never ends.
  wire done = (armed && mark) || (periods && full);
  wire store = done && !hold_i[camera];

  always @(posedge clk_i or posedge rst_i) begin
    if (rst_i) begin
      turn <= 2'd0;
      armed <= 1'b0;
      count <= 16'd0;
      clock0_khz_o <= 16'd0;
      clock1_khz_o <= 16'd0;
      period0_10us_o <= 16'd0;
      period1_10us_o <= 16'd0;
    end else begin
      if (done) turn <= turn + 2'd1;
      armed <= !done && (armed || mark);
      if (done || mark) count <= 16'd0;
      else if (step && !full) count <= count_next;
      if (store) begin
        case (turn)
          2'd0: clock0_khz_o <= count;
          2'd1: clock1_khz_o <= count;
          2'd2: period0_10us_o <= count;
          2'd3: period1_10us_o <= count;
        endcase
      end
    end
  end

`ifdef PROVE_RATE_METER
  rate_meter_properties properties (
    .clk_i(clk_i), .rst_i(rst_i), .tick_10us_i(tick_10us_i), .tick_16ms_i(tick_16ms_i),
    .hold_i(hold_i), .activity_i(activity_i), .start_i(start_i), .clock0_khz_o(clock0_khz_o),
    .clock1_khz_o(clock1_khz_o), .period0_10us_o(period0_10us_o), .period1_10us_o(period1_10us_o),
    .turn(turn), .armed(armed), .count(count)
  );
`endif

endmodule

`default_nettype wire
