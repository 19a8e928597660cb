// SPDX-License-Identifier: Apache-2.0
// Properties of the whole path from three sources to the PPI. One step of the proof is a step of
// time: the clocks are free and may stop; frames, requests, time-outs and streams are free too.
// Proved of camera_select, clock_switch, frame_gate and ppi_output together.
`default_nettype none

module stream_switch_properties (
  input wire clk_i,
  input wire rst_i,
  input wire ppi_clock,
  input wire [2:0] clocks,
  input wire gate_rst,
  input wire gate_reset,
  input wire ppi_rst,
  input wire [2:0] select,
  input wire [2:0] asked,
  input wire [2:0] enabled,
  input wire stop,
  input wire ending,
  input wire open,
  input wire cut,
  input wire passing,
  input wire [1:0] active,
  input wire [1:0] state,
  input wire [1:0] settled,
  input wire clock_busy,
  input wire busy_meta,
  input wire passing_here,
  input wire passing_meta,
  input wire cut_here,
  input wire cut_meta,
  input wire [1:0] cut_o,
  input wire [1:0] quiet,
  input wire waiting,
  input wire [1:0] target,
  input wire forcing,
  input wire force_meta,
  input wire force_there,
  input wire forced,
  input wire [35:0] sources,
  input wire [11:0] pins
);
  localparam [1:0] STOP = 2'd1;
  localparam [1:0] CHANGE = 2'd2;

  (* gclk *) wire now;
  reg begun = 1'b0;
  reg clk_before, clock_before, passing_before, open_before, cut_before;
  reg gate_reset_before;
  reg [1:0] active_before, cut_o_before;
  reg [2:0] enabled_before, clocks_before;
  reg [35:0] sources_before;
  wire [2:0] busy = asked | enabled;
  wire [35:0] chosen = sources_before >> (12 * active_before);
  wire launch = !ppi_clock && clock_before;
  wire last_frame_now = launch ? frame : last_frame;
  wire frame = chosen[0];   // of the active source, as this launch edge takes it
  reg last_frame;           // as the launch edge before took it
  reg same_source;          // there was such an edge since the gate was reset
  always @(posedge now) begin
    begun <= 1'b1;
    assume (rst_i == !begun);
    clk_before <= clk_i;
    clock_before <= ppi_clock;
    passing_before <= passing;
    open_before <= open;
    gate_reset_before <= gate_reset;
    cut_before <= cut;
    active_before <= active;
    cut_o_before <= cut_o;
    enabled_before <= enabled;
    clocks_before <= clocks;
    sources_before <= sources;
    if (!begun || gate_rst) same_source <= 1'b0;
    else if (launch) same_source <= 1'b1;
    if (launch) last_frame <= frame;

    if (begun) begin
      // The source.
      a_source_changes_without_a_clock: assert (active == active_before || busy == 3'b000);
      a_clock_is_the_source_s: assert (busy == 3'b000 || busy == (3'b001 << active));
      a_gate_reset_without_a_clock: assert (!gate_reset || busy == 3'b000);
      // The clock never ends inside a frame, except by force on a stopped clock, which is reported.
      a_clock_ends_outside_frames: assert (!(|(enabled_before & ~enabled)) || stop || !open_before);
      // A frame begins on the PPI with its first clock, and ends with its last, or is cut.
      a_begins_with_the_frame: assert (!(passing && !passing_before) ||
                                       (launch && same_source && !last_frame && frame));
      a_ends_with_the_frame_or_cut: assert (!(!passing && passing_before) || gate_rst ||
                                            (launch && (!frame || cut)));
      a_cut_is_told: assert (!(gate_reset && !gate_reset_before && !active[1] &&
                               (passing_before || cut_before)) || cut_o[active[0]]);
      // Of any source, the pattern too.
      a_cut_is_forced: assert (!(gate_reset && !gate_reset_before &&
                                 (passing_before || cut_before)) || forced);
      a_told_only_when_cut: assert (!(|(cut_o & ~cut_o_before)) ||
                                    (gate_reset && (passing_before || cut_before)));
      // The pins are the pins of the source, half a period later, or frame and line are low.
      a_syncs_are_the_source_s: assert (!launch || gate_rst || !pins[0] ||
                                        pins[1:0] == chosen[1:0]);
      // The first pixel of a line may be a tag: see the proof of ppi_output.
      a_data_is_the_source_s: assert (!launch || gate_rst || !pins[1] || !pins_before[1] ||
                                      pins[11:2] == chosen[11:2]);
      a_pins_change_at_launch: assert (launch || gate_rst || pins == pins_before);
      a_no_line_outside_a_frame: assert (!pins[1] || pins[0]);
      // Helps the induction.
      a_waiting: assert (!(waiting && pins[1]));
      a_one_leg: assert (enabled == 3'b000 || enabled == 3'b001 || enabled == 3'b010 ||
        enabled == 3'b100);
      a_select: assert (state == STOP || state == CHANGE ? select == 3'b000
                                                         : select == (3'b001 << active));
      a_active: assert (active != 2'd3 && target != 2'd3);
      a_gate_reset: assert (gate_reset == (state == CHANGE));
      a_settled_1: assert (!(state == STOP && settled == 2'd1 && !busy_meta) || busy == 3'b000);
      a_settled_2: assert (!(state == STOP && settled == 2'd2 && !clock_busy) ||
                           (busy == 3'b000 && passing_meta == passing && cut_meta == cut));
      a_settled_3: assert (!(state == STOP && settled == 2'd3) ||
                           (busy == 3'b000 && passing_meta == passing && cut_meta == cut &&
                            passing_here == passing && cut_here == cut));
      a_off_in_a_change: assert (state != CHANGE || (busy == 3'b000 && !open && !passing));
      a_clock_output: assert (ppi_clock == |(clocks & enabled));
      a_open_between_frames: assert (!(open && !passing) || ((same_source || launch) &&
        !last_frame_now));
      a_force_arrived: assert (forcing || gate_rst ||
        (!((open || quiet != 2'd0) && force_meta) && !((open || quiet[1]) && force_there)));
      a_cut_by_force: assert (!cut || forcing);
      a_left_by_force: assert (!(passing && busy == 3'b000) || forcing);
      a_quiet: assert (quiet == 2'd0 || same_source || launch);
      a_passing_is_open: assert (!passing || open || cut);
    end
    c_first_frame: cover (begun && passing && !passing_before);
    c_change: cover (begun && active == 2'd1 && enabled == 3'b010);
    c_cut: cover (begun && cut_o[0]);
  end
  reg [11:0] pins_before;
  always @(posedge now) pins_before <= pins;
endmodule

`default_nettype wire
