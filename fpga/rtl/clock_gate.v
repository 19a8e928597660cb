// SPDX-License-Identifier: Apache-2.0
//
// One leg of clock_switch: lets a clock through in whole periods.
//
//             ___     ___     ___     ___     ___     ___     ___
// clk_i     _|   |___|   |___|   |___|   |___|   |___|   |___|   |__
// want_i    ___|^^^^^^^^^^^^^^^^^^^^^^^^^^^^^|________________________
// asked_o   _____|^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^|____________________   falling edges
// enabled_o _____________|^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^|____________
//                          ___     ___     ___     ___
// clk_o     ______________|   |___|   |___|   |___|   |____________
//
// hold_i keeps the clock running (it changes at falling edges of clk_o): a frame is not left
// without a clock. stop_i clears at once, without any edge; only for a stopped clock.
// Latency: 1 to 2 falling edges, then the next rising edge.

`default_nettype none

module clock_gate (
  input  wire clk_i,
  input  wire rst_i,
  input  wire stop_i,
  input  wire want_i,
  input  wire hold_i,
  (* ASYNC_REG = "TRUE" *) output reg  asked_o,
  (* ASYNC_REG = "TRUE" *) output reg  enabled_o,
  output wire clk_o
);

  wire clear = rst_i || stop_i;

  always @(negedge clk_i or posedge clear) begin
    if (clear) begin
      asked_o <= 1'b0;
      enabled_o <= 1'b0;
    end else begin
      asked_o <= want_i;
      enabled_o <= asked_o || (enabled_o && hold_i);
    end
  end

  assign clk_o = clk_i && enabled_o;

endmodule

`default_nettype wire
