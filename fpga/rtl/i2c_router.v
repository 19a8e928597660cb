// SPDX-License-Identifier: Apache-2.0
// Two sensors with the same I2C address, each on a branch of its own, under two addresses of the
// DSP's bus:
//
//   DSP's bus  0x5C 1011100  left      0x5E 1011110  right      0x5D 1011101  both
//   branches        10111 0 s     s = 1 (0x5D, the sensor's own) if the branch is meant, else 0
//
// START and the first five address bits go to both branches as they are. The sixth bit is sent as 0
// and the seventh as s, so a branch that is not meant sees 0x5C, or another address that differs
// from 0x5D. A branch that is not meant gets no clocks after the address byte: its lines stay
// released until the next START. A broadcast is acknowledged if both sensors acknowledge; a
// broadcast read is answered by the left one.
//
//              __________|bit n|_________|bit n+1|________
//   scl_i      ____________|''''''|________|''''''|____
//   branch scl _______________|'''|___________|'''|____     falls at once, rises later
//   sda, value --------X==================X=============     moves in between only
//                            >|--|<  RISE clocks     |-->|  HOLD clocks
//
// Data is copied while SCL is low, and is stable from the rise of scl_i on. Which way it goes
// follows from the count of bits and from R/W alone, never from levels, so that the two sides
// cannot hold each other down. What would be an edge of SDA on the other side with SCL high is
// made of START and STOP only. If the branch is at a bit that was forced to 0 when START comes,
// its SDA must rise first: the branch then sees STOP, and START 9 clocks later.
//
// A sensor that holds SDA, or does not acknowledge, is answered for with "not acknowledged" and
// counted (error_o). A sensor that holds SCL is not waited for, only counted (stretch_o). If
// scl_i does not move for 30 to 31 ms in a transfer, all lines are released until the next START:
// the branch's SDA 1 ms after the others, so that the sensor sees STOP. i2c_bus_clear frees a
// branch when clear_i asks for it, after such a silence, and both after reset: then a sensor may
// hold SDA for a bit whose clock never came to an end. It waits until no transfer goes there,
// takes 105 us, and until then the branch gets no START (not acknowledged).
//
// bypass_i: this branch gets all addresses unchanged, and its answers go to the DSP's bus.
//
// Timing, clk_i at 25 MHz (40 ns), with filters of 5 clocks (2 + 3 samples) on all lines:
//   scl falls -> branch scl falls    6 clocks   240 ns
//   scl rises -> branch scl rises    8 clocks   320 ns   the branch's high time is 80 ns shorter
//   sda -> branch sda                6 clocks   set-up of data on the branch: that of the master
//                                               + 80 ns - 40 ns (sampling)
//   branch scl falls -> data moves   5 clocks   200 ns of hold
//   branch sda -> sda                6 clocks   240 ns
//   scl falls -> answer on sda      12 clocks   480 ns + tVD of the sensor, but 26 clocks (1040 ns)
//                                               at least: what the branch shows before may be the
//                                               last bit of the other direction, rising slowly
//   START, STOP -> branch           10 clocks   4 of them to be sure that it is one; its hold time
//                                               is 160 ns shorter on the branch
// 400 kHz (low 1300 ns): the sensor has 1300 - 480 - 100 (set-up) - rise = ~600 ns for its answer;
// fast mode allows it 900, 350 are typical. High times should be >= 680 ns at the master, and the
// hold time of START >= 800 (with 40 of sampling), so that the branch gets 600.
// 100 kHz: margins above 3 us. The DSP's bus may run at 1 MHz to other devices: with a low time of
// less than 21 clocks (840 ns) the branches take no further part until the next START, and nothing
// is answered for them.
`default_nettype none

module i2c_router (
  input  wire       clk_i,
  input  wire       rst_i,
  input  wire       tick_us_i,
  input  wire       tick_ms_i,
  input  wire       enable_i,          // 0: no START goes to the branches
  input  wire [1:0] bypass_i,
  input  wire [1:0] clear_i,           // one clock: free this branch

  input  wire       scl_i,             // DSP's bus, filtered
  input  wire       sda_i,
  input  wire       start_i,           // from bus_condition
  input  wire       stop_i,
  output wire       sda_low_o,

  input  wire [1:0] branch_scl_i,      // 0 left, 1 right; filtered
  input  wire [1:0] branch_sda_i,
  output wire [1:0] branch_scl_low_o,
  output wire [1:0] branch_sda_low_o,

  output wire [1:0] clearing_o,
  output wire       error_o,           // one clock each
  output wire       stretch_o,
  output wire       timeout_o
);
  localparam [4:0] RISE = 5'd1;
  localparam [4:0] HOLD = 5'd4;
  localparam [4:0] ANSWER = 5'd20;
  localparam [4:0] AFTER_START = 5'd2;
  localparam [4:0] START_AGAIN = 5'd10;
  localparam [4:0] SETTLED = 5'd15;
  localparam [3:0] BEFORE_FIRST = 4'd15;
  localparam [3:0] ACKNOWLEDGE = 4'd8;
  localparam [4:0] LAST_MS = 5'd30;

  // ---- edges of the DSP's SCL, and the time since
  reg        scl;
  reg        up;                       // the branches' SCL is high too
  reg [4:0]  count;
  wire       high_settled = scl_i && scl && (count != 5'd0);
  wire       track = !scl_i && !scl && (count >= HOLD);
  wire       fall = up && !scl_i;
  wire       too_short = scl_i && !scl && (count != ANSWER);  // no time to answer in this low
  wire       counted = scl_i ? (count == RISE) || (count == SETTLED) : (count == ANSWER);

  always @(posedge clk_i or posedge rst_i) begin
    if (rst_i) begin
      scl <= 1'b1;
      up <= 1'b1;
      count <= RISE;
    end else begin
      scl <= scl_i;
      up <= scl_i && (up || high_settled);
      if (scl_i != scl) begin
        count <= 5'd0;
      end else if (start_i) begin
        count <= AFTER_START;
      end else if (!counted) begin
        count <= count + 5'd1;
      end
    end
  end

  // ---- state of the transfer
  reg [3:0]  bit_index;                // of the byte; 8: acknowledge
  reg        addressing;
  reg        match;                    // the five bits so far are those of the sensors
  reg        address1;                 // the sixth
  reg        reading;
  reg        failed;                   // a branch did not follow: no more acknowledge
  reg        value;                    // of this bit on the DSP's bus
  reg [1:0]  bypass;
  reg [1:0]  attached;                 // the branch takes part
  reg [1:0]  selected;                 // and is the one meant
  reg [1:0]  scl_low;
  reg [1:0]  sda_low;
  reg        answer_low;
  reg [1:0]  clearing;
  reg [4:0]  still_ms;
  wire       clear_done;

  wire at_acknowledge = (bit_index == ACKNOWLEDGE);
  wire before_first = (bit_index == BEFORE_FIRST);
  wire to_master = at_acknowledge ^ (reading && !addressing);
  wire bit6 = addressing && (bit_index == 4'd6);
  wire timeout = tick_ms_i && (still_ms == LAST_MS) && (scl_i == scl);
  wire leave = stop_i || timeout || too_short || (start_i && !up);

  // What a branch is to see of this bit.
  wire [1:0] meant = {match && (address1 ^ sda_i), match && !address1};
  wire       force5 = addressing && (bit_index == 4'd5);
  wire [1:0] branch_bit = (bypass & {2{sda_i}}) |
                          (~bypass & (bit6 ? meant : {2{sda_i && !force5}}));

  // What the branches answer.
  wire [1:0] low = ~branch_sda_i;
  wire       answer = (selected != 2'd0) && !failed && (low[0] || !selected[0]) &&
                      (low[1] || !selected[1] || (reading && selected[0]));

  wire [1:0] not_followed = attached & ~sda_low & low & {2{!to_master}} &
                            (bit6 ? ~bypass : selected);
  wire [1:0] stays = attached & ({2{!(at_acknowledge && addressing)}} | selected) &
                     ({2{!before_first}} | sda_low);

  always @(posedge clk_i or posedge rst_i) begin
    if (rst_i) begin
      bit_index <= BEFORE_FIRST;
      addressing <= 1'b0;
      match <= 1'b0;
      address1 <= 1'b0;
      reading <= 1'b0;
      failed <= 1'b0;
      selected <= 2'd0;
      bypass <= 2'd0;
    end else if (start_i) begin
      bit_index <= BEFORE_FIRST;
      addressing <= 1'b1;
      match <= 1'b1;
      reading <= 1'b0;
      failed <= 1'b0;
      selected <= 2'd0;
      bypass <= bypass_i;
    end else if (fall) begin
      bit_index <= at_acknowledge ? 4'd0 : bit_index + 4'd1;
      failed <= failed || (not_followed != 2'd0);
      if (at_acknowledge) begin
        addressing <= 1'b0;
        reading <= reading && (addressing || !value);
      end
      if (addressing && !before_first) begin
        if (bit_index < 4'd5) begin
          match <= match && (value == (bit_index != 4'd1));
        end
        if (bit_index == 4'd5) begin
          address1 <= value;
        end
        if (bit6) begin
          selected <= attached & (bypass | ~sda_low);
        end
        if (bit_index == 4'd7) begin
          reading <= value;
        end
      end
    end
  end

  always @(posedge clk_i or posedge rst_i) begin
    if (rst_i) begin
      value <= 1'b1;
      attached <= 2'd0;
      scl_low <= 2'd0;
      sda_low <= 2'd0;
      answer_low <= 1'b0;
    end else begin
      if (track) begin
        value <= sda_i;
      end
      if (leave) begin
        attached <= 2'd0;
        sda_low <= sda_low & {2{!(stop_i && up)}};
        answer_low <= 1'b0;
      end else if (start_i) begin
        attached <= {2{enable_i}} & ~clearing;
        sda_low <= {2{enable_i}} & ~clearing & ~sda_low;
        answer_low <= 1'b0;
      end else if (fall && (attached != 2'd0)) begin
        attached <= stays;
      end else if (track && (attached != 2'd0)) begin
        sda_low <= attached & ~branch_bit & {2{!to_master}};
        answer_low <= to_master && ((count == ANSWER) ? answer : answer_low);
      end else if (up && (count == START_AGAIN)) begin
        sda_low <= attached;
      end else if (tick_ms_i && ((attached | scl_low) == 2'd0)) begin
        sda_low <= 2'd0;
      end
      if (fall) begin
        scl_low <= stays;
      end else if (high_settled) begin
        scl_low <= 2'd0;
      end else begin
        scl_low <= scl_low & attached;
      end
    end
  end

  // ---- nothing moves: release
  always @(posedge clk_i or posedge rst_i) begin
    if (rst_i) begin
      still_ms <= 5'd0;
    end else if ((scl_i != scl) || start_i || (attached == 2'd0)) begin
      still_ms <= 5'd0;
    end else if (tick_ms_i) begin
      still_ms <= still_ms + 5'd1;
    end
  end

  // ---- bus clear
  wire clear_scl_low, clear_sda_low, clear_busy;

  i2c_bus_clear bus_clear (
    .clk_i(clk_i), .rst_i(rst_i), .tick_us_i(tick_us_i),
    .go_i((clearing != 2'd0) && ((clearing & (attached | scl_low | sda_low)) == 2'd0)),
    .sda_i(&(branch_sda_i | ~clearing)), .scl_low_o(clear_scl_low), .sda_low_o(clear_sda_low),
    .busy_o(clear_busy), .done_o(clear_done)
  );

  always @(posedge clk_i or posedge rst_i) begin
    if (rst_i) begin
      clearing <= 2'd3;
    end else if (clear_done) begin
      clearing <= 2'd0;
    end else if (clearing == 2'd0 && !clear_busy) begin
      clearing <= clear_i | (attached & {2{timeout}});
    end
  end

  // One of the two alone moves: no glitch.
  assign branch_scl_low_o = scl_low | (clearing & {2{clear_scl_low}});
  assign branch_sda_low_o = sda_low | (clearing & {2{clear_sda_low}});
  assign sda_low_o = answer_low;
  assign clearing_o = clearing;
  assign timeout_o = timeout && (attached != 2'd0);
  assign stretch_o = fall && ((attached & ~branch_scl_i) != 2'd0);
  assign error_o = fall && at_acknowledge && (addressing || !reading) && value &&
                   (selected != 2'd0);

`ifdef FORMAL
  i2c_router_properties properties (
    .clk_i(clk_i), .rst_i(rst_i), .tick_ms_i(tick_ms_i), .enable_i(enable_i), .clear_i(clear_i),
    .bypass_i(bypass_i), .scl_i(scl_i), .sda_i(sda_i), .start_i(start_i), .stop_i(stop_i),
    .sda_low_o(sda_low_o), .branch_scl_i(branch_scl_i), .branch_sda_i(branch_sda_i),
    .scl_low_i(scl_low), .sda_low_i(sda_low), .branch_scl_low_o(branch_scl_low_o),
    .branch_sda_low_o(branch_sda_low_o), .clearing_o(clearing_o), .error_o(error_o),
    .stretch_o(stretch_o), .timeout_o(timeout_o), .scl_q_i(scl), .up_i(up), .count_i(count),
    .bit_i(bit_index), .addressing_i(addressing), .match_i(match), .address1_i(address1),
    .reading_i(reading), .failed_i(failed), .value_i(value), .attached_i(attached),
    .selected_i(selected), .bypass_q_i(bypass), .still_ms_i(still_ms),
    .clear_scl_low_i(clear_scl_low), .clear_sda_low_i(clear_sda_low), .clear_busy_i(clear_busy)
  );
`endif
endmodule

`default_nettype wire
