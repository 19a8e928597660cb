// SPDX-License-Identifier: Apache-2.0
// Properties of reset_sync.
`default_nettype none

module reset_sync_properties #(
  parameter STAGES = 4
) (
  input wire clk_i,
  input wire rst_i,
  input wire request_i,
  input wire rst_o,
  input wire [STAGES-1:0] active_i
);
  reg begun = 1'b0;
  reg was, before, requested;
  reg [7:0] quiet;  // edges without reset or request

  always @(posedge clk_i) begin
    if (!begun) assume (rst_i);
    begun <= 1'b1;
    was <= rst_o;
    before <= rst_i;
    requested <= request_i;
    if (rst_i || request_i) quiet <= 8'd0;
    else if (quiet != 8'hFF) quiet <= quiet + 8'd1;
  end

  // Stages empty from the first to the last, one for each quiet edge.
  wire [STAGES-1:0] shall = quiet >= STAGES ? {STAGES{1'b0}} : {STAGES{1'b1}} << quiet;
  always @(posedge clk_i) if (begun) begin
    a_at_once: assert (!rst_i || rst_o);
    a_request: assert (!requested || rst_o);
    a_stages: assert (rst_i || active_i == shall);
    a_lasts: assert (rst_i || quiet >= STAGES || rst_o);
    a_ends: assert (rst_i || quiet < STAGES || !rst_o);
    a_only_asked: assert (rst_i || was || before || requested || !rst_o);
    c_requested: cover (!was && requested);
    c_ends: cover (was && !rst_o);
  end
endmodule

`default_nettype wire
