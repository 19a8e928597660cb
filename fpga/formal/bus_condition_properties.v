// SPDX-License-Identifier: Apache-2.0
// What bus_condition promises, in terms of the lines at earlier edges.
`default_nettype none

module bus_condition_properties #(
  parameter HOLD = 4
) (
  input wire clk_i,
  input wire rst_i,
  input wire scl_i,
  input wire scl_sample_i,
  input wire sda_i,
  input wire scl_rise_o,
  input wire scl_fall_o,
  input wire start_o,
  input wire stop_o,
  input wire scl_last_i,
  input wire sda_last_i
);
  // scl[k], sda[k]: the lines k edges ago, k = 0 is now.
  reg begun = 1'b0;
  reg [HOLD:0] scl_seen;
  reg [HOLD:0] sda_seen;
  reg [4:0] samples;  // the 5 before this one
  wire [HOLD+1:0] scl = {scl_seen, scl_i};
  wire [HOLD+1:0] sda = {sda_seen, sda_i};

  always @(posedge clk_i) begin
    if (!begun) assume (rst_i);
    begun <= 1'b1;
    samples <= rst_i ? 5'h1F : {samples[3:0], scl_sample_i};
    scl_seen <= rst_i ? {HOLD+1{1'b1}} : scl[HOLD:0];
    sda_seen <= rst_i ? {HOLD+1{1'b1}} : sda[HOLD:0];
  end

  // SDA changed HOLD edges ago, and SCL has been high from before the change until now.
  integer i;
  reg [2:0] low;
  always @* begin
    low = 3'd0;
    for (i = 0; i < 5; i = i + 1) low = low + {2'd0, !samples[i]};
  end
  wire changed = low <= 3'd2 && &scl && sda[HOLD] != sda[HOLD+1];
  always @(posedge clk_i) if (begun && !rst_i) begin
    a_last: assert (scl_last_i == scl[1] && sda_last_i == sda[1]);
    a_rise: assert (scl_rise_o == (scl[0] && !scl[1]));
    a_fall: assert (scl_fall_o == (!scl[0] && scl[1]));
    a_start: assert (start_o == (changed && !sda[0]));
    a_stop: assert (stop_o == (changed && sda[0]));
    a_start_needs_scl: assert (!(start_o || stop_o) || (&scl && !scl_rise_o && !scl_fall_o));
    c_start: cover (start_o);
    c_stop: cover (stop_o);
    c_hidden_fall: cover (&scl && sda[HOLD] != sda[HOLD+1] && !start_o && !stop_o);
    c_too_short: cover (!scl[0] && &scl[HOLD+1:1] && sda[HOLD] != sda[HOLD+1]);
  end
endmodule

`default_nettype wire
