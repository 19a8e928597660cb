// SPDX-License-Identifier: Apache-2.0
// Properties of frame_gate. Request, abort and frames are free; reset may come at any time.
`default_nettype none

module frame_gate_properties (
  input wire clk_i,
  input wire rst_i,
  input wire request_i,
  input wire abort_i,
  input wire frame_i,
  input wire open_o,
  input wire cut_o,
  input wire [1:0] quiet
);
  reg begun = 1'b0;
  reg live;            // the clock before was no reset
  reg was_open, was_requested, was_aborted, was_frame, was_cut;
  reg [2:0] low_clocks;  // clocks in a row with frame_i low before this one, while closed
  reg passing;         // a frame is passing, from its first clock on
  always @(posedge clk_i) begin
    if (!begun) assume (rst_i);
    begun <= 1'b1;
    live <= !rst_i;
    was_open <= open_o;
    was_requested <= request_i;
    was_aborted <= abort_i;
    was_frame <= frame_i;
    was_cut <= cut_o;
    low_clocks <= rst_i || frame_i || open_o ? 3'd0 : low_clocks == 3'd4 ? 3'd4 : low_clocks + 3'd1;
    passing <= !rst_i && open_o && frame_i && (passing || !was_frame || !was_open);

    if (begun && live && !rst_i) begin
      a_opens_outside_a_frame: assert (!(open_o && !was_open) || !was_frame);
      a_opens_after_quiet: assert (!(open_o && !was_open) || low_clocks == 3'd4);
      a_opens_on_request: assert (!(open_o && !was_open) || (was_requested && !was_aborted));
      a_closes_outside_a_frame: assert (!(!open_o && was_open) || !was_frame || was_aborted);
      a_closes_on_request: assert (!(!open_o && was_open) || !was_requested || was_aborted);
      a_closes_at_once: assert (!(was_open && !was_requested && !was_frame) || !open_o);
      a_abort_closes: assert (!(was_open && was_aborted) || !open_o);
      // A frame that passes did so from its first clock on, and passes to its end or is cut.
      a_whole_from_the_start: assert (!(open_o && frame_i && was_frame) || passing);
      a_whole_to_the_end_or_cut: assert (!(passing && was_frame && frame_i && !open_o) || cut_o);
      a_cut_only_in_a_frame: assert (!(cut_o && !was_cut) || (was_open && was_frame &&
        was_aborted));
      a_cut_is_told: assert (!(was_open && was_frame && !open_o) || cut_o);
      a_cut_stays: assert (!(was_cut && !cut_o) || (open_o && !was_open));
    end
    if (begun && !rst_i) begin
      // Helps the induction.
      a_quiet: assert (open_o || low_clocks == 3'd4 || low_clocks == {1'b0, quiet});
      a_quiet_full: assert (open_o || low_clocks != 3'd4 || quiet == 2'd3);
      a_never_open_while_cut: assert (!(open_o && cut_o));
    end
    c_frame_passes: cover (begun && live && !rst_i && open_o && !frame_i && passing);
    c_cut: cover (begun && !rst_i && cut_o);
    c_closes: cover (begun && live && !rst_i && was_open && !open_o && !was_aborted);
  end
endmodule

`default_nettype wire
