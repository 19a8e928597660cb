// SPDX-License-Identifier: Apache-2.0
// Trigger (or restart) pulse to one or both cameras, in the same clock.
//
//   fire_i      _|'|______________________________________
//   tick_us_i   ___|'|___|'|___|'|___|'|___|'|___|'|______
//   busy_o      __|''''''''''''''''''''''''''''''|_________
//   trigger_o   _________________|'''''''''''''''|_________   delay 2, width 3 (here 3 ticks)
//   done_o      _________________________________|'|_______
//
// The pulse starts with the first tick after delay_us_i further ones and lasts width_us_i ticks
// exactly (not 0: the register map refuses it). Delay is read with the start, width
// when the pulse starts. A start while busy is ignored.
//
// One counter goes up from what is to be counted, made negative, until its sign changes.
// Latency: two clocks after the tick.
`default_nettype none

module trigger (
  input  wire        clk_i,
  input  wire        rst_i,
  input  wire        tick_us_i,
  input  wire [1:0]  fire_i,        // which cameras; not 0 for one clock
  input  wire [15:0] delay_us_i,
  input  wire [15:0] width_us_i,
  output wire [1:0]  trigger_o,
  output wire        busy_o,
  output wire        done_o
);
  reg [16:0] count;                 // -what is left; the highest bit is 1 when nothing is
  reg [1:0]  cameras;
  reg [1:0]  lines;
  reg        waiting;
  reg        pulsing;
  reg        done;

  wire idle = !waiting && !pulsing;
  wire accept = (fire_i != 2'd0) && idle;
  wire end_wait = waiting && tick_us_i && count[16];
  wire end_pulse = pulsing && count[16];
  wire load = idle || end_wait;
  wire [15:0] length = waiting ? width_us_i : delay_us_i;

  always @(posedge clk_i or posedge rst_i) begin
    if (rst_i) begin
      count <= 17'd0;
      cameras <= 2'd0;
      lines <= 2'd0;
      waiting <= 1'b0;
      pulsing <= 1'b0;
      done <= 1'b0;
    end else begin
      done <= end_pulse;
      waiting <= accept || (waiting && !end_wait);
      pulsing <= end_wait || (pulsing && !end_pulse);
      lines <= pulsing && !end_pulse ? cameras : 2'd0;
      if (accept) begin
        cameras <= fire_i;
      end
      if (load || tick_us_i) begin
        count <= (load ? {1'b0, ~length} : count) + 17'd1;
      end
    end
  end

  assign trigger_o = lines;
  assign busy_o = waiting || pulsing;
  assign done_o = done;

`ifdef FORMAL
  trigger_properties properties (
    .clk_i(clk_i), .rst_i(rst_i), .tick_us_i(tick_us_i), .fire_i(fire_i),
    .delay_us_i(delay_us_i), .width_us_i(width_us_i),
    .trigger_o(trigger_o), .busy_o(busy_o), .done_o(done_o), .count_i(count),
    .waiting_i(waiting), .pulsing_i(pulsing), .cameras_i(cameras)
  );
`endif
endmodule

`default_nettype wire
