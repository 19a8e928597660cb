// SPDX-License-Identifier: Apache-2.0
// One example of each crossing, correct and wrong, for the test of fpga/tools/cdc.py.
`default_nettype none
module crossings (
    input  wire       clk_a_i,
    input  wire       clk_b_i,
    input  wire       rst_i,
    input  wire       pin_i,
    input  wire       mode_i,
    input  wire [1:0] word_i,
    output wire [9:0] out_o
);
  // Sources in a.
  reg flag, other;
  reg [1:0] word;
  always @(posedge clk_a_i or posedge rst_i)
    if (rst_i) {flag, other, word} <= 4'd0;
    else {flag, other, word} <= {~flag, flag ^ mode_i, word_i};

  // Correct: two stages, from a flip-flop and from a pin.
  reg good_1, good_2, pin_1, pin_2;
  always @(posedge clk_b_i or posedge rst_i)
    if (rst_i) {good_2, good_1, pin_2, pin_1} <= 4'd0;
    else {good_2, good_1, pin_2, pin_1} <= {good_1, flag, pin_1, pin_i};

  // Wrong: one stage only, whose output goes to two places.
  reg single;
  always @(posedge clk_b_i) single <= other;

  // Wrong: logic before the first stage.
  reg mixed_1, mixed_2;
  always @(posedge clk_b_i) {mixed_2, mixed_1} <= {mixed_1, flag & other};

  // Wrong: two bits of one register, synchronised separately.
  reg [1:0] torn_1, torn_2;
  always @(posedge clk_b_i) {torn_2, torn_1} <= {torn_1, word};

  // Wrong: a reset from the other clock.
  reg cleared;
  always @(posedge clk_b_i or posedge flag)
    if (flag) cleared <= 1'b0;
    else cleared <= ~cleared;

  // Wrong: a clock made by logic. Its data are in its own domain, so that is the only fault.
  wire gated = clk_b_i & mode_i;
  reg  behind;
  always @(posedge gated) behind <= ~behind;

  assign out_o = {good_2, pin_2, single, ~single, mixed_2, torn_2, cleared, behind, 1'b0};
endmodule
`default_nettype wire
