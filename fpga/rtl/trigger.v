// SPDX-License-Identifier: Apache-2.0
// Trigger (or restart) pulse to one or both cameras, in the same clock.
//
//   fire_i      _|'|______________________________________
//   tick_us_i   ___|'|___|'|___|'|___|'|___|'|___|'|______
//   busy_o      __|'''''''''''''''''''''''''''''|_________
//   trigger_o   ________________|'''''''''''''''|_________   delay 2, width 3 (here 3 ticks)
//   done_o      ________________________________|'|_______
//
// The pulse starts with the first tick after delay_us_i further ones and lasts width_us_i ticks
// exactly (0 counts as 1). Delay is read with the start, width when the pulse starts. A start
// while busy is ignored.
//
// Latency: one clock after the tick.
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
  reg [15:0] count;
  reg [1:0]  cameras;
  reg [1:0]  lines;
  reg        waiting;
  reg        pulsing;
  reg        done;

  wire accept = (fire_i != 2'd0) && !waiting && !pulsing;
  // Waiting ends with 0, the pulse with 1 (or 0) left.
  wire spent = (count[15:1] == 15'd0) && (pulsing || !count[0]);
  wire end_wait = waiting && tick_us_i && spent;
  wire end_pulse = pulsing && tick_us_i && spent;

  always @(posedge clk_i or posedge rst_i) begin
    if (rst_i) begin
      count <= 16'd0;
      cameras <= 2'd0;
      lines <= 2'd0;
      waiting <= 1'b0;
      pulsing <= 1'b0;
      done <= 1'b0;
    end else begin
      done <= end_pulse;
      waiting <= accept || (waiting && !end_wait);
      pulsing <= end_wait || (pulsing && !end_pulse);
      lines <= end_pulse ? 2'd0 : end_wait ? cameras : lines;
      if (accept) begin
        cameras <= fire_i;
      end
      if (accept || tick_us_i) begin
        count <= accept ? delay_us_i : end_wait ? width_us_i : count - 16'd1;
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
