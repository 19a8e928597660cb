// SPDX-License-Identifier: Apache-2.0
// Stands in for servo_width_properties in the proof of servo_pwm: what was proved there is taken
// for granted here. The width of the pulses then keeps the slew limit too.
`default_nettype none

module servo_width_properties (
  input wire        clk_i,
  input wire        rst_i,
  input wire [5:0]  step_i,
  input wire        changed_i,
  input wire        safe_i,
  input wire [15:0] target_q4_i,
  input wire [15:0] safe_q4_i,
  input wire [15:0] min_q4_i,
  input wire [15:0] max_q4_i,
  input wire [10:0] slew_q4_i,
  input wire [15:0] actual_q4_i,
  input wire        ready_o,
  input wire [15:0] next_q4_o,
  input wire        dirty_i,
  input wire        running_i,
  input wire        working_i,
  input wire        use_safe_i,
  input wire [1:0]  pass_i,
  input wire        first_i,
  input wire [7:0]  bits_i,
  input wire [2:0]  pass0_i,
  input wire [3:0]  pass1_i,
  input wire [1:0]  pass2_i
);
  reg        begun = 1'b0;
  reg        reset = 1'b1;
  reg        kept;                 // no input ever changed without changed_i
  reg        safe, changed;
  reg [15:0] target, safe_q4, min, max, actual;
  reg [10:0] slew, slew_then;
  wire       same = target == target_q4_i && safe_q4 == safe_q4_i && min == min_q4_i &&
                    max == max_q4_i && slew == slew_q4_i && actual == actual_q4_i;
  wire [15:0] limited, near, wanted;

  servo_width_model model (
    .request_i(safe ? safe_q4 : target), .min_i(min), .max_i(max), .slew_i(slew),
    .actual_i(actual), .limited_o(limited), .near_o(near), .next_o(wanted)
  );

  always @(posedge clk_i) begin
    begun <= 1'b1;
    reset <= rst_i;
    kept <= rst_i || (kept && (reset || same || changed || changed_i));
    changed <= changed_i;
    slew_then <= slew;
    safe <= safe_i && !rst_i;
    target <= target_q4_i;
    safe_q4 <= safe_q4_i;
    min <= min_q4_i;
    max <= max_q4_i;
    slew <= slew_q4_i;
    actual <= actual_q4_i;
    if (!rst_i && ready_o) begin
      assume (next_q4_o >= 16'd9600 && next_q4_o <= 16'd38400);  // a_hardware_limits
      assume (!kept || next_q4_o == wanted);                      // a_next_exact
    end
    if (begun && !rst_i && !reset) begin
      a_slew: assert (!kept || (actual_q4_i <= actual + {5'd0, slew_then} &&
                                actual_q4_i + {5'd0, slew_then} >= actual));
    end
  end
endmodule

`default_nettype wire
