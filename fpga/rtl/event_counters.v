// SPDX-License-Identifier: Apache-2.0
//
// Counters of events in one memory, with one adder for all. An event waits until it is its turn;
// those with lower numbers come first, and one clock is enough for each.
//
// event_i[2]  _|^|_________|^|________
// event_i[5]  _|^|____________________
// writes      _________| 2 | 5 |___| 2 |__
//
// The first SATURATING counters stay at 255, the others wrap. An event that comes while another one
// of its kind still waits is lost: only where several events come in every clock. clear_i starts
// the counter at place_i again; an event of it that waits, or comes in the same clock, counts.
// PLACES: place in memory of each event's counter, four bits each. count_o is the counter at
// place_i. After reset the memory is filled with zeros; events wait until that is done. Whose turn
// it is and what is then written are worked out in two clocks, one after the other.
// Latency: 3 clocks, and those in which others come first.

`default_nettype none

module event_counters #(
  parameter EVENTS = 10,
  parameter SATURATING = 8,
  parameter [4*EVENTS-1:0] PLACES = {4'd9, 4'd8, 4'd7, 4'd6, 4'd5, 4'd4, 4'd3, 4'd2, 4'd1, 4'd0}
) (
  input  wire clk_i,
  input  wire rst_i,
  input  wire [EVENTS-1:0] event_i,
  input  wire clear_i,
  input  wire [3:0] place_i,
  output wire [7:0] count_o
);

  reg [7:0] memory [0:15];
  reg [4:0] fill;
  reg [EVENTS-1:0] waiting;

  // The first that waits.
  reg [EVENTS-1:0] turn;
  reg [3:0] turn_place;
  integer i;
  always @* begin
    turn = {EVENTS{1'b0}};
    turn_place = 4'd0;
    for (i = EVENTS - 1; i >= 0; i = i - 1) begin
      if (waiting[i]) begin
        turn = {EVENTS{1'b0}};
        turn[i] = 1'b1;
        turn_place = PLACES[4*i +: 4];
      end
    end
  end

  wire filling = !fill[4];
  wire zero = filling || clear_i;
  wire saturates = |turn[SATURATING-1:0];
  wire [3:0] place = filling ? fill[3:0] : clear_i ? place_i : turn_place;

  // In the next clock.
  reg working;
  reg zeroing;
  reg saturating;
  reg [3:0] at;
  wire [7:0] count = memory[at];
  wire [8:0] next = {1'b0, count & {8{!zeroing}}} + {8'd0, !zeroing};
  wire store = working && !(next[8] && saturating);

  always @(posedge clk_i) begin
    if (store) memory[at] <= next[7:0];
  end
  always @(posedge clk_i or posedge rst_i) begin
    if (rst_i) begin
      fill <= 5'd0;
      waiting <= {EVENTS{1'b0}};
      working <= 1'b0;
      zeroing <= 1'b0;
      saturating <= 1'b0;
      at <= 4'd0;
    end else begin
      if (filling) fill <= fill + 5'd1;
      waiting <= event_i | (waiting & ~(turn & {EVENTS{!zero}}));
      working <= zero || |waiting;
      zeroing <= zero;
      saturating <= saturates;
      at <= place;
    end
  end
  assign count_o = memory[place_i];

`ifdef PROVE_EVENT_COUNTERS
  wire [3:0] chosen_place;
  event_counters_properties #(
    .EVENTS(EVENTS), .SATURATING(SATURATING), .PLACES(PLACES)
  ) properties (
    .clk_i(clk_i), .rst_i(rst_i), .event_i(event_i), .clear_i(clear_i), .place_i(place_i),
    .count_o(count_o), .waiting_i(waiting), .turn_i(turn), .filling_i(filling), .fill_i(fill),
    .working_i(working), .zeroing_i(zeroing), .saturating_i(saturating), .at_i(at),
    .chosen_place_o(chosen_place), .count_i(memory[chosen_place])
  );
`endif

endmodule

`default_nettype wire
