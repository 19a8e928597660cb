// SPDX-License-Identifier: Apache-2.0
// What clock_meter promises in the control domain; the slow clock that arrives there is free.
`default_nettype none

module clock_meter_properties (
  input wire clk_i,
  input wire rst_i,
  input wire strobe_i,
  input wire slow,
  input wire [2:0] quiet,
  input wire activity_o,
  input wire lost_o
);
  reg begun = 1'b0;
  reg live, slow_was, was_lost, was_active, was_strobe;
  reg [2:0] strobes;  // since the last change, at most 4
  always @(posedge clk_i) begin
    if (!begun) assume (rst_i);
    begun <= 1'b1;
    live <= !rst_i;
    slow_was <= slow && !rst_i;
    was_lost <= lost_o;
    was_active <= activity_o;
    was_strobe <= strobe_i;
    strobes <= rst_i || activity_o ? 3'd0 : strobes + {2'd0, strobe_i && strobes != 3'd4};
    if (begun && !rst_i) begin
      a_lost_after_four_strobes: assert (lost_o == (strobes == 3'd4));
      a_quiet: assert (quiet == strobes);
      a_activity_is_a_change: assert (!live || activity_o == (slow != slow_was));
    end
    if (begun && live && !rst_i) begin
      a_change_ends_lost: assert (!was_active || !lost_o);
      a_lost_only_by_a_strobe: assert (!(lost_o && !was_lost) || was_strobe);
    end
    if (begun && rst_i) a_reset: assert (!lost_o);
    c_lost: cover (begun && !rst_i && lost_o);
    c_back: cover (begun && live && !rst_i && was_lost && !lost_o);
  end
endmodule

`default_nettype wire
