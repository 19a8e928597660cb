// SPDX-License-Identifier: Apache-2.0
// The bit-serial width equals that of servo_width_model, and its bounds hold for any inputs. The
// registers of one channel, chosen by the solver, are modelled here and change only with restart_i
// or by what is stored; the words of the other channel are free.
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
  localparam [15:0] LOWEST_Q4 = 16'd9600;
  localparam [15:0] HIGHEST_Q4 = 16'd38400;
  localparam [15:0] CENTRE_Q4 = 16'd24000;
  localparam [3:0] STORE = 4'd14;

  // ---- the registers
  (* anyconst *) wire chosen;
  (* anyseq *) wire [15:0] any_target, any_safe, any_min, any_max;
  (* anyseq *) wire [10:0] any_slew;
  reg [15:0] target, safe_q4, min, max, actual;
  reg [10:0] slew;
  reg [15:0] there;
  reg [3:0]  place_before;
  always @* begin
    case (place_before[2:0])
      3'd0: there = target;
      3'd1: there = actual;
      3'd2: there = min;
      3'd3: there = max;
      3'd4: there = safe_q4;
      3'd5: there = {5'd0, slew};
      default: there = word_i;
    endcase
  end
  wire mine = channel_i == chosen;
  always @(posedge clk_i) begin
    place_before <= place_o;
    if (reading_i && mine) assume (word_i == there);
    if (restart_i) begin
      target <= any_target;
      safe_q4 <= any_safe;
      min <= any_min;
      max <= any_max;
      slew <= any_slew;
    end
    if (load_o[chosen]) actual <= next_q4_o;
    if (stored_i) assume (store_o && !restart_i);
  end

  // ---- what should be
  wire [15:0] request = use_safe_i ? safe_q4 : target;
  wire [15:0] value, limit, wanted;
  servo_width_model model (
    .request_i(request), .min_i(min), .max_i(max), .slew_i({5'd0, slew}), .actual_i(actual),
    .which_i(op_i[3:1]), .value_o(value), .limit_o(limit), .next_o(wanted)
  );
  wire [15:0] up = actual + {5'd0, slew};
  wire [15:0] down = actual - {5'd0, slew};

  reg        begun = 1'b0;
  reg        before_restart, before_store, before_stored;
  reg [15:0] before_next;
  reg        loaded, first_done;
  reg [7:0]  quiet;                // clocks since the round began
  wire       start = start_i && !fresh_i;
  wire       done = working_i && op_i == STORE && (stored_i || !(fresh_i || take_i[channel_i]));
  wire       again = restart_i || use_safe_i != safe_i;

  // ---- where the bits are: `at` of this pass are done
  wire [3:0]  at = word_bit_i - 4'd1;
  wire [15:0] mask = (16'd1 << at) - 16'd1;
  wire [15:0] finished = next_q4_o >> (5'd16 - {1'b0, at});
  wire [15:0] left = next_q4_o & (16'hFFFF >> at);
  reg  [15:0] start_value;
  wire [15:0] given = at == 4'd0 ? next_q4_o : start_value;  // the value before this pass
  wire        bits = working_i && op_i < STORE;
  wire        compare = bits && op_i >= 4'd2 && !op_i[0];
  wire        select = bits && op_i >= 4'd2 && op_i[0];
  wire [15:0] bound = op_i >= 4'd10 ? (op_i[2] ? HIGHEST_Q4 : LOWEST_Q4) : limit;
  wire        known = mine || op_i >= 4'd10;                  // is `bound` the right one?

  always @(posedge clk_i) begin
    if (!begun) assume (rst_i);
    begun <= 1'b1;
    before_restart <= (start_i || again) && !rst_i && !fresh_i;
    before_store <= store_o && !rst_i;
    before_stored <= stored_i;
    before_next <= next_q4_o;
    if (bits && at == 4'd0) start_value <= next_q4_o;
    quiet <= rst_i || start || again || done || !busy_i ? 8'd0 : quiet == 8'd255 ? quiet
      : quiet + 8'd1;
    loaded <= !rst_i && !start && (loaded || (load_o[chosen] && !fresh_i));
    first_done <= !rst_i && !start && (first_done || (done && !channel_i));

    if (begun && !rst_i) begin
      // The properties.
      a_hardware_limits: assert (!store_o || (next_q4_o >= LOWEST_Q4 && next_q4_o <= HIGHEST_Q4));
      if (store_o && mine && !fresh_i) begin
        a_next_exact: assert (next_q4_o == wanted);
        a_next_slew: assert (next_q4_o <= up && next_q4_o >= down);
        a_next_limits: assert (!(min <= max && actual >= min && actual <= max)
          || (next_q4_o >= min && next_q4_o <= max)
          || next_q4_o == LOWEST_Q4 || next_q4_o == HIGHEST_Q4);
        a_progress: assert (!(request >= min && request <= max && request >= LOWEST_Q4
          && request <= HIGHEST_Q4) || next_q4_o == request
          || next_q4_o == (request > actual ? up : down));
        a_taken: assert (take_i[channel_i]);
      end
      a_fresh: assert (!fresh_i || next_q4_o == CENTRE_Q4);
      a_store_place: assert (!store_o || place_o == {channel_i, 3'd1});
      a_load: assert (load_o == (store_o && stored_i ? (channel_i ? 2'b10 : 2'b01) : 2'b00));
      a_once_a_frame: assert (!(busy_i && !fresh_i && channel_i <= chosen) || !loaded);
      a_one_after_the_other: assert (!(busy_i && channel_i && !fresh_i) || first_done);
      a_restarts: assert (!before_restart || !store_o);
      a_store_stays: assert (!(before_store && !before_stored && !before_restart) || store_o
        || !take_i[channel_i]);
      a_next_stays: assert (!before_store || next_q4_o == before_next);
      a_soon: assert (!(busy_i && quiet >= 8'd226) || (working_i && op_i == STORE));
      a_idle_place: assert (idle_o == !busy_i && (busy_i || place_o == 4'hF));

      c_stored: cover (stored_i && !fresh_i && mine && next_q4_o != CENTRE_Q4);
      c_safe: cover (stored_i && !fresh_i && mine && use_safe_i && next_q4_o == safe_q4
        && safe_q4 != target);
      // Helps the induction: progress of the calculation.
      a_pass: assert ((pass_i != STORE || bit_at_i == 4'd0) &&
          (fresh_i ? pass_i == STORE && busy_i : !busy_i || pass_i <= STORE));
      a_place: assert (!busy_i || fresh_i || quiet == {pass_i, bit_at_i}
        || (pass_i == STORE && bit_at_i == 4'd0 && quiet >= 8'd224));
      a_reading: assert (!reading_i || (busy_i && (fresh_i || quiet != 8'd0)));
      a_reads: assert (!busy_i || reading_i || (fresh_i ? quiet <= 8'd1 : quiet == 8'd0));
      a_working: assert (!working_i || (reading_i && (fresh_i || quiet > 8'd1)));
      a_works: assert (!reading_i || working_i || quiet <= (fresh_i ? 8'd2 : 8'd1));
      a_word: assert (!reading_i || ((quiet < 8'd225 || word_pass_i == STORE) &&
        (word_pass_i == STORE || fresh_i
        ? word_pass_i == STORE && pass_i == STORE && word_bit_i == 4'd0
        : {pass_i, bit_at_i} == {word_pass_i, word_bit_i} + 8'd1 && word_pass_i < STORE)));
      a_place_before: assert (!reading_i || !mine || (place_before == {channel_i,
        word_pass_i == 4'd1 ? (use_safe_i ? 3'd4 : 3'd0) : word_pass_i[3:1] == 3'd1 ? 3'd2
        : word_pass_i[3:1] == 3'd2 ? 3'd3
        : word_pass_i[3:1] == 3'd3 || word_pass_i[3:1] == 3'd4 ? 3'd5 : 3'd1}));
      a_op: assert (!working_i || (op_i == STORE ? word_pass_i == STORE && word_bit_i == 4'd0
        : word_pass_i == (word_bit_i == 4'd0 ? op_i + 4'd1 : op_i) && last_i == (at == 4'd15)
          && op_i < STORE));
      a_actual: assert ((fresh_i && channel_i <= chosen)
        || (actual >= LOWEST_Q4 && actual <= HIGHEST_Q4));
      if (bits) begin
        a_no_fresh: assert (!fresh_i);
        a_slewing: assert (slewing_i == (op_i >= 4'd6 && op_i <= 4'd9));
        a_carry_0: assert (at != 4'd0 || !carry_i);
        a_replace_0: assert (at != 4'd0 || op_i[0] || !replace_i);
        a_turned: assert (!compare || (finished == (given & mask) && left == (given >> at)));
        a_selected: assert (!select || (finished == ((replace_i ? bound : given) & mask)
          && left == (given >> at)) || !known);
        a_compared: assert (!known || !compare || at == 4'd0 || replace_i == (op_i[1]
          ? (given & mask) < (bound & mask) : (given & mask) > (bound & mask)));
        a_chosen: assert (!known || !select || replace_i
          == (op_i[1] ? given < bound : given > bound));
        a_hardware: assert (op_i < 4'd12 || given >= LOWEST_Q4);
        a_hardware_operand: assert (op_i < 4'd10
          || operand_i == (op_i[2] ? HIGHEST_Q4[at] : LOWEST_Q4[at]));
      end
      if (bits && mine) begin
        a_operand: assert (op_i >= 4'd10 || operand_i == (op_i == 4'd0 ? actual[at]
          : op_i == 4'd1 ? request[at] : slewing_i ? at < 4'd11 && slew[at] : bound[at]));
        a_fetched: assert (op_i != 4'd1 || (replace_i && finished == (request & mask)));
        a_fetching: assert (op_i != 4'd0 || at == 4'd0 || replace_i);
        a_actual_turns: assert ((actual_i >> (5'd16 - {1'b0, at})) == (actual & mask)
          && (op_i == 4'd0 || (actual_i & (16'hFFFF >> at)) == (actual >> at)));
        a_value: assert (op_i < 4'd2 || given == value);
        a_carry: assert (!slewing_i || carry_i == (op_i[1]
          ? (actual & mask) < ({5'd0, slew} & mask)
          : (((actual & mask) + ({5'd0, slew} & mask)) >> at) == 16'd1));
      end
      a_at_store: assert (!(working_i && op_i == STORE && !fresh_i)
        || (next_q4_o >= LOWEST_Q4 && next_q4_o <= HIGHEST_Q4 && (!mine || next_q4_o == wanted)));
    end
  end
endmodule

`default_nettype wire
