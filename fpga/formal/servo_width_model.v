// SPDX-License-Identifier: Apache-2.0
// Proof only: the next width in one expression, 16 bits at once.
`default_nettype none

module servo_width_model (
  input  wire [15:0] request_i,
  input  wire [15:0] min_i,
  input  wire [15:0] max_i,
  input  wire [10:0] slew_i,
  input  wire [15:0] actual_i,
  output wire [15:0] limited_o,   // inside the limits
  output wire [15:0] near_o,      // and not further than the slew
  output wire [15:0] next_o       // and inside the hardware limits
);
  wire [15:0] up = actual_i + {5'd0, slew_i};
  wire [15:0] down = actual_i - {5'd0, slew_i};
  wire [15:0] raised = request_i < min_i ? min_i : request_i;
  assign limited_o = raised > max_i ? max_i : raised;
  assign near_o = limited_o > up ? up : limited_o < down ? down : limited_o;
  assign next_o = near_o < 16'd9600 ? 16'd9600 : near_o > 16'd38400 ? 16'd38400 : near_o;
endmodule

`default_nettype wire
