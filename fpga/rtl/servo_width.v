// SPDX-License-Identifier: Apache-2.0
// The next width of the pulses of both servos, one after the other: request -> limits -> slew limit
// -> hardware limits.
//
// Worked out after the first microsecond of a frame, while the pulses are high but cannot end yet,
// bit by bit, least significant first, from registers in the register file's memory:
//
//   start_i     _|'|__________________________________________________
//   channel          |           0                  |        1
//   pass             | 0  | 1  | 2  | .. | 12 | 13 |14| 0  | .. | 13 |14|     16 clocks each
//   store_o     _____________________________________|'|_______________|'|__
//
//   pass 0        fetch the actual width
//   pass 1        fetch the request (target or safe position)
//   pass 2, 3     compare it with MIN, put MIN in its bit_at if it is below
//   pass 4, 5     the same with MAX, if it is above (so MAX counts if MIN > MAX)
//   pass 6, 7     with actual - SLEW     pass 8, 9     with actual + SLEW
//   pass 10, 11   with 600 us            pass 12, 13   with 2400 us
//   pass 14       store
//
// The slew has 11 bits (up to 127.9 us a frame, twice what the servo can follow), so neither sum
// can leave 16 bits. The hardware limits come last and are compared with what is in the register
// itself: no input, however it changes, brings a width outside them that is stored.
//
// restart_i must be high in the clock in which a register changes, or before one in which word_i is
// not the register that place_o was; the channel restarts. (safe_i is watched here.) take_i: the
// width of the channel may change now; if not, nothing is stored. store_o stays until stored_i
// answers in the same clock; load_o is this moment for each channel. next_q4_o stays for one more
// clock.
// After reset both words ACTUAL_Q4 are stored once, with the centre; start_i counts after that.
//
// Latency: 228 clocks a channel.
`default_nettype none

module servo_width (
  input  wire        clk_i,
  input  wire        rst_i,
  input  wire        start_i,
  input  wire        restart_i,
  input  wire        safe_i,        // the request is the safe position
  input  wire [1:0]  take_i,
`ifdef PROVE_MOTION
  output wire        fresh_o,
`endif
  output wire        idle_o,
  output wire [3:0]  place_o,       // of a register; the servo period's while idle
  input  wire [15:0] word_i,        // the word there, one clock later
  output wire        store_o,       // next_q4_o is to be stored at place_o
  input  wire        stored_i,
  output wire [1:0]  load_o,
  output wire [15:0] next_q4_o
);
  localparam [15:0] LOWEST_Q4 = 16'd9600;    // 600 us
  localparam [15:0] HIGHEST_Q4 = 16'd38400;  // 2400 us
  localparam [15:0] CENTRE_Q4 = 16'd24000;   // 1500 us
  localparam [3:0] STORE = 4'd14;
  localparam [2:0] TARGET = 3'd0;            // places of the registers
  localparam [2:0] ACTUAL = 3'd1;
  localparam [2:0] MIN = 3'd2;
  localparam [2:0] MAX = 3'd3;
  localparam [2:0] SAFE = 3'd4;
  localparam [2:0] SLEW = 3'd5;

  // ---- progress
  reg        busy;
  reg        fresh;                          // the centre is to be stored
  reg        channel;
  reg [3:0]  pass;
  reg [3:0]  bit_at;
  reg        use_safe;

  // The word that is there, one clock behind.
  reg        reading;
  reg [3:0]  word_pass;
  reg [3:0]  word_bit;

  // The bit in work, two clocks behind.
  reg        working;
  reg [3:0]  op;
  reg        last;
  reg        slewing;
  reg        operand;

  wire storing = working && op == STORE;
  wire take = fresh || take_i[channel];
  wire done = storing && (stored_i || !take);
  wire start = start_i && !fresh;
  wire restart = restart_i || use_safe != safe_i;
  wire goes_on = !done && !start && (fresh || !restart);
  assign store_o = storing && take;
  assign load_o = {channel, !channel} & {2{store_o && stored_i}};

  always @(posedge clk_i or posedge rst_i) begin
    if (rst_i) begin
      busy <= 1'b1;
      fresh <= 1'b1;
      channel <= 1'b0;
      pass <= STORE;
      bit_at <= 4'd0;
      use_safe <= 1'b0;
    end else begin
      use_safe <= safe_i;
      busy <= start || (busy && !(done && channel));
      fresh <= fresh && !(done && channel);
      channel <= !start && (channel || done);
      bit_at <= start || restart || pass == STORE ? 4'd0 : bit_at + 4'd1;
      if (!fresh) begin
        if (start_i || restart || done) pass <= 4'd0;
        else if (bit_at == 4'd15) pass <= pass + 4'd1;
      end
    end
  end

  reg [2:0] register;
  always @* begin
    case (pass)
      4'd1: register = use_safe ? SAFE : TARGET;
      4'd2, 4'd3: register = MIN;
      4'd4, 4'd5: register = MAX;
      4'd6, 4'd7, 4'd8, 4'd9: register = SLEW;
      default: register = ACTUAL;
    endcase
  end
  assign idle_o = !busy;
  assign place_o = {channel, register} | {4{!busy}};

  // ---- bit by bit
  reg [15:0] next;
  reg [15:0] actual;
  reg        replace;                        // put the limit in the bit_at of what is there
  reg        carry;                          // or borrow

  wire select = op[0];
  wire lower = op[1];                        // the limit is a lower one
  wire at_most = actual[0] ^ operand ^ carry;
  wire limit = slewing ? at_most : operand;
  wire beyond = limit == next[0] ? replace : lower ? limit : next[0];
  wire carry_on = (operand && (carry || (actual[0] ^ lower))) || (carry && (actual[0] ^ lower));
  wire hardware = word_pass[3] && (word_pass[2] || word_pass[1]);
  wire hardware_bit = word_pass[2] ? HIGHEST_Q4[word_bit] : LOWEST_Q4[word_bit];

  always @(posedge clk_i or posedge rst_i) begin
    if (rst_i) begin
      reading <= 1'b0;
      word_pass <= 4'd0;
      word_bit <= 4'd0;
      working <= 1'b0;
      op <= 4'd0;
      last <= 1'b0;
      slewing <= 1'b0;
      operand <= 1'b0;
      next <= CENTRE_Q4;
      actual <= 16'd0;
      replace <= 1'b0;
      carry <= 1'b0;
    end else begin
      reading <= busy && goes_on;
      word_pass <= pass;
      word_bit <= bit_at;
      working <= reading && goes_on;
      op <= word_pass;
      last <= word_bit == 4'd15;
      slewing <= word_pass[3:1] == 3'd3 || word_pass[3:1] == 3'd4;
      operand <= hardware ? hardware_bit : word_i[word_bit];
      carry <= working && !last && carry_on;
      replace <= working && (op == 4'd0 || (select ? replace && !last : beyond));
      if (working && !storing) begin
        next <= {select && replace ? limit : next[0], next[15:1]};
        actual <= {op == 4'd0 ? operand : actual[0], actual[15:1]};
      end
    end
  end

  assign next_q4_o = next;

`ifdef PROVE_MOTION
  assign fresh_o = fresh;
`endif
`ifdef FORMAL
  servo_width_properties properties (
    .clk_i(clk_i), .rst_i(rst_i), .start_i(start_i), .restart_i(restart_i), .safe_i(safe_i),
    .take_i(take_i), .idle_o(idle_o), .place_o(place_o), .word_i(word_i), .store_o(store_o),
    .stored_i(stored_i), .load_o(load_o), .next_q4_o(next_q4_o),
    .busy_i(busy), .fresh_i(fresh), .channel_i(channel), .pass_i(pass), .bit_at_i(bit_at),
    .use_safe_i(use_safe),
    .reading_i(reading), .word_pass_i(word_pass), .word_bit_i(word_bit), .working_i(working),
    .op_i(op), .last_i(last), .slewing_i(slewing),
    .operand_i(operand), .actual_i(actual), .replace_i(replace), .carry_i(carry)
  );
`endif
endmodule

`default_nettype wire
