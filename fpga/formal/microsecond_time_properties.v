// SPDX-License-Identifier: Apache-2.0
// Properties of microsecond_time.
`default_nettype none

module microsecond_time_properties (
  input wire clk_i,
  input wire rst_i,
  input wire tick_us_i,
  input wire [31:0] time_us_o
);
  reg begun = 1'b0;
  reg running, ticked;
  reg [31:0] was;

  always @(posedge clk_i) begin
    if (!begun) assume (rst_i);
    begun <= 1'b1;
    running <= !rst_i;
    ticked <= tick_us_i;
    was <= time_us_o;
  end

  always @(posedge clk_i) if (begun && running && !rst_i) begin
    a_time: assert (time_us_o == was + {31'd0, ticked});
    c_tick: cover (time_us_o == 32'd3);
  end
  always @(posedge clk_i) if (begun && rst_i) begin
    a_reset: assert (time_us_o == 32'd0);
  end
endmodule

`default_nettype wire
