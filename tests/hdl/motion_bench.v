// SPDX-License-Identifier: Apache-2.0
//
// The servos and the register file that holds their registers, together: a read or a write of the
// bus in each clock around the moment in which a frame takes its period over. One clock is one
// microsecond. Prints "PASS n" (n pulses), or what is wrong.

`timescale 1ns/1ns
`default_nettype none

module motion_bench;

  reg clk = 1'b0;
  reg rst = 1'b1;
  always #5 clk = !clk;

  reg [7:0] index = 8'h00;
  reg [15:0] data = 16'd0;
  reg read = 1'b0;
  reg write = 1'b0;
  wire [3:0] place;
  wire [15:0] word, store_q4;
  wire busy, store, stored;
  wire [1:0] enable;
  wire [1:0] servo;
  register_file registers (
    .clk_i(clk), .rst_i(rst), .index_i(index), .read_strobe_i(read), .reading_i(1'b0),
    .write_strobe_i(write), .write_data_i(data), .memory_place_i(place), .memory_busy_o(busy),
    .memory_word_o(word), .memory_store_i(store), .memory_data_i(store_q4),
    .memory_stored_o(stored), .ctrl_servo0_enable_o(enable[0]), .ctrl_servo1_enable_o(enable[1])
  );
  motion servos (
    .clk_i(clk), .rst_i(rst), .soft_rst_i(rst), .tick_us_i(1'b1), .tick_ms_i(1'b0),
    .written_i(write), .watchdog_ms_i(16'd1000), .watchdog_action_i(2'd2),
    .watchdog_clear_i(1'b0), .enable_i(enable), .place_o(place), .word_i(word), .busy_i(busy),
    .store_o(store), .store_q4_o(store_q4), .stored_i(stored), .servo_o(servo)
  );

  // Pulses of 1500 us, 15000 us from start to start.
  integer clocks = 0;
  integer rise = 0;
  integer pulses = 0;
  integer failures = 0;
  reg before = 1'b0;
  always @(posedge clk) begin
    clocks <= clocks + 1;
    before <= servo[0];
    if (servo[0] && !before) begin
      if (pulses > 1 && clocks - rise != 15000) begin
        failures = failures + 1;
        $display("index %h: %0d us from pulse to pulse", index, clocks - rise);
      end
      rise <= clocks;
      pulses = pulses + 1;
    end
    if (!servo[0] && before && clocks - rise != 1500) begin
      failures = failures + 1;
      $display("index %h: a pulse of %0d us", index, clocks - rise);
    end
  end

  task put(input [7:0] at, input [15:0] value);
    begin
      @(negedge clk) index = at;
      data = value;
      write = 1'b1;
      @(negedge clk) write = 1'b0;
      repeat (2) @(negedge clk);
    end
  endtask

  reg [7:0] indices [0:5];
  integer i, lead;
  initial begin
    // The period, the slew limit, SCRATCH, and registers outside this memory whose index has a
    // place there.
    indices[0] = 8'h07;
    indices[1] = 8'h15;
    indices[2] = 8'h04;
    indices[3] = 8'h33;
    indices[4] = 8'h35;
    indices[5] = 8'h0A;
    repeat (4) @(negedge clk);
    rst = 1'b0;
    repeat (60) @(negedge clk);
    put(8'h0D, 16'h4C4B);
    put(8'h07, 16'd15000);
    put(8'h04, 16'd5);
    put(8'h08, 16'd1);
    repeat (45000) @(negedge clk);
    for (i = 0; i < 12 && failures == 0; i = i + 1) begin
      for (lead = 0; lead < 3 && failures == 0; lead = lead + 1) begin
        // In the clock in which the frame latches its period, and one and two clocks earlier.
        @(posedge servo[0]);
        repeat (15000 - lead) @(negedge clk);
        index = indices[i % 6];
        data = index == 8'h07 ? 16'd15000 : index == 8'h04 ? 16'd5 : 16'd480;
        read = i < 6;
        write = i >= 6;
        @(negedge clk) read = 1'b0;
        write = 1'b0;
      end
    end
    repeat (30000) @(negedge clk);
    if (failures == 0 && pulses > 36) $display("PASS %0d", pulses);
    else $display("FAIL %0d pulses, %0d failures", pulses, failures);
    $finish;
  end

  initial begin
    #20000000 $display("FAIL the servo has stopped");
    $finish;
  end

endmodule

`default_nettype wire
