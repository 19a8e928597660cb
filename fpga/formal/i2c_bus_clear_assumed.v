// SPDX-License-Identifier: Apache-2.0
// Replaces i2c_bus_clear_properties in the proof of i2c_router; i2c_branch_properties assumes two
// more of its assertions.
`default_nettype none

module i2c_bus_clear_properties (
  input wire       clk_i,
  input wire       rst_i,
  input wire       tick_us_i,
  input wire       go_i,
  input wire       sda_i,
  input wire       scl_low_o,
  input wire       sda_low_o,
  input wire       done_o,
  input wire       busy_i,
  input wire       started_i,
  input wire [3:0] phase_i,
  input wire [3:0] clock_i
);
  always @(posedge clk_i) begin
    if (!rst_i) begin
      assume (busy_i || (!scl_low_o && !sda_low_o));  // a_free_when_idle
      assume (!done_o || !busy_i);                     // a_done_once
    end
  end
endmodule

`default_nettype wire
