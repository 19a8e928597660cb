// SPDX-License-Identifier: Apache-2.0
// Replaces servo_width_properties.v in the proof of motion: what is proved there
// (a_hardware_limits, a_fresh), and what its proof assumes and motion must provide.
`default_nettype none

module servo_width_properties (
  input wire        clk_i,
  input wire        rst_i,
  input wire        start_i,
  input wire        restart_i,
  input wire        safe_i,
  input wire [1:0]  take_i,
  input wire        idle_o,
  input wire [3:0]  place_o,
  input wire [15:0] word_i,
  input wire        store_o,
  input wire        stored_i,
  input wire [1:0]  load_o,
  input wire [15:0] next_q4_o,
  input wire        busy_i,
  input wire        fresh_i,
  input wire        channel_i,
  input wire [3:0]  pass_i,
  input wire [3:0]  bit_at_i,
  input wire        use_safe_i,
  input wire        reading_i,
  input wire [3:0]  word_pass_i,
  input wire [3:0]  word_bit_i,
  input wire        working_i,
  input wire [3:0]  op_i,
  input wire        last_i,
  input wire        slewing_i,
  input wire        operand_i,
  input wire [15:0] actual_i,
  input wire        replace_i,
  input wire        carry_i
);
  reg begun = 1'b0;
  always @(posedge clk_i) begin
    begun <= 1'b1;
    if (begun && !rst_i) begin
      assume (!store_o || (next_q4_o >= 16'd9600 && next_q4_o <= 16'd38400));
      assume (!fresh_i || next_q4_o == 16'd24000);
      a_stored_in_time: assert (!stored_i || (store_o && !restart_i));
    end
  end
endmodule

`default_nettype wire
