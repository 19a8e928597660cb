// SPDX-License-Identifier: Apache-2.0
// The handshake between the two sides of a camera's meters: results are copied only while they are
// stable. One step of the proof is a step of time; both clocks are free and may stop.
`default_nettype none

module camera_channel_properties (
  input wire clk_i,
  input wire rst_i,
  input wire pixel_clk_i,
  input wire measuring,
  input wire [11:0] lines,
  input wire [11:0] width,
  input wire wrong,
  input wire taken,
  input wire taken_there,
  input wire frame_valid,
  input wire measuring_meta,
  input wire taken_meta,
  input wire finish,
  input wire closing
);
  (* gclk *) wire now;
  reg begun = 1'b0;
  reg clk_before, pixel_clk_before, measuring_before, taken_before, there_before, finish_before;
  reg [24:0] results_before;
  wire [24:0] results = {lines, width, wrong};
  wire [5:0] ring = {measuring, measuring_meta, frame_valid, taken, taken_meta, taken_there};
  wire [5:0] change = ring ^ {!ring[0], ring[5:1]};
  wire [2:0] changes = {2'd0, change[0]} + {2'd0, change[1]} + {2'd0, change[2]} +
                       {2'd0, change[3]} + {2'd0, change[4]} + {2'd0, change[5]};
  wire takes_over = clk_i && !clk_before && finish_before;
  always @(posedge now) begin
    begun <= 1'b1;
    assume (rst_i == !begun);
    clk_before <= clk_i;
    pixel_clk_before <= pixel_clk_i;
    measuring_before <= measuring;
    taken_before <= taken;
    there_before <= taken_there;
    finish_before <= finish;
    results_before <= results;
    if (begun && !rst_i) begin
      // The edge at which frame_record copies the results: they do not change just before it or at
      // it, so that no register sees half of a change.
      a_results_stand_still: assert (!takes_over || results == results_before);
      a_not_measuring_then: assert (!takes_over || (!measuring && !measuring_before));
      // Four phases, in order, whatever the clocks do.
      a_rises_after_return: assert (!(measuring && !measuring_before) || (!there_before && !taken));
      a_falls_after_taken: assert (!(!measuring && measuring_before) || (there_before &&
        taken_before));
      a_taken_rises_in_a_frame: assert (!(taken && !taken_before) || measuring_before);
      a_taken_falls_after_it: assert (!(!taken && taken_before) || !measuring_before);
      // Helps the induction: one change at a time goes round the ring.
      a_one_change: assert (changes == 3'd1);
      a_closing: assert (!closing || measuring);
    end
    c_taken_over: cover (begun && takes_over && lines != 12'd0);
  end
endmodule

`default_nettype wire
