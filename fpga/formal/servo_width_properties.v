// SPDX-License-Identifier: Apache-2.0
// The bit-serial width equals the one of servo_width_model; its bounds hold whatever the inputs do.
// step_i runs as servo_frame drives it; actual_q4_i stays in the hardware limits (servo_pwm).
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
  localparam [15:0] LOWEST_Q4 = 16'd9600;
  localparam [15:0] HIGHEST_Q4 = 16'd38400;

  reg        begun = 1'b0;
  reg        fresh_reset = 1'b1;
  reg        kept;                 // no input ever changed without changed_i
  reg [5:0]  step;
  reg        changed, safe, dirty;
  reg [15:0] target, safe_q4, min, max, actual;
  reg [10:0] slew;
  wire [15:0] request = safe ? safe_q4 : target;
  wire [15:0] limited, near, wanted;
  wire        same = target == target_q4_i && safe_q4 == safe_q4_i && min == min_q4_i &&
                     max == max_q4_i && slew == slew_q4_i && actual == actual_q4_i;

  servo_width_model model (
    .request_i(request), .min_i(min), .max_i(max), .slew_i(slew), .actual_i(actual),
    .limited_o(limited), .near_o(near), .next_o(wanted)
  );

  // 0 .. 129: clocks without a change.
  reg [7:0] quiet;

  always @(posedge clk_i) begin
    if (!begun) assume (rst_i);
    begun <= 1'b1;
    fresh_reset <= rst_i;
    if (begun && !rst_i && !fresh_reset) assume (step_i == step + 6'd1);
    if (!rst_i) assume (actual_q4_i >= LOWEST_Q4 && actual_q4_i <= HIGHEST_Q4);
    step <= step_i;
    changed <= changed_i;
    dirty <= dirty_i;
    safe <= safe_i && !rst_i;
    target <= target_q4_i;
    safe_q4 <= safe_q4_i;
    min <= min_q4_i;
    max <= max_q4_i;
    slew <= slew_q4_i;
    actual <= actual_q4_i;
    kept <= rst_i || (kept && (fresh_reset || same || changed || changed_i));
    quiet <= (rst_i || changed_i || use_safe_i != safe_i) ? 8'd0 : (quiet == 8'd255) ? quiet :
             quiet + 8'd1;
  end

  wire [3:0]  at = step[3:0];
  wire [15:0] mask = (16'd1 << at) - 16'd1;
  wire [15:0] wide = {5'd0, slew};
  wire [15:0] done = next_q4_o >> (5'd16 - {1'b0, at});              // bits of this pass
  wire [15:0] left = next_q4_o & (16'hFFFF >> at);                    // bits of the pass before
  wire [15:0] turned = done | (next_q4_o << at);
  wire        sound = kept && !dirty_i && !dirty;                     // the round counts
  wire        work = working_i && begun && !rst_i;
  wire [15:0] up = actual + wide;
  wire [15:0] down = actual - wide;

  always @(posedge clk_i) begin
    if (begun && !rst_i) begin
      // The promises. What was there in the clock before counts: an input may change right now.
      a_hardware_limits: assert (!ready_o || (next_q4_o >= LOWEST_Q4 && next_q4_o <= HIGHEST_Q4));
      a_next_exact: assert (!(ready_o && kept) || next_q4_o == wanted);
      a_next_slew: assert (!(ready_o && kept) || (next_q4_o <= up && next_q4_o >= down));
      a_next_limits: assert (!(ready_o && kept && min <= max && actual >= min && actual <= max) ||
                             (next_q4_o >= min && next_q4_o <= max) ||
                             next_q4_o == LOWEST_Q4 || next_q4_o == HIGHEST_Q4);
      a_progress: assert (!(ready_o && kept && request >= min && request <= max &&
                            request >= LOWEST_Q4 && request <= HIGHEST_Q4) ||
                          next_q4_o == request ||
                          next_q4_o == (request > actual ? up : down));
      a_ready_soon: assert (quiet < 8'd129 || ready_o);
      a_ready_stops: assert (!ready_o || fresh_reset || !(changed && begun));

      // Helps the induction: where the work stands.
      a_sequence: assert (fresh_reset || step_i == 6'd0 || running_i == working_i);
      a_first: assert (fresh_reset || (first_i == (at == 4'd0) && pass_i == step[5:4]));
      a_use_safe: assert (use_safe_i == safe);
      a_bits: assert (fresh_reset || bits_i == {target[at], safe_q4[at], min[at], max[at],
                      actual[at], wide[at], LOWEST_Q4[at], HIGHEST_Q4[at]});
      a_quiet: assert ((quiet == 8'd0 || fresh_reset || !dirty_i || quiet <= {2'd0, step} + 8'd1) &&
                       (!running_i || dirty_i || {2'd0, step_i} + 8'd64 >= quiet ) &&
                       (!working_i || running_i || dirty_i || quiet <= 8'd128));
      if (work && sound) begin
        a_pass0: assert (step[5:4] != 2'd0 || at == 4'd0 ||
                         (pass0_i == {(request & mask) < (min & mask),
                                      (request & mask) > (max & mask),
                                      (min & mask) > (max & mask)} &&
                          done == (request & mask)));
        a_compared: assert (step[5:4] == 2'd0 ||
                            pass0_i == {request < min, request > max, min > max});
        a_pass1: assert (step[5:4] != 2'd1 ||
                         (left == (request >> at) && (at == 4'd0 || (done == (limited & mask) &&
                          pass1_i[3:2] == {(limited & mask) > (up & mask),
                                           (limited & mask) < (down & mask)}))));
        a_carry: assert (step[5:4] == 2'd0 || step[5:4] == 2'd3 || at == 4'd0 ||
                         (pass1_i[1] == (((actual & mask) + (wide & mask)) >> at) &&
                          pass1_i[0] == ((actual & mask) < (wide & mask))));
        a_far: assert (!step[5] || pass1_i[3:2] == {limited > up, limited < down});
        a_pass2: assert (step[5:4] != 2'd2 ||
                         (left == (limited >> at) && (at == 4'd0 || done == (near & mask))));
        a_pass3: assert (step[5:4] != 2'd3 ||
                         (left == (near >> at) && (at == 4'd0 || done == (wanted & mask)) &&
                          pass2_i == {near < LOWEST_Q4, near > HIGHEST_Q4}));
      end
      if (work) begin
        a_hardware2: assert (step[5:4] != 2'd2 || at == 4'd0 ||
                             pass2_i == {done < (LOWEST_Q4 & mask), done > (HIGHEST_Q4 & mask)});
        a_hardware3: assert (step[5:4] != 2'd3 ||
                             (pass2_i == 2'b10 ? done == (LOWEST_Q4 & mask) :
                              pass2_i == 2'b01 ? done == (HIGHEST_Q4 & mask) :
                              pass2_i == 2'b00 && turned >= LOWEST_Q4 && turned <= HIGHEST_Q4));
      end else begin
        a_idle: assert (next_q4_o >= LOWEST_Q4 && next_q4_o <= HIGHEST_Q4);
      end
    end
  end
endmodule

`default_nettype wire
