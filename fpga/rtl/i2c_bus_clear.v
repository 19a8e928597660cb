// SPDX-License-Identifier: Apache-2.0
// Frees an I2C bus on which a device holds SDA: nine clocks at 100 kHz, then STOP.
//
//               |init |  0  |  1  | ...  |  8  | STOP |      10 us each, the first 5 us
//   scl          ''''''|__|''|__|'' ...  |__|''|__|'''''''
//   sda (lucky)  '''|____|''''''''' ...  ''''''|_____|''''    SDA was free: START before the clocks
//   sda (held)   ________|''|___|'' ...  ''''''|_____|''''    free after a clock: START there
//   done_o       _______________________________________|'|__
//
// START is sent before the clocks, and again in the first high phase in which SDA is free if it
// was not. After it no device takes the further clocks, with SDA released, for anything but the
// reserved address 0x7F: the bare nine clocks would fill up the byte of a write that was broken
// off, and so write a register by accident.
//
// Latency: starts with the first tick after go_i; done_o 105 ticks later.
`default_nettype none

module i2c_bus_clear (
  input  wire clk_i,
  input  wire rst_i,
  input  wire tick_us_i,
  input  wire go_i,          // ignored while busy
  input  wire sda_i,         // all lines to be freed are high
  output wire scl_low_o,
  output wire sda_low_o,
  output wire busy_o,
  output wire done_o
);
  // Ticks within a clock: SCL falls at 0 and rises at 5.
  localparam [3:0] SDA_MOVES = 4'd2;
  localparam [3:0] SCL_RISES = 4'd5;
  localparam [3:0] START = 4'd6;
  localparam [3:0] STOP = 4'd9;
  localparam [3:0] LAST = 4'd9;
  localparam [3:0] INITIAL = 4'd15;
  localparam [3:0] STOP_CLOCK = 4'd9;

  reg       busy;
  reg       started;
  reg       scl_low;
  reg       sda_low;
  reg       done;
  reg [3:0] phase;
  reg [3:0] clock;

  wire last_clock = (clock == STOP_CLOCK);

  always @(posedge clk_i or posedge rst_i) begin
    if (rst_i) begin
      busy <= 1'b0;
      started <= 1'b0;
      scl_low <= 1'b0;
      sda_low <= 1'b0;
      done <= 1'b0;
      phase <= SCL_RISES;
      clock <= INITIAL;
    end else begin
      done <= 1'b0;
      if (!busy) begin
        busy <= go_i && !done;
        started <= 1'b0;
        phase <= SCL_RISES;
        clock <= INITIAL;
      end else if (tick_us_i) begin
        phase <= (phase == LAST) ? 4'd0 : phase + 4'd1;
        if (phase == LAST) begin
          clock <= clock + 4'd1;
          scl_low <= !last_clock;
          busy <= !last_clock;
          done <= last_clock;
        end
        if (phase == SDA_MOVES) begin
          sda_low <= last_clock;
        end
        if (phase == SCL_RISES) begin
          scl_low <= 1'b0;
        end
        if (phase == START && ((clock == INITIAL) || (sda_i && !started && !last_clock))) begin
          sda_low <= 1'b1;
          started <= sda_i;
        end
        if (phase == STOP && last_clock) begin
          sda_low <= 1'b0;
        end
      end
    end
  end

  assign scl_low_o = scl_low;
  assign sda_low_o = sda_low;
  assign busy_o = busy;
  assign done_o = done;

`ifdef FORMAL
  i2c_bus_clear_properties properties (
    .clk_i(clk_i), .rst_i(rst_i), .tick_us_i(tick_us_i), .go_i(go_i), .sda_i(sda_i),
    .scl_low_o(scl_low_o), .sda_low_o(sda_low_o), .done_o(done_o), .busy_i(busy_o),
    .started_i(started), .phase_i(phase), .clock_i(clock)
  );
`endif
endmodule

`default_nettype wire
