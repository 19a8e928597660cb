// SPDX-License-Identifier: Apache-2.0
// Proof only: the next width in plain expressions, 16 bits at once; value_o[k] is what there is
// before limit k is applied, limit_o[k] the limit: 1 min, 2 max, 3 actual - slew, 4 actual + slew,
// 5 and 6 those of the hardware. The last value is the next width.
`default_nettype none

module servo_width_model (
  input  wire [15:0] request_i,
  input  wire [15:0] min_i,
  input  wire [15:0] max_i,
  input  wire [15:0] slew_i,
  input  wire [15:0] actual_i,
  input  wire [2:0]  which_i,
  output reg  [15:0] value_o,
  output reg  [15:0] limit_o,
  output wire [15:0] next_o
);
  wire [15:0] up = actual_i + slew_i;
  wire [15:0] down = actual_i - slew_i;
  wire [15:0] raised = request_i < min_i ? min_i : request_i;
  wire [15:0] limited = raised > max_i ? max_i : raised;
  wire [15:0] not_below = limited < down ? down : limited;
  wire [15:0] near = not_below > up ? up : not_below;
  wire [15:0] high = near < 16'd9600 ? 16'd9600 : near;
  assign next_o = high > 16'd38400 ? 16'd38400 : high;

  always @* begin
    case (which_i)
      3'd1: value_o = request_i;
      3'd2: value_o = raised;
      3'd3: value_o = limited;
      3'd4: value_o = not_below;
      3'd5: value_o = near;
      3'd6: value_o = high;
      default: value_o = next_o;
    endcase
    case (which_i)
      3'd1: limit_o = min_i;
      3'd2: limit_o = max_i;
      3'd3: limit_o = down;
      3'd4: limit_o = up;
      3'd5: limit_o = 16'd9600;
      default: limit_o = 16'd38400;
    endcase
  end
endmodule

`default_nettype wire
