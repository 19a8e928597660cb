// SPDX-License-Identifier: Apache-2.0
//
// Decides which source feeds the PPI, and leads each change: end of frame, clock off, other source,
// clock on, start of frame.
//
// request_i     == left =X= right ==================================
// state         = IDLE ==X= STOP =========X= CHANGE =X= START ===X= IDLE
// gate_o        ^^^^^^^^^|___________________________|^^^^^^^^^^^^^^^^^^
// select_o      == 001 ==X= 000 =====================X= 010 ==========
// clock_busy_i  ^^^^^^^^^^^^^^^^^^^^^|____________________|^^^^^^^^^^^^^^   low: it ended
// gate_reset_o  _____________________________|^^^^^^^^^|_______________
// active_o      == left =============================X= right ========
// switched_o    ____________________________________________|^|_______
//
// STOP waits for the clock to end, which clock_switch delays while a frame passes; when
// timeout_ms_i is over, or the source's clock is lost, force_o cuts. START waits for the gate to
// open, and gives up after timeout_ms_i or when the new source is lost too: then the source stays
// selected and resumes when its clock comes back. timed_out_o: a wait was given up.
// forced_o: the last change was forced. The gate itself is reset while no clock runs, so it is
// closed for sure when the next clock starts. With alternating_i the cameras change after
// frames_each_i frames (0 counts as 1), and away from a lost camera, but not to one.
// Both waits are at most timeout_ms_i milliseconds, after force_o a little more (clock_switch).

`default_nettype none

module camera_select (
  input  wire clk_i,
  input  wire rst_i,
  input  wire tick_ms_i,
  input  wire stream_i,
  input  wire [1:0] request_i,
  input  wire alternating_i,
  input  wire [6:0] frames_each_i,
  input  wire [7:0] timeout_ms_i,
  input  wire [1:0] lost_i,
  input  wire clock_busy_i,
  input  wire gate_open_i,
  input  wire frame_start_i,
`ifdef PROVE_STREAM_SWITCH
  output wire [1:0] state_o,
  output wire [1:0] settled_o,
  output wire [1:0] target_o,
`endif
  output reg  [1:0] active_o,
  output reg  [2:0] select_o,
  output reg  gate_o,
  output reg  gate_reset_o,
  output reg  force_o,
  output wire switching_o,
  output reg  forced_o,
  output wire ending_o,
  output wire switched_o,
  output wire timed_out_o
);

  localparam [1:0] IDLE = 2'd0;
  localparam [1:0] STOP = 2'd1;
  localparam [1:0] CHANGE = 2'd2;
  localparam [1:0] START = 2'd3;
  localparam [1:0] PATTERN = 2'd2;

  reg [1:0] state;
  reg [1:0] target;
  reg [8:0] wait_ms;    // -what is left; the highest bit is 1 when nothing is
  reg [1:0] settled;
  reg [7:0] remaining;  // likewise

  wire active_lost = active_o == 2'd0 && lost_i[0] || active_o == 2'd1 && lost_i[1];
  wire other_lost = active_o == 2'd0 && lost_i[1] || active_o == 2'd1 && lost_i[0];
  wire due = (remaining[7] || active_lost) && !other_lost;

  reg [1:0] wanted;
  always @* begin
    if (!alternating_i) wanted = request_i[1] ? PATTERN : request_i;
    else if (active_o[1]) wanted = 2'd0;
    else wanted = {1'b0, active_o[0] ^ due};
  end

  // A wait begins with the next clock: for the end of a frame, or for the start of one.
  wire begins = state == IDLE || state == CHANGE;
  wire [6:0] frames = {frames_each_i[6:1], frames_each_i[0] || frames_each_i == 7'd0};
  wire expired = wait_ms[8];
  wire stopped = !clock_busy_i && settled == 2'd3;
  wire started = stream_i ? gate_open_i : clock_busy_i;
  wire give_up = expired || active_lost;

  assign switching_o = state != IDLE;
  assign ending_o = state == STOP && stopped;
  assign switched_o = state == START && started;
  assign timed_out_o = (state == START && !started && give_up)
                    || (state == STOP && !force_o && give_up && !stopped);

  always @(posedge clk_i or posedge rst_i) begin
    if (rst_i) begin
      state <= IDLE;
      active_o <= 2'd0;
      target <= 2'd0;
      select_o <= 3'b001;
      gate_o <= 1'b0;
      gate_reset_o <= 1'b0;
      force_o <= 1'b0;
      forced_o <= 1'b0;
      wait_ms <= 9'h100;
      settled <= 2'd0;
      remaining <= 8'h7F;
    end else begin
      if (state == CHANGE || (frame_start_i && !remaining[7])) begin
        remaining <= (state == CHANGE ? {1'b0, ~frames} : remaining) + 8'd1;
      end
      if (begins || (tick_ms_i && !expired)) begin
        wait_ms <= (begins ? {1'b0, ~timeout_ms_i} : wait_ms) + 9'd1;
      end
      case (state)
        IDLE: begin
          gate_o <= stream_i;
          settled <= 2'd0;
          if (wanted != active_o) begin
            state <= STOP;
            target <= wanted;
            gate_o <= 1'b0;
            select_o <= 3'b000;
          end
        end
        STOP: begin
          settled <= clock_busy_i ? 2'd0 : settled == 2'd3 ? 2'd3 : settled + 2'd1;
          if (stopped) begin
            state <= CHANGE;
            gate_reset_o <= 1'b1;
            forced_o <= force_o;
          end else if (give_up) begin
            force_o <= 1'b1;
          end
        end
        CHANGE: begin
          state <= START;
          gate_reset_o <= 1'b0;
          force_o <= 1'b0;
          active_o <= target;
          select_o <= {target[1], target == 2'd1, target == 2'd0};
          gate_o <= stream_i;
        end
        START: begin
          gate_o <= stream_i;
          if (started || give_up) state <= IDLE;
        end
      endcase
    end
  end

`ifdef PROVE_STREAM_SWITCH
  assign state_o = state;
  assign settled_o = settled;
  assign target_o = target;
`endif
`ifdef PROVE_CAMERA_SELECT
  camera_select_properties properties (
    .clk_i(clk_i), .rst_i(rst_i), .tick_ms_i(tick_ms_i), .stream_i(stream_i),
    .request_i(request_i), .alternating_i(alternating_i), .frames_each_i(frames_each_i),
    .timeout_ms_i(timeout_ms_i), .lost_i(lost_i), .clock_busy_i(clock_busy_i),
    .gate_open_i(gate_open_i), .frame_start_i(frame_start_i), .active_o(active_o),
    .select_o(select_o), .gate_o(gate_o), .gate_reset_o(gate_reset_o), .force_o(force_o),
    .switching_o(switching_o), .forced_o(forced_o), .ending_o(ending_o),
    .switched_o(switched_o), .timed_out_o(timed_out_o), .state(state), .target(target),
    .wait_ms(wait_ms), .settled(settled), .remaining(remaining), .wanted(wanted)
  );
`endif

endmodule

`default_nettype wire
