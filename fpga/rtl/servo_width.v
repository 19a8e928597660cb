// SPDX-License-Identifier: Apache-2.0
// The next width of a servo pulse: request -> limits -> slew limit -> hardware limits.
//
// Worked out bit by bit, least significant first, over one shift register (with 16 bits at once it
// needs twice the LUTs). A round takes 64 clocks, in step with step_i; it begins after anything
// has changed, and again if something changes while it runs:
//
//   changed_i  __|'|______________________________________________
//   step_i     ... 62 | 63 | 0 .. 15 | 16 .. 31 | 32 .. 47 | 48 .. 63 | 0
//   pass                   |    0    |    1     |     2    |     3    |
//   ready_o    '''|_____________________________________________________|''''
//
//   pass 0  compare the request (target or safe position) with both limits, and these
//   pass 1  put the limit in its place; compare with actual + slew and actual - slew
//   pass 2  put that in its place; compare with the hardware limits
//   pass 3  put the hardware limit in its place
//
// If min > max, max counts. The slew has 11 bits (up to 127.9 us a frame, twice what the servo can
// follow), so neither sum can leave 16 bits. The hardware limits come last and are compared with
// what is in the register itself: no input, however it changes, brings next_q4_o outside them.
//
// changed_i must be high in the clock in which an input takes a new value, or in the one before.
// (safe_i is watched here, it needs no changed_i.)
//
// Latency: at most 129 clocks from changed_i to ready_o.
`default_nettype none

module servo_width (
  input  wire        clk_i,
  input  wire        rst_i,
  input  wire [5:0]  step_i,        // from servo_frame
  input  wire        changed_i,
  input  wire        safe_i,        // the request is the safe position
  input  wire [15:0] target_q4_i,
  input  wire [15:0] safe_q4_i,
  input  wire [15:0] min_q4_i,
  input  wire [15:0] max_q4_i,
  input  wire [10:0] slew_q4_i,
  input  wire [15:0] actual_q4_i,
  output wire        ready_o,
  output wire [15:0] next_q4_o      // good while ready_o
);
  localparam [15:0] LOWEST_Q4 = 16'd9600;    // 600 us
  localparam [15:0] HIGHEST_Q4 = 16'd38400;  // 2400 us
  localparam [15:0] CENTRE_Q4 = 16'd24000;   // 1500 us

  reg        dirty;                          // something changed since the last round began
  reg        running;
  reg        use_safe;
  reg [15:0] next;

  wire [3:0] place = step_i[3:0];
  wire       last_step = (step_i == 6'd63);
  wire       changed = changed_i || (use_safe != safe_i);
  wire [15:0] slew_wide = {5'd0, slew_q4_i};

  // The bits in work, one clock behind step_i.
  reg [1:0]  pass;
  reg        working;
  reg        first;
  reg        target_bit, safe_bit, min_bit, max_bit, actual_bit, slew_bit;
  reg        lowest_bit, highest_bit;

  // What the passes leave for the next one.
  reg        below, above, crossed;          // request < min, request > max, min > max
  reg        far_up, far_down;               // more than the slew away
  reg        too_low, too_high;
  reg        carry, borrow;

  wire request_bit = use_safe ? safe_bit : target_bit;
  wire carry_in = carry && !first;
  wire borrow_in = borrow && !first;
  wire up_bit = actual_bit ^ slew_bit ^ carry_in;
  wire down_bit = actual_bit ^ slew_bit ^ borrow_in;
  wire use_max = above || (below && crossed);
  reg  value;

  always @* begin
    case (pass)
      2'd0: value = request_bit;
      2'd1: value = use_max ? max_bit : below ? min_bit : next[0];
      2'd2: value = far_up ? up_bit : far_down ? down_bit : next[0];
      default: value = too_low ? lowest_bit : too_high ? highest_bit : next[0];
    endcase
  end

  always @(posedge clk_i or posedge rst_i) begin
    if (rst_i) begin
      dirty <= 1'b1;
      running <= 1'b0;
      use_safe <= 1'b0;
      pass <= 2'd0;
      working <= 1'b0;
      first <= 1'b0;
      target_bit <= 1'b0;
      safe_bit <= 1'b0;
      min_bit <= 1'b0;
      max_bit <= 1'b0;
      actual_bit <= 1'b0;
      slew_bit <= 1'b0;
      lowest_bit <= 1'b0;
      highest_bit <= 1'b0;
    end else begin
      dirty <= changed || (dirty && !last_step);
      if (last_step) begin
        running <= dirty;
      end
      use_safe <= safe_i;
      pass <= step_i[5:4];
      working <= running;
      first <= (place == 4'd0);
      target_bit <= target_q4_i[place];
      safe_bit <= safe_q4_i[place];
      min_bit <= min_q4_i[place];
      max_bit <= max_q4_i[place];
      actual_bit <= actual_q4_i[place];
      slew_bit <= slew_wide[place];
      lowest_bit <= LOWEST_Q4[place];
      highest_bit <= HIGHEST_Q4[place];
    end
  end

  always @(posedge clk_i or posedge rst_i) begin
    if (rst_i) begin
      next <= CENTRE_Q4;
      below <= 1'b0;
      above <= 1'b0;
      crossed <= 1'b0;
      far_up <= 1'b0;
      far_down <= 1'b0;
      too_low <= 1'b0;
      too_high <= 1'b0;
      carry <= 1'b0;
      borrow <= 1'b0;
    end else begin
      if (working) begin
        next <= {value, next[15:1]};
      end
      carry <= (actual_bit && slew_bit) || (carry_in && (actual_bit || slew_bit));
      borrow <= (!actual_bit && slew_bit) || (borrow_in && (!actual_bit || slew_bit));
      if (pass == 2'd0) begin
        below <= (request_bit == min_bit) ? (below && !first) : min_bit;
        above <= (request_bit == max_bit) ? (above && !first) : request_bit;
        crossed <= (min_bit == max_bit) ? (crossed && !first) : min_bit;
      end
      if (pass == 2'd1) begin
        far_up <= (value == up_bit) ? (far_up && !first) : value;
        far_down <= (value == down_bit) ? (far_down && !first) : down_bit;
      end
      if (pass == 2'd2) begin
        too_low <= (value == lowest_bit) ? (too_low && !first) : lowest_bit;
        too_high <= (value == highest_bit) ? (too_high && !first) : value;
      end
    end
  end

  assign ready_o = !dirty && !running && !working;
  assign next_q4_o = next;

`ifdef FORMAL
  servo_width_properties properties (
    .clk_i(clk_i), .rst_i(rst_i), .step_i(step_i), .changed_i(changed_i), .safe_i(safe_i),
    .target_q4_i(target_q4_i), .safe_q4_i(safe_q4_i), .min_q4_i(min_q4_i), .max_q4_i(max_q4_i),
    .slew_q4_i(slew_q4_i), .actual_q4_i(actual_q4_i), .ready_o(ready_o), .next_q4_o(next_q4_o),
    .dirty_i(dirty), .running_i(running), .working_i(working), .use_safe_i(use_safe),
    .pass_i(pass), .first_i(first),
    .bits_i({target_bit, safe_bit, min_bit, max_bit, actual_bit, slew_bit, lowest_bit,
             highest_bit}),
    .pass0_i({below, above, crossed}), .pass1_i({far_up, far_down, carry, borrow}),
    .pass2_i({too_low, too_high})
  );
`endif
endmodule

`default_nettype wire
