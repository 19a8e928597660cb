// SPDX-License-Identifier: Apache-2.0
// Properties of sync_pulse, in steps of time finer than both clocks: every pulse arrives once, by
// the third edge of the receiving clock, if the next one waits for that.
`default_nettype none

module sync_pulse_properties (
  input wire from_clk_i,
  input wire from_rst_i,
  input wire pulse_i,
  input wire to_clk_i,
  input wire to_rst_i,
  input wire pulse_o,
  input wire toggle_i,
  input wire meta_i,
  input wire arrived_i,
  input wire seen_i
);
  (* gclk *) wire instant;
  reg begun = 1'b0;
  reg from_before, to_before, pulse_before, arrival_before;
  reg [1:0] age_before;   // edges of the receiving clock since the pulse was sent
  reg pending_before;     // a pulse was sent and has not been taken

  // Registers change in the step in which their clock rises, from what they saw in the step before.
  wire from_edge = from_clk_i && !from_before;
  wire to_edge = to_clk_i && !to_before;
  wire sent = from_edge && pulse_before;
  wire taken = to_edge && arrival_before;
  wire pending = sent || (pending_before && !taken);
  wire [1:0] age = sent ? 2'd0 : age_before + {1'b0, to_edge && age_before != 2'd3};

  always @(posedge instant) begin
    begun <= 1'b1;
    from_before <= from_clk_i;
    to_before <= to_clk_i;
    pulse_before <= pulse_i && begun;
    arrival_before <= pulse_o && begun;
    age_before <= begun ? age : 2'd3;
    pending_before <= begun && pending;
    if (!begun) assume (from_rst_i && to_rst_i && from_clk_i && to_clk_i);
    else assume (!from_rst_i && !to_rst_i);
    // The next pulse waits until the last one has been taken.
    if (begun && sent) assume (!pending_before || taken);
  end

  always @(posedge instant) if (begun) begin
    a_taken_once: assert (!taken || pending_before);
    a_taken_by_the_third_edge: assert (!pending || age != 2'd3);
    a_not_before: assert (!pulse_o || (pending && age == 2'd2));
    a_path: assert ({meta_i, arrived_i, seen_i} == (
      !pending ? {3{toggle_i}} : {3{toggle_i}} ^ (3'b111 >> age)));
    c_two_pulses: cover (taken && !toggle_i);
  end
endmodule

`default_nettype wire
