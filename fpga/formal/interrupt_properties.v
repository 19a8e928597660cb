// SPDX-License-Identifier: Apache-2.0
// Properties of interrupt, per bit: of the bit `any`, chosen by the solver.
`default_nettype none

module interrupt_properties #(
  parameter SOURCES = 8
) (
  input wire clk_i,
  input wire rst_i,
  input wire [SOURCES-1:0] event_i,
  input wire [SOURCES-1:0] test_i,
  input wire [SOURCES-1:0] clear_i,
  input wire [SOURCES-1:0] enable_i,
  input wire [SOURCES-1:0] status_o,
  input wire line_o
);
  (* anyconst *) wire [2:0] any;
  reg begun = 1'b0;
  reg running;   // no reset now and none at the edge before
  reg occurred, tested, cleared, was;
  reg line_due;

  always @(posedge clk_i) begin
    if (!begun) assume (rst_i);
    assume (any < SOURCES);
    begun <= 1'b1;
    running <= !rst_i;
    occurred <= event_i[any];
    tested <= test_i[any];
    cleared <= clear_i[any];
    was <= status_o[any];
    line_due <= |(status_o & enable_i);
  end

  always @(posedge clk_i) if (begun && running && !rst_i) begin
    a_event_is_kept: assert (!occurred || status_o[any]);
    a_test_is_kept: assert (!tested || status_o[any]);
    a_never_lost: assert (!was || cleared || status_o[any]);
    a_cleared: assert (!cleared || occurred || tested || !status_o[any]);
    a_never_from_nothing: assert (was || occurred || tested || !status_o[any]);
    a_line: assert (line_o == line_due);
    c_line: cover (line_o);
    c_event_wins: cover (cleared && occurred);
    c_clear: cover (was && cleared && !status_o[any]);
  end
  always @(posedge clk_i) if (begun && rst_i) begin
    a_reset: assert (status_o == {SOURCES{1'b0}} && !line_o);
  end
endmodule

`default_nettype wire
