// SPDX-License-Identifier: Apache-2.0
//
// From three sources to the PPI: one clock, whole frames.
//
//   camera_select --select--> clock_switch --> ppi_clock_o
//        |   ^                     |  ^
//      gate  open              (clock) hold
//        v   |                     v  |
//   sources --> mux --> frame_gate, ppi_output --> ppi pins
//
// clk_i         control domain: camera_select
// launch_clock  the inverted PPI clock: frame_gate, ppi_output; the clock ends at the same edges
//
// The gate holds the clock while it is open, in the same clock domain and without any crossing;
// that alone makes it impossible to leave a source inside a frame, but by force. A frame that is
// cut by force is reported by cut_o, one bit per camera, until the next frame of that camera; a
// cut frame of the pattern, like every other, by forced_o.

`default_nettype none

module stream_switch #(
  parameter STUCK = 5
) (
  input  wire clk_i,
  input  wire rst_i,
  input  wire tick_us_i,
  input  wire tick_ms_i,
  input  wire stream_i,
  input  wire [1:0] request_i,
  input  wire alternating_i,
  input  wire [6:0] frames_each_i,
  input  wire [7:0] timeout_ms_i,
  input  wire first_line_i,
  input  wire tag_i,
  input  wire [1:0] lost_i,
  input  wire clock0_i,
  input  wire [9:0] data0_i,
  input  wire line0_i,
  input  wire frame0_i,
  input  wire clock1_i,
  input  wire [9:0] data1_i,
  input  wire line1_i,
  input  wire frame1_i,
  input  wire [9:0] pattern_data_i,
  input  wire pattern_line_i,
  input  wire pattern_frame_i,
  output wire [1:0] active_o,
  output wire gate_open_o,
  output wire switching_o,
  output wire forced_o,
  output reg  [1:0] cut_o,
  output wire switched_o,
  output wire timed_out_o,
  output wire frame_start_o,
  output wire ppi_clock_o,
  output wire [9:0] ppi_data_o,
  output wire ppi_line_o,
  output wire ppi_frame_o
);

  wire [2:0] select;
  wire gate;
  wire gate_reset;
  wire forcing;
  wire ending;
  wire clock_busy;
  wire open;
  wire cut;
  wire passing;

`ifdef PROVE_STREAM_SWITCH
  wire [1:0] state;
  wire [1:0] settled;
  wire [1:0] target;
  wire [2:0] asked;
  wire [2:0] enabled;
  wire stop;
  wire busy_meta;
  wire passing_meta;
  wire cut_meta;
  wire force_meta;
  wire [1:0] quiet;
  wire waiting;
`endif

  camera_select selector (
    .clk_i(clk_i),
    .rst_i(rst_i),
    .tick_ms_i(tick_ms_i),
    .stream_i(stream_i),
    .request_i(request_i),
    .alternating_i(alternating_i),
    .frames_each_i(frames_each_i),
    .timeout_ms_i(timeout_ms_i),
    .lost_i(lost_i),
    .clock_busy_i(clock_busy),
    .gate_open_i(gate_open_o),
    .frame_start_i(frame_start_o),
`ifdef PROVE_STREAM_SWITCH
    .state_o(state),
    .settled_o(settled),
    .target_o(target),
`endif
    .active_o(active_o),
    .select_o(select),
    .gate_o(gate),
    .gate_reset_o(gate_reset),
    .force_o(forcing),
    .switching_o(switching_o),
    .forced_o(forced_o),
    .ending_o(ending),
    .switched_o(switched_o),
    .timed_out_o(timed_out_o)
  );

  clock_switch #(.STUCK(STUCK)) clocks (
    .clk_i(clk_i),
    .rst_i(rst_i),
    .tick_us_i(tick_us_i),
    .select_i(select),
    .hold_i(open),
    .force_i(forcing),
    .clock0_i(clock0_i),
    .clock1_i(clock1_i),
    .clock2_i(clk_i),
`ifdef PROVE_STREAM_SWITCH
    .legs_asked_o(asked),
    .legs_enabled_o(enabled),
    .stop_o(stop),
    .busy_meta_o(busy_meta),
`endif
    .busy_o(clock_busy),
    .clock_o(ppi_clock_o)
  );

  // The source changes only while no clock runs.
  wire pattern = active_o[1];
  wire right = active_o[0];
  wire [9:0] data = pattern ? pattern_data_i : right ? data1_i : data0_i;
  wire line = pattern ? pattern_line_i : right ? line1_i : line0_i;
  wire frame = pattern ? pattern_frame_i : right ? frame1_i : frame0_i;

  wire launch_clock = !ppi_clock_o;
  wire ppi_rst;
  reset_sync #(.STAGES(2)) ppi_reset (
    .clk_i(launch_clock),
    .rst_i(rst_i),
    .request_i(1'b0),
    .rst_o(ppi_rst)
  );
  wire gate_rst = ppi_rst || gate_reset;

  wire gate_there;
  sync_bit gate_level (
    .clk_i(launch_clock), .rst_i(ppi_rst), .level_i(gate), .level_o(gate_there)
  );
  wire force_there;
  sync_bit force_level (
`ifdef PROVE_STREAM_SWITCH
    .meta_o(force_meta),
`endif
    .clk_i(launch_clock), .rst_i(ppi_rst), .level_i(forcing), .level_o(force_there)
  );

  frame_gate gate_of_frames (
    .clk_i(launch_clock),
    .rst_i(gate_rst),
    .request_i(gate_there),
    .abort_i(force_there),
    .frame_i(frame),
`ifdef PROVE_STREAM_SWITCH
    .quiet_o(quiet),
`endif
    .open_o(open),
    .cut_o(cut)
  );

  ppi_output pins (
    .clk_i(launch_clock),
    .rst_i(gate_rst),
    .counter_rst_i(ppi_rst),
    .first_line_i(first_line_i),
    .tag_i(tag_i),
    .source_i(active_o),
    .open_i(open),
    .data_i(data),
    .line_i(line),
    .frame_i(frame),
    .data_o(ppi_data_o),
    .line_o(ppi_line_o),
    .frame_o(ppi_frame_o),
`ifdef PROVE_STREAM_SWITCH
    .waiting_o(waiting),
`endif
    .passing_o(passing)
  );

  wire passing_here;
  wire cut_here;
  sync_bit open_level (
    .clk_i(clk_i), .rst_i(rst_i), .level_i(open), .level_o(gate_open_o)
  );
  sync_bit passing_level (
`ifdef PROVE_STREAM_SWITCH
    .meta_o(passing_meta),
`endif
    .clk_i(clk_i), .rst_i(rst_i), .level_i(passing), .level_o(passing_here)
  );
  sync_bit cut_level (
`ifdef PROVE_STREAM_SWITCH
    .meta_o(cut_meta),
`endif
    .clk_i(clk_i), .rst_i(rst_i), .level_i(cut), .level_o(cut_here)
  );

  reg passing_before;
  assign frame_start_o = passing_here && !passing_before;

  // At the end the clock has been stopped long enough for both levels to have arrived.
  wire broken = ending && (passing_here || cut_here);
  always @(posedge clk_i or posedge rst_i) begin
    if (rst_i) begin
      passing_before <= 1'b0;
      cut_o <= 2'b00;
    end else begin
      passing_before <= passing_here;
      if (!pattern && broken) cut_o[right] <= 1'b1;
      else if (!pattern && frame_start_o) cut_o[right] <= 1'b0;
    end
  end

`ifdef PROVE_STREAM_SWITCH
  stream_switch_properties properties (
    .clk_i(clk_i), .rst_i(rst_i), .ppi_clock(ppi_clock_o), .clocks({clk_i, clock1_i, clock0_i}),
    .gate_rst(gate_rst), .gate_reset(gate_reset), .ppi_rst(ppi_rst), .select(select),
    .asked(asked), .enabled(enabled), .stop(stop), .ending(ending), .open(open), .cut(cut),
    .passing(passing), .active(active_o), .state(state), .settled(settled),
    .clock_busy(clock_busy), .busy_meta(busy_meta), .passing_here(passing_here),
    .passing_meta(passing_meta), .cut_here(cut_here), .cut_meta(cut_meta), .cut_o(cut_o),
    .quiet(quiet), .waiting(waiting), .target(target), .forcing(forcing),
    .force_meta(force_meta), .force_there(force_there), .forced(forced_o),
    .sources({pattern_data_i, pattern_line_i, pattern_frame_i, data1_i, line1_i, frame1_i,
              data0_i, line0_i, frame0_i}),
    .pins({ppi_data_o, ppi_line_o, passing})
  );
`endif

endmodule

`default_nettype wire
