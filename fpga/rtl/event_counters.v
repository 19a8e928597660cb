// SPDX-License-Identifier: Apache-2.0
//
// Counters of events in one memory, with one adder for all. An event waits until it is its turn;
// those with lower numbers come first, and one clock is enough for each.
//
// event_i[2]  _|^|_________|^|________
// event_i[5]  _|^|____________________
// writes      _____| 2 | 5 |___| 2 |__
//
// The first SATURATING counters stay at 255, the others wrap. An event that comes while another one
// of its kind still waits is lost: only where several events come in every clock. clear_i starts
// the counter at place_i again; an event of it that waits, or comes in the same clock, counts. In
// the clock after read_i count_o is the counter at place_i.
// PLACES: place in memory of each event's counter, four bits each. While filling_i is high zeros
// are written at fill_i; events wait until that is done.
// Latency: 3 clocks, and those in which others come first.

`default_nettype none

module event_counters #(
  parameter EVENTS = 10,
  parameter SATURATING = 8,
  parameter [4*EVENTS-1:0] PLACES = {4'd9, 4'd8, 4'd7, 4'd6, 4'd5, 4'd4, 4'd3, 4'd2, 4'd1, 4'd0}
) (
  input  wire clk_i,
  input  wire rst_i,
  input  wire filling_i,
  input  wire [3:0] fill_i,
  input  wire [EVENTS-1:0] event_i,
  input  wire clear_i,
  input  wire read_i,
  input  wire [3:0] place_i,
  output wire [7:0] count_o
);

  reg [7:0] memory [0:15];
  reg [EVENTS-1:0] waiting;

  // The first that waits is chosen in one clock and counted in the next. The place has no reset, so
  // that a block memory can hold it.
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

  wire taken = !filling_i && !clear_i && !read_i;
  reg [3:0] place;
  reg zero;
  reg step;
  reg wraps;
  wire [7:0] count = memory[place];
  wire [8:0] more = {1'b0, count} + 9'd1;
  wire [7:0] next = (more[7:0] | {8{more[8] && !wraps}}) & {8{!zero}};

  always @(posedge clk_i) begin
    place <= filling_i ? fill_i : taken ? turn_place : place_i;
    if (zero || step) memory[place] <= next;
  end
  always @(posedge clk_i or posedge rst_i) begin
    if (rst_i) begin
      waiting <= {EVENTS{1'b0}};
      zero <= 1'b0;
      step <= 1'b0;
      wraps <= 1'b0;
    end else begin
      waiting <= event_i | (waiting & ~(turn & {EVENTS{taken}}));
      zero <= filling_i || clear_i;
      step <= taken && |waiting;
      wraps <= |turn[EVENTS-1:SATURATING];
    end
  end
  assign count_o = count;

`ifdef PROVE_EVENT_COUNTERS
  wire [3:0] chosen_place;
  event_counters_properties #(
    .EVENTS(EVENTS), .SATURATING(SATURATING), .PLACES(PLACES)
  ) properties (
    .clk_i(clk_i), .rst_i(rst_i), .event_i(event_i), .clear_i(clear_i), .read_i(read_i),
    .place_i(place_i), .count_o(count_o), .waiting_i(waiting), .turn_i(turn),
    .filling_i(filling_i), .fill_i(fill_i), .step_i(step), .zero_i(zero), .at_i(place),
    .wraps_i(wraps),
    .chosen_place_o(chosen_place), .count_i(memory[chosen_place])
  );
`endif

endmodule

`default_nettype wire
