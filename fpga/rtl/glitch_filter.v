// SPDX-License-Identifier: Apache-2.0
//
// One line of an I2C bus, brought into the domain of clk_i and freed of spikes: the level follows
// only when SAMPLES samples in a row agree, so a spike that is seen by fewer never passes.
//
//            _   _   _   _   _   _   _   _   _   _   _   _
// clk_i    _| |_| |_| |_| |_| |_| |_| |_| |_| |_| |_| |_| |_
//          ______   ____          ____________________________
// line_i         |_|    |________|                                 (SAMPLES = 3)
//          __________   ____          __________________________
// sample_o           |_|    |________|                               as line_i, 2 clocks later
//          ________________________________          __________
// level_o                                  |________|
// spike_o  ________________|^^^|______________________________
//
// SAMPLES: at least 2; a spike shorter than SAMPLES - 1 periods of clk_i is always removed, a level
// longer than SAMPLES periods always passes. At 25 MHz 3 samples remove 80 ns; the
// specification asks for 50 ns. sample_o: the line at clk_i, not filtered. spike_o: one clock for
// each run of samples that was removed.
// Latency: 2 (synchroniser) + SAMPLES rising edges. The line is high during reset.

`default_nettype none

module glitch_filter #(
  parameter SAMPLES = 3
) (
  input  wire clk_i,
  input  wire rst_i,
  input  wire line_i,
  output reg  level_o,
  output wire sample_o,
  output wire spike_o
);

  // Every sample counts here: a synchroniser delayed by chance would make spikes longer.
  wire sample;
  sync_bit #(.RESET_LEVEL(1'b1), .SIM_DELAY(0)) synchroniser (
    .clk_i(clk_i),
    .rst_i(rst_i),
    .level_i(line_i),
    .level_o(sample)
  );

  reg [SAMPLES-2:0] earlier;
  wire [SAMPLES-1:0] samples = {earlier, sample};
  assign sample_o = sample;

  always @(posedge clk_i or posedge rst_i) begin
    if (rst_i) begin
      earlier <= {SAMPLES-1{1'b1}};
      level_o <= 1'b1;
    end else begin
      earlier <= samples[SAMPLES-2:0];
      if (&samples) level_o <= 1'b1;
      else if (~|samples) level_o <= 1'b0;
    end
  end

  assign spike_o = sample == level_o && earlier[0] != level_o;

`ifdef PROVE_GLITCH_FILTER
  glitch_filter_properties #(.SAMPLES(SAMPLES)) properties (
    .clk_i(clk_i), .rst_i(rst_i), .line_i(line_i), .level_o(level_o), .spike_o(spike_o),
    .sample_i(sample), .earlier_i(earlier)
  );
`endif

endmodule

`default_nettype wire
