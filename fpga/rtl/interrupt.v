// SPDX-License-Identifier: Apache-2.0
//
// Interrupt status and line. An event sets its status bit, writing 1 clears it, an event in the
// same clock wins. The line is high while an enabled bit is set.
//
//             ___     ___     ___     ___     ___     ___
// clk_i     _|   |___|   |___|   |___|   |___|   |___|   |__
// event_i   ____|^^^^^^^|__________________________________
// status_o  ____________|^^^^^^^^^^^^^^^^^^^^^^^|__________
// clear_i   ____________________________|^^^^^^^|__________
// line_o    ____________________|^^^^^^^^^^^^^^^^^^^^^^^|__    (enable_i = 1)
//
// SOURCES: number of bits. Latency: status_o 1 clock, line_o 2 clocks (a register: no glitches).

`default_nettype none

module interrupt #(
  parameter SOURCES = 8
) (
  input  wire clk_i,
  input  wire rst_i,
  input  wire [SOURCES-1:0] event_i,
  input  wire [SOURCES-1:0] test_i,
  input  wire [SOURCES-1:0] clear_i,
  input  wire [SOURCES-1:0] enable_i,
  output reg  [SOURCES-1:0] status_o,
  output reg  line_o
);

  always @(posedge clk_i or posedge rst_i) begin
    if (rst_i) begin
      status_o <= {SOURCES{1'b0}};
      line_o <= 1'b0;
    end else begin
      status_o <= (status_o & ~clear_i) | event_i | test_i;
      line_o <= |(status_o & enable_i);
    end
  end

`ifdef FORMAL
  interrupt_properties #(.SOURCES(SOURCES)) properties (
    .clk_i(clk_i), .rst_i(rst_i), .event_i(event_i), .test_i(test_i), .clear_i(clear_i),
    .enable_i(enable_i), .status_o(status_o), .line_o(line_o)
  );
`endif

endmodule

`default_nettype wire
