// SPDX-License-Identifier: Apache-2.0
//
// I2C target for 16-bit words behind an 8-bit index, at up to 1 MHz with clk_i at 25 MHz.
//
// write  S  0x58 A  index A  high A  low A  [high A  low A ...]  P
// read   S  0x58 A  index A  (S or P S)  0x59 A  high a  low a  [high a ...]  low n  P
//        A: this target pulls SDA low, a: the master does, n: no device does
//
//         ___     ___     ___         ___     ___     ___     ___
// scl    |   |___|   |___|   |___ ...|   |___|   |___|   |___|   |___
// bits     1       2       3           7       8       0       1          (clocks of this byte)
// sda_low_o  _______________________________________|^^^^^^^|________     acknowledge
// write_strobe_o  ___________________________________|^|_____________     with that of a low byte
//
// The index increases by one with each whole word and stays where it is at STOP. A word is stored
// with its second byte; half a word changes nothing. Not acknowledged are: other addresses and the
// general call, data for an index that is not known, and a low byte that would make a word that is
// not allowed. Reading what is not known gives zeros. SCL is never held.
// When nothing moves for TIMEOUT_MS - 1 to TIMEOUT_MS ms in a transfer, or while SCL is low, the
// transfer ends, SDA is free, and the target waits for START.
//
// read_strobe_o comes at least 2 clocks before read_data_i is used. write_data_o and index_o stand
// for 2 clocks before write_strobe_o, which comes only if write_allowed_i was high in the clock
// before it, and stay for 2 clocks after it.
// protocol_error_o: START or STOP inside a byte, after half a word, or instead of a read's end.
// ADDRESS: 7 bits. Latency: SDA moves 6 or 7 clocks after the edge of SCL at the pin.

`default_nettype none

module i2c_target #(
  parameter [6:0] ADDRESS = 7'h2C,
  parameter TIMEOUT_MS = 31
) (
  input  wire clk_i,
  input  wire rst_i,
  input  wire tick_ms_i,
  input  wire scl_i,
  input  wire sda_i,
  output reg  sda_low_o,

  output reg  [7:0] index_o,
  input  wire index_known_i,
  output wire reading_o,
  output reg  read_strobe_o,
  input  wire [15:0] read_data_i,
  output wire [15:0] write_data_o,
  input  wire write_allowed_i,
  output reg  write_strobe_o,

  output wire scl_o,
  output wire sda_o,
  output wire start_o,
  output wire stop_o,
  output reg  timeout_o,
  output wire protocol_error_o,
  output wire spike_o
);

  localparam [2:0] IDLE = 3'd0;
  localparam [2:0] TARGET = 3'd1;
  localparam [2:0] INDEX = 3'd2;
  localparam [2:0] HIGH = 3'd3;
  localparam [2:0] LOW = 3'd4;
  localparam [2:0] SEND_HIGH = 3'd5;
  localparam [2:0] SEND_LOW = 3'd6;

  wire scl_sample;
  wire sda_sample;
  wire scl_spike;
  wire sda_spike;
  glitch_filter scl_filter (
    .clk_i(clk_i), .rst_i(rst_i), .line_i(scl_i), .level_o(scl_o), .sample_o(scl_sample),
    .spike_o(scl_spike)
  );
  glitch_filter sda_filter (
    .clk_i(clk_i), .rst_i(rst_i), .line_i(sda_i), .level_o(sda_o), .sample_o(sda_sample),
    .spike_o(sda_spike)
  );
  assign spike_o = scl_spike || sda_spike;
  wire unused = &{1'b0, sda_sample};

  wire scl_rise;
  wire scl_fall;
  bus_condition condition (
    .clk_i(clk_i), .rst_i(rst_i), .scl_i(scl_o), .scl_sample_i(scl_sample), .sda_i(sda_o),
    .scl_rise_o(scl_rise), .scl_fall_o(scl_fall), .start_o(start_o), .stop_o(stop_o)
  );

  // SCL that does not move. The count stays at its end until the next edge.
  reg [4:0] still_ms;
  reg [2:0] state;
  wire waiting = state != IDLE || !scl_o;
  wire too_long = still_ms == TIMEOUT_MS[4:0];
  wire last_ms = tick_ms_i && still_ms == TIMEOUT_MS[4:0] - 5'd1;
  always @(posedge clk_i or posedge rst_i) begin
    if (rst_i) begin
      still_ms <= 5'd0;
      timeout_o <= 1'b0;
    end else begin
      timeout_o <= 1'b0;
      if (scl_rise || scl_fall || start_o || (scl_o && state == IDLE)) begin
        still_ms <= 5'd0;
      end else if (tick_ms_i && waiting && !too_long) begin
        still_ms <= still_ms + 5'd1;
        timeout_o <= last_ms;
      end
    end
  end

  // `bits` counts the rising edges of SCL in a byte; the ninth, of the acknowledge, makes it 0.
  reg [3:0] bits;
  reg [7:0] shift;
  reg [7:0] high;
  wire sending = state == SEND_HIGH || state == SEND_LOW;
  wire rise = scl_rise && !timeout_o;  // an edge that comes with the time-out is too late
  wire fall = scl_fall && !timeout_o;
  wire byte_done = fall && bits == 4'd8;
  wire acknowledge_rise = rise && bits == 4'd8;
  wire addressed = shift[7:1] == ADDRESS;
  wire next_bit = read_data_i[{state == SEND_HIGH, ~bits[2:0]}];

  reg accept;
  always @* case (state)
    TARGET: accept = addressed;
    INDEX: accept = 1'b1;
    HIGH: accept = index_known_i;
    LOW: accept = write_allowed_i;
    default: accept = 1'b0;
  endcase

  always @(posedge clk_i or posedge rst_i) begin
    if (rst_i) begin
      state <= IDLE;
      bits <= 4'd0;
    end else if (start_o) begin
      state <= TARGET;
      bits <= 4'd0;
    end else if (stop_o || timeout_o) begin
      state <= IDLE;
      bits <= 4'd0;
    end else begin
      if (rise) bits <= bits == 4'd8 ? 4'd0 : bits + 4'd1;
      if (byte_done && !sending && !accept) state <= IDLE;
      if (acknowledge_rise) case (state)
        TARGET: state <= shift[0] ? SEND_HIGH : INDEX;
        INDEX: state <= HIGH;
        HIGH: state <= LOW;
        LOW: state <= HIGH;
        SEND_HIGH: state <= sda_o ? IDLE : SEND_LOW;
        SEND_LOW: state <= sda_o ? IDLE : SEND_HIGH;
        default: state <= IDLE;
      endcase
    end
  end

  always @(posedge clk_i or posedge rst_i) begin
    if (rst_i) begin
      shift <= 8'd0;
      high <= 8'd0;
      index_o <= 8'd0;
    end else begin
      if (rise && bits != 4'd8) shift <= {shift[6:0], sda_o};
      if (byte_done && state == HIGH) high <= shift;
      if (byte_done && state == INDEX) index_o <= shift;
      else if (acknowledge_rise && (state == LOW || state == SEND_LOW)) index_o <= index_o + 8'd1;
    end
  end

  always @(posedge clk_i or posedge rst_i) begin
    if (rst_i) begin
      sda_low_o <= 1'b0;
      read_strobe_o <= 1'b0;
      write_strobe_o <= 1'b0;
    end else begin
      if (start_o || stop_o || timeout_o) sda_low_o <= 1'b0;
      else if (fall) sda_low_o <= bits == 4'd8 ? accept : sending && !next_bit;
      read_strobe_o <= acknowledge_rise
        && ((state == TARGET && shift[0]) || (state == SEND_LOW && !sda_o));
      write_strobe_o <= byte_done && state == LOW && write_allowed_i;
    end
  end

  assign reading_o = sending;
  assign write_data_o = {high, shift};
  assign protocol_error_o = (start_o || stop_o) && state != IDLE
    && (bits > 4'd1 || state == LOW || sending);

`ifdef FORMAL
  i2c_target_properties #(.ADDRESS(ADDRESS), .TIMEOUT_MS(TIMEOUT_MS)) properties (
    .clk_i(clk_i), .rst_i(rst_i), .tick_ms_i(tick_ms_i), .scl_i(scl_o), .sda_i(sda_o),
    .start_i(start_o), .stop_i(stop_o), .sda_low_i(sda_low_o), .index_i(index_o),
    .index_known_i(index_known_i), .reading_i(reading_o), .read_strobe_i(read_strobe_o),
    .read_data_i(read_data_i), .write_data_i(write_data_o), .write_allowed_i(write_allowed_i),
    .write_strobe_i(write_strobe_o), .timeout_i(timeout_o), .protocol_error_i(protocol_error_o),
    .state_i(state), .bits_i(bits), .still_ms_i(still_ms)
  );
`endif

endmodule

`default_nettype wire
