// SPDX-License-Identifier: Apache-2.0
//
// Carries single pulses from one clock to another: each pulse flips a level, which crosses through
// sync_bit and makes a pulse again where it changes.
//
// from_clk_i  one _|^|_ of pulse_i             toggle  ____|^^^^^^^^^^
// to_clk_i    2 or 3 edges later               pulse_o ________|^|____
//
// Pulses must be at least 3 periods of to_clk_i apart, or two of them are lost together; a source
// that cannot promise so uses a handshake. Both sides must be reset together: a reset of one side
// alone may make one pulse.
// Latency: 1 edge of from_clk_i, then 2 edges of to_clk_i (pulse_o is seen by the third).

`default_nettype none

module sync_pulse (
  input  wire from_clk_i,
  input  wire from_rst_i,
  input  wire pulse_i,
  input  wire to_clk_i,
  input  wire to_rst_i,
  output wire pulse_o
);

  reg toggle;
  always @(posedge from_clk_i or posedge from_rst_i) begin
    if (from_rst_i) toggle <= 1'b0;
    else if (pulse_i) toggle <= !toggle;
  end

  wire arrived;
`ifdef PROVE_SYNC_PULSE
  wire meta;
`endif
  sync_bit crossing (
    .clk_i(to_clk_i),
    .rst_i(to_rst_i),
    .level_i(toggle),
`ifdef PROVE_SYNC_PULSE
    .meta_o(meta),
`endif
    .level_o(arrived)
  );

  reg seen;
  always @(posedge to_clk_i or posedge to_rst_i) begin
    if (to_rst_i) seen <= 1'b0;
    else seen <= arrived;
  end

  assign pulse_o = arrived != seen;

`ifdef PROVE_SYNC_PULSE
  sync_pulse_properties properties (
    .from_clk_i(from_clk_i), .from_rst_i(from_rst_i), .pulse_i(pulse_i), .to_clk_i(to_clk_i),
    .to_rst_i(to_rst_i), .pulse_o(pulse_o), .toggle_i(toggle), .meta_i(meta),
    .arrived_i(arrived), .seen_i(seen)
  );
`endif

endmodule

`default_nettype wire
