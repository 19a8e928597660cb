// SPDX-License-Identifier: Apache-2.0
// The router, seen from the DSP's bus and from each branch. `value` at the end of a clock is the
// bit on the DSP's bus (a_value_is_the_line); everything else is counted here independently of the
// RTL.
`default_nettype none

module i2c_router_properties (
  input wire       clk_i,
  input wire       rst_i,
  input wire       tick_ms_i,
  input wire       enable_i,
  input wire [1:0] clear_i,
  input wire [1:0] bypass_i,
  input wire       scl_i,
  input wire       sda_i,
  input wire       start_i,
  input wire       stop_i,
  input wire       sda_low_o,
  input wire [1:0] branch_scl_i,
  input wire [1:0] branch_sda_i,
  input wire [1:0] scl_low_i,
  input wire [1:0] sda_low_i,
  input wire [1:0] branch_scl_low_o,
  input wire [1:0] branch_sda_low_o,
  input wire [1:0] clearing_o,
  input wire       error_o,
  input wire       stretch_o,
  input wire       timeout_o,
  input wire       scl_q_i,
  input wire       up_i,
  input wire [4:0] count_i,
  input wire [3:0] bit_i,
  input wire       addressing_i,
  input wire       match_i,
  input wire       address1_i,
  input wire       reading_i,
  input wire       failed_i,
  input wire       value_i,
  input wire [1:0] attached_i,
  input wire [1:0] selected_i,
  input wire [1:0] bypass_q_i,
  input wire [4:0] still_ms_i,
  input wire       clear_scl_low_i,
  input wire       clear_sda_low_i,
  input wire       clear_busy_i
);
  reg        begun = 1'b0;
  reg        reset = 1'b1;
  wire       fall = up_i && !scl_i;

  // ---- the transfer as the DSP's bus shows it
  reg [3:0]  pos;                   // bit of the byte; 15 from START to the first fall of SCL
  reg        first_byte;
  reg [7:0]  address;               // and R/W
  reg        reads;                 // the data goes to the master now
  reg [1:0]  bypass;
  wire [6:0] called = address[7:1];
  wire [1:0] meant = bypass | {called == 7'h5E || called == 7'h5D,
                               called == 7'h5C || called == 7'h5D};
  wire [6:0] called6 = {address[5:0], value_i};      // at bit 6
  wire [1:0] meant6 = bypass | {called6 == 7'h5E || called6 == 7'h5D,
                                called6 == 7'h5C || called6 == 7'h5D};
  wire       answers = (pos == 4'd8) ? (first_byte || !reads) : (reads && !first_byte);

  // ---- time since SCL moved
  reg        sda;
  reg [4:0]  low_clocks;            // of scl_i, this clock not counted
  wire       scl = (low_clocks == 5'd0);      // in the clock before
  wire       tracked = (low_clocks > 5'd5);   // SDA was copied in this low time
  reg [5:0]  still_ms;

  reg        long_still;            // one clock after 31 ticks
  reg        told;
  reg        start, stop, ms, upper, answer_low, was_fall, left, enable;
  reg [1:0]  attached, branch_low, scl_low;
  reg [4:0]  count;

  always @(posedge clk_i) begin
    if (!begun) assume (rst_i);
    if (!rst_i) begin
      // bus_condition
      assume (!start_i || (scl_i && !sda_i && scl));
      assume (!stop_i || (scl_i && sda_i && scl));
    end
    begun <= 1'b1;
    reset <= rst_i;
    sda <= sda_i;
    start <= start_i;
    stop <= stop_i;
    ms <= tick_ms_i;
    upper <= up_i;
    answer_low <= sda_low_o;
    was_fall <= fall;
    enable <= enable_i;
    attached <= attached_i;
    scl_low <= scl_low_i;
    branch_low <= ~branch_sda_i;
    count <= count_i;
    low_clocks <= (rst_i || scl_i) ? 5'd0 : (low_clocks == 5'd31) ? low_clocks : low_clocks + 5'd1;
    still_ms <= (rst_i || scl_i != scl || start_i) ? 6'd0 :
                (tick_ms_i && still_ms != 6'd63) ? still_ms + 6'd1 : still_ms;
    long_still <= !rst_i && still_ms >= 6'd31;
    told <= timeout_o && !rst_i;
    left <= stop_i || (start_i && !up_i) || (scl_i && !scl && low_clocks < 5'd21);

    if (rst_i) begin
      pos <= 4'd15;
      first_byte <= 1'b0;
      reads <= 1'b0;
      bypass <= 2'd0;
      address <= 8'd0;
    end else if (start_i) begin
      pos <= 4'd15;
      first_byte <= 1'b1;
      reads <= 1'b0;
      bypass <= bypass_i;
    end else if (fall) begin
      pos <= (pos == 4'd8) ? 4'd0 : pos + 4'd1;
      if (first_byte && pos < 4'd8) address <= {address[6:0], value_i};
      if (first_byte && pos == 4'd7) reads <= value_i;
      if (pos == 4'd8) begin
        first_byte <= 1'b0;
        if (!first_byte && value_i) reads <= 1'b0;
      end
    end

    if (begun && !rst_i && !reset) begin
      // ---- the DSP's bus
      a_value_is_the_line: assert (!(scl_i && !scl && tracked) || value_i == sda);
      a_low_only_to_answer: assert (!(sda_low_o && (scl || tracked)) ||
                                    (answers && (meant & attached_i) != 2'd0));
      a_low_let_go: assert (!sda_low_o || up_i || low_clocks <= 5'd5 || answers);
      a_answer_late: assert (!(sda_low_o && !answer_low) || low_clocks > 5'd20);
      a_too_fast_no_part: assert (!left || attached_i == 2'd0);
      a_still_while_high: assert (!(scl && scl_i && sda_low_o) || answer_low);
      a_never_from_both_sides: assert (!(sda_low_o && sda_low_i != 2'd0));
      a_acknowledge_of_all: assert (!(sda_low_o && !answer_low) ||
                                    (reads && selected_i[0] ? branch_low[0] :
                                     (selected_i & ~branch_low) == 2'd0 && selected_i != 2'd0));
      a_failed_says_nothing: assert (!(sda_low_o && !answer_low) || !failed_i);

      // ---- bounds
      a_released_in_time: assert (!(still_ms >= 6'd31 && long_still) ||
                                  (scl_low_i == 2'd0 && !sda_low_o && attached_i == 2'd0));
      a_sda_released_in_time: assert (!(ms && attached == 2'd0 && attached_i == 2'd0 &&
                                        scl_low == 2'd0 && !start && !left) || sda_low_i == 2'd0);
      a_timeout_told: assert (timeout_o == (attached_i != 2'd0 && tick_ms_i &&
                                            still_ms == 6'd30 && scl_i == scl));

      // ---- events
      a_error: assert (error_o == (fall && pos == 4'd8 && (first_byte || !reads) && value_i &&
                                   selected_i != 2'd0));
      a_stretch: assert (stretch_o == (fall && (attached_i & ~branch_scl_i) != 2'd0));

      c_takes_part: cover (attached_i == 2'b11);
      c_clears: cover (clear_busy_i && branch_scl_low_o == 2'b11);

      // Helps the induction.
      a_same_place: assert (pos == bit_i && first_byte == addressing_i && reads == reading_i &&
                            bypass == bypass_q_i && scl == scl_q_i && (pos <= 4'd8 || pos == 4'd15)
                            && !(pos == 4'd15 && reads) &&
                            (pos != 4'd15 || first_byte || attached_i == 2'd0));
      a_match: assert (!first_byte || pos == 4'd15 || pos == 4'd0 ||
          match_i == (pos == 4'd1 ? address[0] == 1'b1 : pos == 4'd2 ? address[1:0] == 2'b10 :
                      pos == 4'd3 ? address[2:0] == 3'b101 : pos == 4'd4 ? address[3:0] == 4'b1011 :
                      pos == 4'd5 ? address[4:0] == 5'b10111 :
                      pos == 4'd6 ? address[5:1] == 5'b10111 :
                      pos == 4'd7 ? address[6:2] == 5'b10111 : address[7:3] == 5'b10111));
      a_sixth: assert (!(first_byte && pos == 4'd6) || address1_i == address[0]);
      a_match_begins: assert (!(first_byte && (pos == 4'd15 || pos == 4'd0)) || match_i);
      a_selected: assert (first_byte && (pos < 4'd7 || pos == 4'd15) ? selected_i == 2'd0 :
                          (attached_i & ~selected_i & ~{2{first_byte}}) == 2'd0);
      a_selected_meant: assert (first_byte ?
          (pos != 4'd7 || (selected_i & ~(bypass | {address[6:0] == 7'h5E || address[6:0] == 7'h5D,
                           address[6:0] == 7'h5C || address[6:0] == 7'h5D})) == 2'd0) &&
          (pos != 4'd8 || (selected_i & ~meant) == 2'd0) : attached_i == 2'd0 ||
          (selected_i & ~meant) == 2'd0);
      a_count: assert (scl ? (up_i || count_i <= 5'd2) && (count_i <= 5'd1 || pos == 4'd15) &&
                       count_i <= 5'd15 :
                       count_i == (low_clocks > 5'd20 ? 5'd20 : low_clocks - 5'd1));
      a_answers_attached: assert (!sda_low_o || (attached_i & selected_i) != 2'd0);
      a_selected_attached: assert (attached_i == 2'd0 || (selected_i & ~attached_i) == 2'd0);
      a_alone: assert (attached_i == 2'd0 || (sda_low_i & ~attached_i) == 2'd0);
      a_clearing: assert (!clear_busy_i || clearing_o != 2'd0);
      a_up: assert (!up_i || scl);
      a_still: assert (attached_i == 2'd0 || (still_ms == {1'b0, still_ms_i} &&
                                              still_ms_i <= 5'd30));
      a_told_released: assert (!told || (attached_i == 2'd0 && !sda_low_o));
    end
  end

  // ---- as each branch sees it
  wire tell = begun && !rst_i && !reset;
  genvar k;
  generate
    for (k = 0; k < 2; k = k + 1) begin : branch
      i2c_branch_properties view (
        .clk_i(clk_i), .rst_i(rst_i), .tell_i(tell), .scl_low_i(branch_scl_low_o[k]),
        .sda_low_i(branch_sda_low_o[k]), .attached_i(attached_i[k]), .meant_i(meant[k]),
        .selected_i(selected_i[k]), .bypass_i(bypass[k]), .value_i(value_i), .pos_i(pos),
        .first_byte_i(first_byte), .answers_i(answers), .up_i(up_i), .upper_i(upper),
        .settled_i(tracked || scl),
        .low_clocks_i(low_clocks > 5'd15 ? 4'd15 : low_clocks[3:0]), .count_i(count),
        .start_i(start),
        .stop_i(stop), .ms_i(ms), .enable_i(enable), .address_i(address),
        .clearing_i(clearing_o[k]), .own_scl_low_i(scl_low_i[k]), .own_sda_low_i(sda_low_i[k]),
        .clear_scl_low_i(clear_scl_low_i), .clear_sda_low_i(clear_sda_low_i),
        .clear_busy_i(clear_busy_i), .meant6_i(meant6[k])
      );
    end
  endgenerate
endmodule

`default_nettype wire
