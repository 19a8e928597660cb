// SPDX-License-Identifier: Apache-2.0
// The logic in sensor_bus around the router: a filter for each line of the branches, and the
// events. The router's outputs are free here; the router has its own proof.
`default_nettype none

module sensor_bus_properties (
  input wire       clk_i,
  input wire       rst_i,
  input wire [3:0] lines_i,          // of the pins
  input wire [3:0] levels_i,         // as filtered
  input wire [1:0] clearing_i,
  input wire       clearing_o,
  input wire       error_i,
  input wire       stretch_i,
  input wire       timeout_i,
  input wire       event_o
);
  // The lines at the last five edges: two for the synchroniser, three samples that agree.
  reg [3:0] at1, at2, at3, at4, at5;
  reg [3:0] levels;
  reg [2:0] running = 3'd0;           // edges since the reset, up to 5
  wire [3:0] high = at3 & at4 & at5;
  wire [3:0] low = ~at3 & ~at4 & ~at5;
  reg begun = 1'b0;
  always @(posedge clk_i) begin
    if (!begun) assume (rst_i);
    begun <= 1'b1;
    running <= rst_i ? 3'd0 : running == 3'd6 ? 3'd6 : running + 3'd1;
    {at5, at4, at3, at2, at1} <= {at4, at3, at2, at1, lines_i};
    levels <= levels_i;
    if (begun && !rst_i) begin
      if (running == 3'd6) begin
        a_rises: assert ((levels_i & ~levels & ~high) == 4'd0);
        a_falls: assert ((~levels_i & levels & ~low) == 4'd0);
        a_follows: assert ((high & ~levels_i) == 4'd0 && (low & levels_i) == 4'd0);
      end
      a_idle: assert (running != 3'd0 || levels_i == 4'hF);
      a_clearing: assert (clearing_o == (clearing_i != 2'd0));
      a_event: assert (event_o == (error_i || stretch_i || timeout_i));
      c_low: cover (levels_i == 4'h5 && running == 3'd6);
    end
  end
endmodule

`default_nettype wire
