// SPDX-License-Identifier: Apache-2.0
// Proof only: the next width in plain expressions.
`default_nettype none

module servo_width_model (
  input  wire [15:0] request_i,
  input  wire [15:0] min_i,
  input  wire [15:0] max_i,
  input  wire [10:0] slew_i,
  input  wire [15:0] actual_i,
  output wire [15:0] next_o
);
  wire [15:0] raised = request_i < min_i ? min_i : request_i;
  wire [15:0] limited = raised > max_i ? max_i : raised;
  wire [15:0] distance = limited > actual_i ? limited - actual_i : actual_i - limited;
  wire [15:0] near = distance <= {5'd0, slew_i} ? limited
    : limited > actual_i ? actual_i + {5'd0, slew_i} : actual_i - {5'd0, slew_i};
  assign next_o = near < 16'd9600 ? 16'd9600 : near > 16'd38400 ? 16'd38400 : near;
endmodule

`default_nettype wire
