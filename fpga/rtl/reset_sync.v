// SPDX-License-Identifier: Apache-2.0
//
// Reset of one clock domain: begins at once, ends at an edge of the domain's clock.
//
//             ___     ___     ___     ___     ___     ___     ___
// clk_i     _|   |___|   |___|   |___|   |___|   |___|   |___|   |__
//              ________
// rst_i     __|        |___________________________________________
//              ___________________________________
// rst_o     __|                                   |________________
//
// request_i, a pulse in the domain of clk_i, makes the same reset from the next edge on; it may
// come from a register that rst_o itself clears.
// STAGES: edges of clk_i from the end of rst_i to the end of rst_o, at least 2.

`default_nettype none

module reset_sync #(
  parameter STAGES = 4
) (
  input  wire clk_i,
  input  wire rst_i,
  input  wire request_i,
  output wire rst_o
);

  (* ASYNC_REG = "TRUE", keep *) reg [STAGES-1:0] active;

  always @(posedge clk_i or posedge rst_i) begin
    if (rst_i) active <= {STAGES{1'b1}};
    else if (request_i) active <= {STAGES{1'b1}};
    else active <= {active[STAGES-2:0], 1'b0};
  end

  assign rst_o = active[STAGES-1];

`ifdef PROVE_RESET_SYNC
  reset_sync_properties #(.STAGES(STAGES)) properties (
    .clk_i(clk_i), .rst_i(rst_i), .request_i(request_i), .rst_o(rst_o), .active_i(active)
  );
`endif

endmodule

`default_nettype wire
