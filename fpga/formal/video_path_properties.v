// SPDX-License-Identifier: Apache-2.0
// The logic in video_path besides its parts: the events of both cameras. The parts' outputs are
// free.
`default_nettype none

module video_path_properties (
  input wire       clk_i,
  input wire       rst_i,
  input wire [1:0] lost_i,
  input wire [1:0] wanted_i,
  input wire [1:0] wrong_line_i,
  input wire [1:0] wrong_frame_i,
  input wire       event_clock_lost_o,
  input wire       event_line_error_o
);
  reg begun = 1'b0;
  reg live, lost0, lost1;              // that a wanted camera has no clock was so the clock before
  always @(posedge clk_i) begin
    if (!begun) assume (rst_i);
    begun <= 1'b1;
    live <= !rst_i;
    lost0 <= !rst_i && lost_i[0] && wanted_i[0];
    lost1 <= !rst_i && lost_i[1] && wanted_i[1];
    if (begun && !rst_i) begin
      a_lost_is_told: assert (!(lost_i[0] && wanted_i[0] && !lost0) || event_clock_lost_o);
      a_lost_of_the_other_is_told: assert (!(lost_i[1] && wanted_i[1] && !lost1) ||
                                           event_clock_lost_o);
      a_lost_is_told_once: assert (!event_clock_lost_o || (lost_i[0] && wanted_i[0] && !lost0) ||
                                   (lost_i[1] && wanted_i[1] && !lost1));
      a_wrong_is_told: assert (event_line_error_o == (wrong_line_i != 2'd0 ||
                                                      wrong_frame_i != 2'd0));
      c_lost: cover (live && event_clock_lost_o && !event_line_error_o);
    end
  end
endmodule

`default_nettype wire
