// SPDX-License-Identifier: Apache-2.0
//
// Reset of a board: after configuration, while the clock's source is not locked (at once, needs no
// clock) and while rst_n_i is low for three samples (shorter spikes are nothing). It ends 128
// clocks after the last cause.
//
// locked_i  ________|''''''''''''''''''''''''''''''''''''''''''''
// rst_n_i   ''''''''''''''''''''''''''''''''''|______|'''''''''''
// rst_o     ''''''''''''''''''''''''|___________|''''''''''''''''|__
//                   |<- 128 clocks->|
//
// The one place of the design that relies on what configuration loads into flip-flops: 0.
`default_nettype none

module board_reset (
  input  wire clk_i,
  input  wire locked_i,
  input  wire rst_n_i,
  output wire rst_o
);

  reg [2:0] low = 3'b000;
  reg [6:0] count = 7'd0;
  reg       running = 1'b0;
  wire      unlocked = !locked_i;

  always @(posedge clk_i or posedge unlocked) begin
    if (unlocked) begin
      low <= 3'b000;
      count <= 7'd0;
      running <= 1'b0;
    end else begin
      low <= {low[1:0], !rst_n_i};
      if (&low) begin
        count <= 7'd0;
        running <= 1'b0;
      end else if (!running) begin
        count <= count + 7'd1;
        running <= &count;
      end
    end
  end

  assign rst_o = !running;

endmodule

`default_nettype wire
