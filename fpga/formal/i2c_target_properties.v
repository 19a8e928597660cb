// SPDX-License-Identifier: Apache-2.0
// Properties of i2c_target, compared with a second decoder of the protocol from the filtered lines.
`default_nettype none

module i2c_target_properties #(
  parameter [6:0] ADDRESS = 7'h2C,
  parameter TIMEOUT_MS = 31
) (
  input wire clk_i,
  input wire rst_i,
  input wire tick_ms_i,
  input wire scl_i,            // filtered
  input wire sda_i,            // filtered
  input wire start_i,
  input wire stop_i,
  input wire sda_low_i,
  input wire [7:0] index_i,
  input wire index_known_i,
  input wire reading_i,
  input wire read_strobe_i,
  input wire [15:0] read_data_i,
  input wire [15:0] write_data_i,
  input wire write_allowed_i,
  input wire write_strobe_i,
  input wire timeout_i,
  input wire protocol_error_i,
  input wire [2:0] state_i,
  input wire [3:0] bits_i,
  input wire [4:0] still_ms_i
);
  // State of the transfer: not ours, or which byte.
  localparam [2:0] NOBODY = 3'd0;
  localparam [2:0] WHO = 3'd1;
  localparam [2:0] WHERE = 3'd2;
  localparam [2:0] FIRST = 3'd3;
  localparam [2:0] SECOND = 3'd4;
  localparam [2:0] OUT_FIRST = 3'd5;
  localparam [2:0] OUT_SECOND = 3'd6;

  reg begun = 1'b0;
  reg running;               // no reset now and none at the edge before
  reg scl_before;
  reg sda_low_before;
  reg release_before;        // at the edge before: START, STOP or time-out
  reg rise_before, fall_before;
  wire rise = scl_i && !scl_before;
  wire fall = !scl_i && scl_before;

  reg [2:0] place;
  reg [3:0] clocks;          // of the byte so far
  reg [15:0] taken;          // the last bits
  reg own;                   // this transfer began with our address
  reg general;               // with the general call
  reg answering;             // between the eighth falling edge of a byte and the ninth
  reg answer;                // what is said there
  reg known, allowed;        // at its beginning
  reg [2:0] asked;           // place there
  reg fresh;                 // the word to be sent was fetched
  reg [1:0] whole;           // data bytes written since START or the last word
  reg [7:0] index;           // where the next word goes
  reg [5:0] still;           // ticks since SCL moved
  reg [2:0] strobe_age;      // clocks since a strobe, at most 7
  reg strobe_read;

  wire outgoing = place == OUT_FIRST || place == OUT_SECOND;
  wire judged = answering && clocks == 4'd8;
  wire [15:0] behind = taken >> clocks;  // without the bits of the present byte
  wire ours = taken[7:1] == ADDRESS;
  wire agreed = place == WHO ? ours
    : place == WHERE ? 1'b1
    : place == FIRST ? index_known_i
    : place == SECOND && write_allowed_i;

  always @(posedge clk_i) begin
    if (!begun) assume (rst_i);
    begun <= 1'b1;
    running <= !rst_i;
    scl_before <= rst_i || scl_i;
    sda_low_before <= !rst_i && sda_low_i;
    release_before <= start_i || stop_i || timeout_i;
    rise_before <= rise && !rst_i;
    fall_before <= fall && !rst_i;
    if (rst_i) begin
      place <= NOBODY;
      clocks <= 4'd0;
      own <= 1'b0;
      general <= 1'b0;
      answering <= 1'b0;
      answer <= 1'b0;
      whole <= 2'd0;
      index <= 8'd0;
      taken <= 16'd0;
    end else if (start_i || stop_i || timeout_i) begin
      place <= start_i ? WHO : NOBODY;
      clocks <= 4'd0;
      own <= 1'b0;
      general <= 1'b0;
      answering <= 1'b0;
      answer <= 1'b0;
      whole <= 2'd0;
    end else if (rise && clocks != 4'd8) begin
      clocks <= clocks + 4'd1;
      taken <= {taken[14:0], sda_i};
    end else if (rise) begin
      clocks <= 4'd0;
      if (place == WHO) place <= taken[0] ? OUT_FIRST : WHERE;
      if (place == WHERE || place == SECOND) place <= FIRST;
      if (place == FIRST) place <= SECOND;
      if (outgoing) place <= sda_i ? NOBODY : place == OUT_FIRST ? OUT_SECOND : OUT_FIRST;
      if (place == SECOND || place == OUT_SECOND) index <= index + 8'd1;
      if (place == SECOND) whole <= 2'd0;
      if (outgoing && sda_i) own <= 1'b0;
    end else if (fall && clocks == 4'd8) begin
      answering <= 1'b1;
      answer <= agreed;
      asked <= place;
      known <= index_known_i;
      allowed <= write_allowed_i;
      if (place == WHO) begin
        own <= ours;
        general <= taken[7:0] == 8'd0;
      end
      if (place == WHERE) index <= taken[7:0];
      if (place == FIRST || place == SECOND) whole <= whole + 2'd1;
      if (!agreed && !outgoing) begin
        place <= NOBODY;
        own <= 1'b0;
      end
    end else if (fall) begin
      answering <= 1'b0;
    end
    if (rst_i || start_i || stop_i || timeout_i) fresh <= 1'b0;
    else if (rise && clocks == 4'd8 && place == OUT_SECOND) fresh <= 1'b0;
    else if (read_strobe_i) fresh <= 1'b1;
    if (rst_i || rise || fall || start_i || (scl_i && place == NOBODY)) still <= 6'd0;
    else if (tick_ms_i && still != 6'd63) still <= still + 6'd1;
    strobe_age <= rst_i ? 3'd7 : read_strobe_i || write_strobe_i ? 3'd0
      : strobe_age == 3'd7 ? 3'd7 : strobe_age + 3'd1;
    if (read_strobe_i || write_strobe_i) strobe_read <= read_strobe_i;
  end

  // Promised by the register file: a word that is read stays until the next strobe is over.
  reg [15:0] read_data_before;
  reg [15:0] write_data_before;
  reg [7:0] index_before;
  reg allowed_before;
  reg [1:0] steady_before;
  wire [1:0] steady = write_data_i != write_data_before || index_i != index_before ? 2'd0
    : steady_before == 2'd3 ? 2'd3 : steady_before + 2'd1;  // clocks without a change
  always @(posedge clk_i) begin
    read_data_before <= read_data_i;
    write_data_before <= write_data_i;
    index_before <= index_i;
    allowed_before <= write_allowed_i;
    steady_before <= rst_i ? 2'd0 : steady;
    if (begun && !(strobe_read && strobe_age < 3'd2)) assume (read_data_i == read_data_before);
  end

  // Reachable states, needed by the induction.
  wire possible = place <= OUT_SECOND
    && (!answering || (scl_before ? clocks == 4'd0 && place != WHO : clocks == 4'd8))
    && (place == NOBODY || clocks != 4'd8 || scl_before || answering)
    && own == ((place != NOBODY && place != WHO) || (place == WHO && answering))
    && (place == NOBODY || whole == (place == FIRST ? {1'b0, judged}
      : place == SECOND ? 2'd1 + {1'b0, judged} : 2'd0));

  always @(posedge clk_i) if (begun && running && !rst_i) begin
    // SDA is released unless our address was received, and changes only while SCL is low.
    a_only_when_addressed: assert (!sda_low_i || own);
    a_general_call_ignored: assert (!general || (!own && !sda_low_i));
    a_pulled_only_below_scl: assert (!sda_low_i || sda_low_before || (!scl_i && fall_before));
    a_released_only_in_time:
      assert (sda_low_i || !sda_low_before || (!scl_i && fall_before) || release_before);
    a_released_by_conditions: assert (!release_before || !sda_low_i);
    a_bus_always_released: assert (!sda_low_i || still < TIMEOUT_MS || timeout_i);
    a_time_out_frees: assert (still < TIMEOUT_MS || place == NOBODY || timeout_i);
    a_nobody_is_silent: assert (place != NOBODY || !sda_low_i || fall_before);

    // Acknowledges and data.
    a_acknowledge: assert (!answering || sda_low_i == answer);
    a_master_acknowledges: assert (!(judged && outgoing) || (!sda_low_i && !answer));
    a_unknown_never_acknowledged: assert (!(judged && asked == FIRST && sda_low_i) || known);
    a_refused_never_acknowledged: assert (!(judged && asked == SECOND && sda_low_i) || allowed);
    a_bits_out: assert (!(outgoing && !scl_before && clocks != 4'd8)
      || sda_low_i == !read_data_i[{place == OUT_FIRST, ~clocks[2:0]}]);
    a_reading: assert (reading_i == outgoing);

    // Words.
    a_word_has_two_bytes: assert (!write_strobe_i || whole == 2'd2);
    a_word_is_what_was_sent: assert (!write_strobe_i || write_data_i == taken);
    a_word_was_allowed: assert (!write_strobe_i || allowed_before);
    a_word_to_us: assert (!write_strobe_i || own);
    a_word_settled: assert (!write_strobe_i || steady >= 2'd2);
    a_word_stays: assert (strobe_read || strobe_age > 3'd1 || write_data_i == write_data_before);
    a_index_stays: assert (strobe_age > 3'd1 || index_i == index_before);
    a_strobes_apart: assert (!(read_strobe_i || write_strobe_i) || strobe_age > 3'd1);
    a_strobe_alone: assert (!(read_strobe_i && write_strobe_i));
    a_fetched: assert (place != OUT_FIRST || fresh || read_strobe_i);
    a_fetched_for_reading: assert (!read_strobe_i || reading_i);
    a_fetch_before_use: assert (!(outgoing && fall && clocks == 4'd0 && place == OUT_FIRST)
      || strobe_age >= 3'd1);
    a_index: assert (index_i == index);

    // Its own state.
    a_collected: assert (write_data_i[7:0] == taken[7:0]
      && (place != FIRST || !judged || write_data_i[15:8] == taken[7:0])
      && (place != SECOND || write_data_i[15:8] == behind[7:0]));
    a_state: assert (state_i == place && possible);
    a_bits: assert (bits_i == clocks && clocks <= 4'd8);
    a_time_out_once: assert (!timeout_i || still == TIMEOUT_MS);
    a_still: assert (still_ms_i == (still > TIMEOUT_MS ? TIMEOUT_MS : still));
    a_protocol_error: assert (!protocol_error_i || ((start_i || stop_i) && place != NOBODY));
    a_half_word_is_an_error: assert (!((start_i || stop_i) && place == SECOND) || protocol_error_i);
    a_whole_word_is_none: assert (!(place == FIRST && clocks <= 4'd1) || !protocol_error_i);
    // Whole transfers are hundreds of clocks long; simulations reach those.
    c_error: cover (protocol_error_i);
    c_time_out: cover (timeout_i && place == WHO);
  end
endmodule

`default_nettype wire
