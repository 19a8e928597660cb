// SPDX-License-Identifier: Apache-2.0
//
// Lets whole frames through. It opens and closes only while frame_i is low, so the first frame that
// passes passes from its start and the last one to its end.
//
// clk_i is the inverted PPI clock: frame_i, made at the other edge, has half a period before and
// after.
//
// frame_i     ^^^^^|_____________|^^^^^^^^^^^^^^^^^|_________|^^^^^^^^^^
// request_i   __|^^^^^^^^^^^^^^^^^^^^^^^^^^^|_________________________
// open_o      ___________|^^^^^^^^^^^^^^^^^^^^^^^^^^|___________________
//                  4 low    a whole frame passes
//
// Before opening, frame_i must be low for 4 clocks in a row: a level that has stood since the clock
// stopped proves nothing. abort_i closes at once; cut_o then says that a frame was cut.
// request_i and abort_i are levels in this domain already. Latency: 1 clock.

`default_nettype none

module frame_gate (
  input  wire clk_i,
  input  wire rst_i,
  input  wire request_i,
  input  wire abort_i,
  input  wire frame_i,
`ifdef PROVE_STREAM_SWITCH
  output wire [1:0] quiet_o,
`endif
  output reg  open_o,
  output reg  cut_o
);

  reg [1:0] quiet;
  wire ready = !frame_i && quiet == 2'd3;

  always @(posedge clk_i or posedge rst_i) begin
    if (rst_i) begin
      open_o <= 1'b0;
      cut_o <= 1'b0;
      quiet <= 2'd0;
    end else if (open_o) begin
      quiet <= 2'd0;
      if (abort_i) begin
        open_o <= 1'b0;
        cut_o <= frame_i;
      end else if (!request_i && !frame_i) begin
        open_o <= 1'b0;
      end
    end else begin
      if (frame_i) quiet <= 2'd0;
      else if (quiet != 2'd3) quiet <= quiet + 2'd1;
      if (request_i && !abort_i && ready) begin
        open_o <= 1'b1;
        cut_o <= 1'b0;
      end
    end
  end

`ifdef PROVE_STREAM_SWITCH
  assign quiet_o = quiet;
`endif
`ifdef PROVE_FRAME_GATE
  frame_gate_properties properties (
    .clk_i(clk_i), .rst_i(rst_i), .request_i(request_i), .abort_i(abort_i), .frame_i(frame_i),
    .open_o(open_o), .cut_o(cut_o), .quiet(quiet)
  );
`endif

endmodule

`default_nettype wire
