// SPDX-License-Identifier: Apache-2.0
// One branch of the router as a sensor on it sees it: START, bits, STOP, and their timing. Part of
// i2c_router_properties, which counts the bits of the DSP's bus.
`default_nettype none

module i2c_branch_properties (
  input wire       clk_i,
  input wire       rst_i,
  input wire       tell_i,
  input wire       scl_low_i,       // the branch's lines
  input wire       sda_low_i,
  input wire       attached_i,
  input wire       meant_i,         // by the address on the DSP's bus
  input wire       selected_i,
  input wire       bypass_i,
  input wire       value_i,
  input wire [3:0] pos_i,
  input wire       first_byte_i,
  input wire       answers_i,
  input wire       up_i,
  input wire       settled_i,       // SDA shows the bit of pos_i
  input wire       upper_i,         // up_i in the clock before; as the following
  input wire [3:0] low_clocks_i,    // of the DSP's SCL
  input wire [4:0] count_i,
  input wire       start_i,
  input wire       stop_i,
  input wire       ms_i,
  input wire       enable_i,
  input wire [7:0] address_i,
  input wire       clearing_i,
  input wire       own_scl_low_i,   // without bus clear
  input wire       own_sda_low_i,
  input wire       clear_scl_low_i,
  input wire       clear_sda_low_i,
  input wire       clear_busy_i,
  input wire       meant6_i         // at bit 6: with this bit the address means the branch
);
  localparam [6:0] SENSOR = 7'h5D;

  reg       scl_low, sda_low, attached, clearing, own_scl_low;
  reg       listening;              // START seen
  reg [3:0] seen;                   // bits since, up to 9
  reg [7:0] word;
  reg       chosen;                 // at bit 6 the DSP's bus meant this branch
  reg       from_clear;             // that START was bus clear's
  reg       cleared;                // START was sent in this bus clear
  reg       zero;                   // a bit of this bus clear was 0
  reg [3:0] low_time;               // of its SCL
  reg [3:0] sda_time;               // since its SDA moved
  wire      rise = scl_low && !scl_low_i;
  wire      steady = !scl_low && !scl_low_i;
  wire      moved = sda_low != sda_low_i;
  wire      begins = steady && !sda_low && sda_low_i;
  wire      ends = steady && sda_low && !sda_low_i;

  wire [7:0] before = (steady && pos_i < 4'd8) ? word >> 1 : word;   // the bits before this one
  wire [7:0] taken = ~(8'hFF << ((seen > 4'd8) ? 4'd8 : seen));
  wire [7:0] zeros = ~word & taken;

  always @(posedge clk_i) begin
    scl_low <= scl_low_i;
    sda_low <= sda_low_i;
    attached <= attached_i;
    clearing <= clearing_i;
    own_scl_low <= own_scl_low_i;
    if (rst_i) begin
      listening <= 1'b0;
      seen <= 4'd0;
      word <= 8'd0;
      low_time <= 4'd0;
      sda_time <= 4'd15;
      chosen <= 1'b0;
      from_clear <= 1'b0;
      cleared <= 1'b0;
      zero <= 1'b0;
    end else begin
      if (begins) from_clear <= !own_sda_low_i;
      if (begins) chosen <= 1'b0;
      else if (attached_i && first_byte_i && pos_i == 4'd6) chosen <= meant6_i;
      cleared <= clearing_i && clear_busy_i && (cleared || (begins && clear_sda_low_i));
      zero <= !(clearing_i && clear_busy_i && !cleared) &&
              (zero || (clearing_i && rise && clear_sda_low_i));
      listening <= !ends && (begins || listening);
      if (begins) begin
        seen <= 4'd0;
        word <= 8'd0;
      end else if (rise) begin
        seen <= (seen == 4'd9) ? seen : seen + 4'd1;
        if (seen < 4'd8) word <= {word[6:0], !sda_low_i};
      end
      low_time <= !scl_low_i ? 4'd0 : (low_time == 4'd15) ? low_time : low_time + 4'd1;
      sda_time <= moved ? 4'd0 : (sda_time == 4'd15) ? sda_time : sda_time + 4'd1;
    end
    if (!rst_i && clearing_i && clear_busy_i) begin
      // Of i2c_bus_clear: a_start_first, a_one_zero. The router's own lines are released meanwhile
      // (a_clear_apart), so these are the lines of the branch.
      assume (!clear_scl_low_i || cleared);
      assume (!(rise && clear_sda_low_i) || !zero);
    end
    if (tell_i) begin
      // A branch shows a sensor its own address only if the DSP's bus means it: not the seventh bit
      // while that is on SDA, not all seven later, and not in a bus clear (a_ones).
      a_not_meant: assert (!(listening && !from_clear) ||
          (!(seen == 4'd6 && attached_i && settled_i && scl_low && scl_low_i && !sda_low_i &&
             word[5:0] == SENSOR[6:1]) || meant6_i) &&
          (!(seen == 4'd7 && word[6:0] == SENSOR) || chosen));
      a_meant_sees_it: assert (!(attached_i && first_byte_i && pos_i == 4'd7 && selected_i &&
                                 !bypass_i) ||
                               (listening && seen >= 4'd7 && before[6:0] == SENSOR));
      a_no_clocks: assert (!(attached_i && !first_byte_i) || meant_i);
      a_scl_only_attached: assert (!(own_scl_low_i && !own_scl_low) || attached_i);
      a_data_as_it_is: assert (!(settled_i && attached_i && !answers_i && pos_i < 4'd8 &&
                                 (!first_byte_i || pos_i < 4'd5 || pos_i == 4'd7)) ||
                               own_sda_low_i == !value_i);
      a_released_to_answer: assert (!(attached_i && answers_i && settled_i) || !own_sda_low_i);
      a_sda_edges: assert (!(steady && moved) || start_i || stop_i ||
                           (count_i == 5'd10 && upper_i) || (!attached &&
                                                      (clearing || (ms_i && !sda_low_i))));
      a_hold: assert (!(moved && scl_low_i && attached) || (scl_low && low_time >= 4'd5));
      a_set_up: assert (!(rise && attached) || (!moved && sda_time >= 4'd2));
      a_disabled: assert (!(start_i && !enable_i) || !attached_i);
      a_clear_apart: assert (!(clearing_i && clear_busy_i) ||
                             (!attached_i && !own_scl_low_i && !own_sda_low_i));

      // Helps the induction.
      a_listens: assert (!attached_i || !(pos_i == 4'd15 ? own_sda_low_i && sda_low : 1'b1) ||
                         (listening && !from_clear && seen == (!first_byte_i ? 4'd9 :
                          pos_i == 4'd15 ? 4'd0 : pos_i + {3'd0, steady})));
      a_word: assert (!(attached_i && first_byte_i && !bypass_i) || pos_i == 4'd15 ||
          (before & ~(8'hFF << pos_i)) ==
          (pos_i <= 4'd5 ? address_i & ~(8'hFF << pos_i) :
           pos_i == 4'd6 ? {2'd0, address_i[5:1], 1'b0} :
           pos_i == 4'd7 ? {1'b0, address_i[6:2], 1'b0, selected_i} :
                           {address_i[7:3], 1'b0, selected_i, address_i[0]}));
      a_bit: assert (!(attached_i && first_byte_i && steady && pos_i < 4'd8) ||
                     word[0] == !own_sda_low_i);
      a_forced: assert (!(attached_i && first_byte_i && settled_i) ||
                        own_sda_low_i == (pos_i == 4'd8 ? 1'b0 : pos_i == 4'd15 ? own_sda_low_i :
                         bypass_i ? !value_i : pos_i == 4'd5 ? 1'b1 : pos_i == 4'd6 ? !meant6_i :
                                                                         !value_i));
      a_chosen: assert (!(listening && !from_clear && seen >= 4'd7 && attached_i && !bypass_i &&
                          first_byte_i && pos_i == 4'd7) || chosen == selected_i);
      a_ones: assert ((!cleared || from_clear) && (!(from_clear && listening) ||
                      ((zeros & (zeros - 8'd1)) == 8'd0 && (zero || !cleared || zeros == 8'd0))));
      a_scl_follows: assert (!attached_i || (own_scl_low_i == !up_i && (up_i || pos_i != 4'd15) &&
                             (!own_scl_low_i || {1'b0, low_time} + 5'd1 >= {1'b0, low_clocks_i})));
      a_holds: assert (!(attached_i && first_byte_i && pos_i == 4'd6 && !settled_i && !bypass_i) ||
                       own_sda_low_i || meant6_i);
      a_before_clear: assert (!(clearing_i && clear_busy_i && !cleared) || !scl_low);
      a_own_scl: assert (!own_scl_low_i || attached_i || attached);
    end
  end
endmodule

`default_nettype wire
