// SPDX-License-Identifier: Apache-2.0
//
// When frames start: the time of the last frame that went to the PPI, and how much later the right
// camera's frames start than the left one's.
//
// start_left_i   ___|^|______________________|^|______________________|^|___
// start_right_i  _________|^|______________________|^|______________________
// since               0..a      0.........b     0..a
// skew_us_o      ==========X= +a ================== (b > a is not the skew) ==
//
// Starts of the two cameras alternate; of the two distances in between the smaller one is the
// skew. A distance is taken when it is not longer than the present skew, or when the one
// before was not taken either: so it follows cameras that drift. Saturates at +-32767; since stays
// at 32767.
// ppi_start_i    ___|^|___________    frame_time_o is time_us_i of that clock
// Latency: 1 clock.

`default_nettype none

module frame_time (
  input  wire clk_i,
  input  wire rst_i,
  input  wire tick_us_i,
  input  wire [31:0] time_us_i,
  input  wire ppi_start_i,
  input  wire start_left_i,
  input  wire start_right_i,
  output wire [15:0] skew_us_o,
  output reg  [31:0] frame_time_o
);

  always @(posedge clk_i or posedge rst_i) begin
    if (rst_i) frame_time_o <= 32'd0;
    else if (ppi_start_i) frame_time_o <= time_us_i;
  end

  reg [14:0] since;
  reg [14:0] distance;
  reg left_later;
  reg last_right;
  reg passed_over;

  wire full;                           // the carry out of the counter
  wire [14:0] since_next;
  assign {full, since_next} = {1'b0, since} + 16'd1;

  wire start = start_left_i || start_right_i;
  wire both = start_left_i && start_right_i;
  wire other = last_right ? start_left_i : start_right_i;
  wire take = both || (other && (since <= distance || passed_over));

  always @(posedge clk_i or posedge rst_i) begin
    if (rst_i) begin
      since <= 15'd0;
      distance <= 15'd0;
      left_later <= 1'b0;
      last_right <= 1'b0;
      passed_over <= 1'b0;
    end else begin
      if (start) since <= 15'd0;
      else if (tick_us_i && !full) since <= since_next;
      if (start) last_right <= start_right_i;
      if (both || other) passed_over <= !take;
      if (take) begin
        distance <= both ? 15'd0 : since;
        left_later <= last_right && !both;
      end
    end
  end

  // One's complement and a carry in: the sign of a distance.
  assign skew_us_o = ({1'b0, distance} ^ {16{left_later}}) + {15'd0, left_later};

`ifdef PROVE_FRAME_TIME
  frame_time_properties properties (
    .clk_i(clk_i), .rst_i(rst_i), .tick_us_i(tick_us_i), .time_us_i(time_us_i),
    .ppi_start_i(ppi_start_i), .start_left_i(start_left_i), .start_right_i(start_right_i),
    .skew_us_o(skew_us_o), .frame_time_o(frame_time_o), .since(since), .last_right(last_right),
    .passed_over(passed_over), .distance(distance), .left_later(left_later)
  );
`endif

endmodule

`default_nettype wire
