// SPDX-License-Identifier: Apache-2.0
//
// One leg of clock_switch: lets a clock through in whole periods.
//
//             ___     ___     ___     ___     ___     ___     ___
// clk_i     _|   |___|   |___|   |___|   |___|   |___|   |___|   |__
// want_i    ___|^^^^^^^^^^^^^^^^^^^^^^^^^^^^^|________________________
// asked     _____|^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^|____________________   falling edges
// enabled   _____________|^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^|____________
//                          ___     ___     ___     ___
// clk_o     ______________|   |___|   |___|   |___|   |____________
//
// hold_i keeps the clock running (it changes at falling edges of clk_o): a frame is not left without
// a clock. stop_i clears at once, without any edge; only for a clock that stands still.
// Latency: 1 to 2 falling edges, then the next rising edge.

`default_nettype none

module clock_gate (
  input  wire clk_i,
  input  wire rst_i,
  input  wire stop_i,
  input  wire want_i,
  input  wire hold_i,
  output wire busy_o,
  output wire clk_o
);

  wire clear = rst_i || stop_i;

  (* ASYNC_REG = "TRUE", keep *) reg asked;
  (* ASYNC_REG = "TRUE", keep *) reg enabled;
  always @(negedge clk_i or posedge clear) begin
    if (clear) begin
      asked <= 1'b0;
      enabled <= 1'b0;
    end else begin
      asked <= want_i;
      enabled <= asked || (enabled && hold_i);
    end
  end

  assign busy_o = asked || enabled;
  assign clk_o = clk_i && enabled;

endmodule

`default_nettype wire
