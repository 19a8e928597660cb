// SPDX-License-Identifier: Apache-2.0
// What servo_width promises: its bounds for any inputs, and the width of servo_width_model when its
// inputs have been steady for as many clocks as it has steps.
`default_nettype none

module servo_width_properties (
  input wire        clk_i,
  input wire        rst_i,
  input wire [15:0] request_q4_i,
  input wire [15:0] min_q4_i,
  input wire [15:0] max_q4_i,
  input wire [10:0] slew_q4_i,
  input wire [15:0] actual_q4_i,
  input wire [15:0] next_q4_o
);
  localparam [15:0] LOWEST_Q4 = 16'd9600;
  localparam [15:0] HIGHEST_Q4 = 16'd38400;

  wire [15:0] wanted;
  servo_width_model model (
    .request_i(request_q4_i), .min_i(min_q4_i), .max_i(max_q4_i), .slew_i(slew_q4_i),
    .actual_i(actual_q4_i), .next_o(wanted)
  );
  wire [15:0] up = actual_q4_i + {5'd0, slew_q4_i};
  wire [15:0] down = actual_q4_i - {5'd0, slew_q4_i};
  wire inside = actual_q4_i >= LOWEST_Q4 && actual_q4_i <= HIGHEST_Q4;

  wire [74:0] inputs = {request_q4_i, min_q4_i, max_q4_i, slew_q4_i, actual_q4_i};
  reg [74:0] before;
  reg [2:0] steady;                  // clocks in which the inputs were as now
  wire settled = steady >= 3'd5 && inputs == before;
  reg begun = 1'b0;
  always @(posedge clk_i) begin
    if (!begun) assume (rst_i);
    begun <= 1'b1;
    before <= inputs;
    steady <= rst_i ? 3'd0 : inputs != before ? 3'd1 : steady == 3'd7 ? steady : steady + 3'd1;
    if (begun) begin
      a_hardware_limits: assert (next_q4_o >= LOWEST_Q4 && next_q4_o <= HIGHEST_Q4);
      a_reset: assert (!rst_i || next_q4_o == 16'd24000);
      if (!rst_i && settled && inside) begin
        a_next_exact: assert (next_q4_o == wanted);
        a_next_slew: assert (next_q4_o <= up && next_q4_o >= down);
        a_next_limits: assert (!(min_q4_i <= max_q4_i && actual_q4_i >= min_q4_i
          && actual_q4_i <= max_q4_i) || (next_q4_o >= min_q4_i && next_q4_o <= max_q4_i)
          || next_q4_o == LOWEST_Q4 || next_q4_o == HIGHEST_Q4);
        a_progress: assert (!(request_q4_i >= min_q4_i && request_q4_i <= max_q4_i
          && request_q4_i >= LOWEST_Q4 && request_q4_i <= HIGHEST_Q4) || next_q4_o == request_q4_i
          || next_q4_o == (request_q4_i > actual_q4_i ? up : down));
        c_request: cover (next_q4_o == request_q4_i && next_q4_o != actual_q4_i);
        c_slew: cover (next_q4_o == up && slew_q4_i != 11'd0 && next_q4_o != max_q4_i);
      end
    end
  end
endmodule

`default_nettype wire
