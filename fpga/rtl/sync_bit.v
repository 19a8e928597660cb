// SPDX-License-Identifier: Apache-2.0
//
// Brings one level from anywhere into the domain of clk_i.
//
//            ___     ___     ___     ___     ___
// clk_i    _|   |___|   |___|   |___|   |___|   |__
//               ________________________________
// level_i  ____|
//                          _____________________
// level_o  _______________|
//
// Latency: 2 rising edges of clk_i; with SIM_RANDOM_DELAY (simulation only) a changing level takes
// 2 or 3 by chance, as metastability would make it.
// RESET_LEVEL: what level_o is during reset.
// SIM_DELAY: 0 leaves this one out of SIM_RANDOM_DELAY, for signals whose samples are counted.

`default_nettype none

module sync_bit #(
  parameter RESET_LEVEL = 1'b0,
  parameter SIM_DELAY = 1
) (
  input  wire clk_i,
  input  wire rst_i,
  input  wire level_i,
`ifdef PROVE_SYNC_PULSE
  output wire meta_o,
`endif
  output wire level_o
);

  // The first stage may go metastable; nothing but the second may read it.
  (* ASYNC_REG = "TRUE", keep *) reg meta;
  (* ASYNC_REG = "TRUE", keep *) reg stable;

`ifdef SIM_RANDOM_DELAY
  // One edge may miss a change, the next takes it. A number is drawn for each change.
  reg [31:0] noise = $random | 32'd1;
  reg missed = 1'b0;
  wire changes = level_i != meta;
  wire [31:0] noise_a = noise ^ (noise << 13);
  wire [31:0] noise_b = noise_a ^ (noise_a >> 17);
  wire miss = SIM_DELAY != 0 && noise[7] && !missed && changes;
  always @(posedge clk_i) begin
    if (changes) noise <= noise_b ^ (noise_b << 5);
    missed <= miss;
  end
  wire sampled = miss ? meta : level_i;
`else
  wire unused_sim_delay = SIM_DELAY != 0;
  wire sampled = level_i;
`endif

  always @(posedge clk_i or posedge rst_i) begin
    if (rst_i) begin
      meta <= RESET_LEVEL;
      stable <= RESET_LEVEL;
    end else begin
      meta <= sampled;
      stable <= meta;
    end
  end

  assign level_o = stable;
`ifdef PROVE_SYNC_PULSE
  assign meta_o = meta;
`endif

`ifdef PROVE_SYNC_BIT
  sync_bit_properties #(.RESET_LEVEL(RESET_LEVEL)) properties (
    .clk_i(clk_i), .rst_i(rst_i), .level_i(level_i), .level_o(level_o), .meta_i(meta)
  );
`endif

endmodule

`default_nettype wire
