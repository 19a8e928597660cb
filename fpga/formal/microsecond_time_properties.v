// SPDX-License-Identifier: Apache-2.0
// What microsecond_time promises.
`default_nettype none

module microsecond_time_properties (
  input wire clk_i,
  input wire rst_i,
  input wire tick_us_i,
  input wire [31:0] time_us_o,
  input wire tick_ms_o,
  input wire [9:0] count_i
);
  reg begun = 1'b0;
  reg running, ticked;
  reg [31:0] was;
  reg [9:0] ticks;  // microseconds since the last whole millisecond

  always @(posedge clk_i) begin
    if (!begun) assume (rst_i);
    begun <= 1'b1;
    running <= !rst_i;
    ticked <= tick_us_i;
    was <= time_us_o;
    if (rst_i) ticks <= 10'd0;
    else if (tick_us_i) ticks <= ticks == 10'd999 ? 10'd0 : ticks + 10'd1;
  end

  always @(posedge clk_i) if (begun && running && !rst_i) begin
    a_time: assert (time_us_o == was + {31'd0, ticked});
    a_millisecond: assert (tick_ms_o == (ticked && ticks == 10'd0));
    c_tick: cover (ticked && ticks == 10'd3);
  end
  always @(posedge clk_i) if (begun && !rst_i) begin
    a_count: assert (count_i == ticks && ticks < 10'd1000);
  end
  always @(posedge clk_i) if (begun && rst_i) begin
    a_reset: assert (time_us_o == 32'd0 && !tick_ms_o);
  end
endmodule

`default_nettype wire
