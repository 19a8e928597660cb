// SPDX-License-Identifier: Apache-2.0
// Properties of glitch_filter, in terms of the line at earlier edges.
`default_nettype none

module glitch_filter_properties #(
  parameter SAMPLES = 3
) (
  input wire clk_i,
  input wire rst_i,
  input wire line_i,
  input wire level_o,
  input wire spike_o,
  input wire sample_i,
  input wire [SAMPLES-2:0] earlier_i
);
  // seen[k] is the line k + 1 edges ago.
  reg begun = 1'b0;
  reg [SAMPLES+1:0] seen;
  reg level_before;
  wire [SAMPLES-1:0] judged = seen[SAMPLES+1:2];

  always @(posedge clk_i) begin
    if (!begun) assume (rst_i);
    begun <= 1'b1;
    seen <= rst_i ? {SAMPLES+2{1'b1}} : {seen[SAMPLES:0], line_i};
    level_before <= rst_i || level_o;
  end

  always @(posedge clk_i) if (begun && !rst_i) begin
    a_sample: assert (sample_i == seen[1]);
    a_earlier: assert (earlier_i == seen[SAMPLES:2]);
    // A level passes exactly after this many equal samples.
    a_short_never_passes: assert (level_o == level_before || judged == {SAMPLES{level_o}});
    a_long_passes: assert (judged != {SAMPLES{!level_o}});
    // One spike for each run that ends without having passed.
    a_spike: assert (spike_o == (seen[1] == level_o && seen[2] != level_o));
    c_falls: cover (level_before && !level_o);
    c_rises: cover (!level_before && level_o);
    c_spike: cover (spike_o && !level_o);
  end
endmodule

`default_nettype wire
