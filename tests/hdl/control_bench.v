// SPDX-License-Identifier: Apache-2.0
//
// I2C target and register file behind a small master: writes, reads after repeated START and after
// STOP, runs of words, aborts at every bit, refused words, time-outs.
// Plus arguments: +low_ns= +high_ns= (of SCL), +hold_ns= (SDA after the falling edge of SCL),
// +clock_ps= (half period of clk_i), +step= (aborts after every step-th bit only). Prints
// "PASS n" or the first differences.

`timescale 1ps/1ps
`default_nettype none

module control_bench;

  integer low_ps, high_ps, hold_ps, clock_ps, step;
  integer checks = 0;
  integer failures = 0;

  reg clk = 1'b0;
  reg rst = 1'b1;
  always #(clock_ps) clk = !clk;

  // All lines are wired ANDs.
  reg master_scl = 1'b1;
  reg master_sda = 1'b1;
  wire sda_low;
  wire scl = master_scl;
  wire sda = master_sda && !sda_low;

  reg fast_time = 1'b0;
  reg [4:0] prescaler = 5'd0;
  always @(posedge clk) prescaler <= prescaler == 5'd24 ? 5'd0 : prescaler + 5'd1;
  wire tick_ms;
  wire [31:0] time_us;
  wire tick_us = fast_time || prescaler == 5'd24;
  microsecond_time clock (
    .clk_i(clk), .rst_i(rst), .tick_us_i(tick_us), .time_us_o(time_us)
  );
  time_base ticks (
    .clk_i(clk), .rst_i(rst), .tick_us_i(tick_us), .tick_10us_o(), .tick_50us_o(),
    .tick_ms_o(tick_ms), .tick_16ms_o()
  );

  wire [7:0] index;
  wire known, reading, fetch, allowed, store, timeout, protocol_error, spike;
  wire [15:0] read_data, write_data;
  i2c_target target (
    .clk_i(clk), .rst_i(rst), .tick_ms_i(tick_ms), .scl_i(scl), .sda_i(sda), .sda_low_o(sda_low),
    .index_o(index), .index_known_i(known), .reading_o(reading), .read_strobe_o(fetch),
    .read_data_i(read_data), .write_data_o(write_data), .write_allowed_i(allowed),
    .write_strobe_o(store), .scl_o(), .sda_o(), .start_o(), .stop_o(), .timeout_o(timeout),
    .protocol_error_o(protocol_error), .spike_o(spike)
  );
  integer timeouts = 0;
  integer protocol_errors = 0;
  integer stores = 0;
  always @(posedge clk) begin
    if (timeout) timeouts = timeouts + 1;
    if (protocol_error) protocol_errors = protocol_errors + 1;
    if (store) stores = stores + 1;
  end

  wire hold0;
  register_file registers (
    .clk_i(clk), .rst_i(rst), .index_i(index), .index_known_o(known), .reading_i(reading),
    .read_strobe_i(fetch), .read_data_o(read_data), .write_allowed_o(allowed),
    .write_strobe_i(store), .write_data_i(write_data), .camera0_hold_o(hold0),
    .camera0_frames_i(16'h1234), .camera0_lines_i(hold0 ? 12'h5A5 : 12'h000), .time_us_i(time_us)
  );

  // The target's output must be on the bus in time for 1 MHz: 450 ns, less 120 ns for the edge.
  time scl_fell;
  always @(negedge scl) scl_fell = $time;
  reg silence = 1'b0;
  always @(sda_low) if (!silence && scl_fell != 0 && !scl && $time - scl_fell > 330000) begin
    failures = failures + 1;
    $display("SDA moved %0d ps after SCL fell", $time - scl_fell);
  end
  always @(sda_low) if (scl && sda_low) begin
    failures = failures + 1;
    $display("SDA pulled low while SCL is high");
  end

  task check(input [31:0] is, input [31:0] shall, input [8*24-1:0] what);
    begin
      checks = checks + 1;
      if (is !== shall) begin
        failures = failures + 1;
        if (failures < 20) $display("%0s: %h instead of %h at %0t", what, is, shall, $time);
      end
    end
  endtask

  // Starts and ends with SCL low; SDA changes `hold_ps` after the edge.
  task bit_out(input value);
    begin
      #(hold_ps) master_sda = value;
      #(low_ps - hold_ps) master_scl = 1'b1;
      #(high_ps) master_scl = 1'b0;
    end
  endtask
  task bit_in(output value);
    begin
      #(hold_ps) master_sda = 1'b1;
      #(low_ps - hold_ps) master_scl = 1'b1;
      value = sda;
      #(high_ps) check(sda, value, "SDA steady");
      master_scl = 1'b0;
    end
  endtask
  task start;
    begin
      if (!master_scl) begin
        #(hold_ps) master_sda = 1'b1;
        #(low_ps - hold_ps) master_scl = 1'b1;
      end
      #(low_ps) master_sda = 1'b0;
      #(high_ps) master_scl = 1'b0;
    end
  endtask
  task stop;
    begin
      #(hold_ps) master_sda = 1'b0;
      #(low_ps - hold_ps) master_scl = 1'b1;
      #(high_ps) master_sda = 1'b1;
      #(low_ps);
    end
  endtask
  // A target that still answers holds SDA; each clock brings it closer to its end.
  task free_bus;
    begin
      #(hold_ps) master_sda = 1'b1;
      #(low_ps - hold_ps);
      while (!sda) begin
        master_scl = 1'b1;
        #(high_ps) master_scl = 1'b0;
        #(low_ps);
      end
    end
  endtask
  task byte_out(input [7:0] value, output acknowledged);
    integer n;
    reg level;
    begin
      for (n = 7; n >= 0; n = n - 1) bit_out(value[n]);
      bit_in(level);
      acknowledged = !level;
    end
  endtask
  task byte_in(input acknowledge, output [7:0] value);
    integer n;
    begin
      for (n = 7; n >= 0; n = n - 1) bit_in(value[n]);
      bit_out(!acknowledge);
    end
  endtask

  reg a, b, c, d;
  task write_word(input [7:0] at, input [15:0] value, input accepted);
    begin
      start;
      byte_out(8'h58, a);
      byte_out(at, b);
      byte_out(value[15:8], c);
      byte_out(value[7:0], d);
      stop;
      check({a, b, c}, 3'b111, "acknowledges of a write");
      check(d, accepted, "acknowledge of a word");
    end
  endtask
  reg [15:0] got;
  task read_on(input more);
    begin
      byte_in(1'b1, got[15:8]);
      byte_in(more, got[7:0]);
    end
  endtask
  task read_word(input [7:0] at, input with_stop, input [15:0] shall);
    begin
      start;
      byte_out(8'h58, a);
      byte_out(at, b);
      if (with_stop) stop;
      start;
      byte_out(8'h59, c);
      read_on(1'b0);
      stop;
      check({a, b, c}, 3'b111, "acknowledges of a read");
      check(got, shall, "word");
    end
  endtask

  // A write of SCRATCH that ends after `bits` clocks, by START and STOP, STOP alone, or silence.
  task aborted(input integer bits, input integer how);
    reg [35:0] line;
    integer n;
    begin
      line = {8'h58, 1'b1, 8'h04, 1'b1, 8'hDE, 1'b1, 8'hAD, 1'b1};
      start;
      for (n = 0; n < bits; n = n + 1) bit_out(line[35 - n]);
      if (how == 0) begin
        free_bus;
        start;
        stop;
      end else if (how == 1) begin
        free_bus;
        stop;
      end else begin
        silence = 1'b1;
        #(hold_ps) master_sda = 1'b1;
        fast_time = 1'b1;
        #(clock_ps * 2 * 33000) fast_time = 1'b0;
        check(sda_low, 1'b0, "SDA free");
        silence = 1'b0;
        master_scl = 1'b1;
        #(low_ps);
      end
    end
  endtask

  integer n, how, before;
  initial begin
    if (!$value$plusargs("low_ns=%d", low_ps)) low_ps = 1300;
    if (!$value$plusargs("high_ns=%d", high_ps)) high_ps = 1200;
    if (!$value$plusargs("hold_ns=%d", hold_ps)) hold_ps = 0;
    if (!$value$plusargs("clock_ps=%d", clock_ps)) clock_ps = 20000;
    if (!$value$plusargs("step=%d", step)) step = 1;
    low_ps = low_ps * 1000;
    high_ps = high_ps * 1000;
    hold_ps = hold_ps * 1000;
    #(1000000) rst = 1'b0;
    #(1000000);

    read_word(8'h00, 1'b0, 16'h5B1D);
    read_word(8'h10, 1'b1, 16'd24000);
    write_word(8'h04, 16'hA55A, 1'b1);
    read_word(8'h04, 1'b0, 16'hA55A);
    read_word(8'h04, 1'b1, 16'hA55A);

    // Runs of words, and the index after them.
    start;
    byte_out(8'h58, a);
    byte_out(8'h24, a);
    for (n = 0; n < 4; n = n + 1) begin
      byte_out(8'h00, a);
      byte_out(8'h20 * (n + 1), b);
      check({a, b}, 2'b11, "run of writes");
    end
    stop;
    start;
    byte_out(8'h59, a);
    read_on(1'b1);
    check(got, 16'd0, "index after a run: kind");
    read_on(1'b0);
    check(got, 16'd1, "index after a run: seed");
    stop;
    for (n = 0; n < 4; n = n + 1) read_word(8'h24 + n, n[0], 16'h0020 * (n + 1));

    // Refused: range, lock, code, read only, unknown.
    write_word(8'h10, 16'd9599, 1'b0);
    write_word(8'h12, 16'd16000, 1'b0);
    write_word(8'h0D, 16'h4C4B, 1'b1);
    write_word(8'h12, 16'd16000, 1'b1);
    read_word(8'h12, 1'b0, 16'd16000);
    write_word(8'h12, 16'd33616, 1'b0);
    write_word(8'h13, 16'd15984, 1'b0);
    write_word(8'h28, 16'd5, 1'b0);
    write_word(8'h00, 16'd0, 1'b0);
    start;
    byte_out(8'h58, a);
    byte_out(8'h05, b);
    byte_out(8'h00, c);
    stop;
    check({a, b, c}, 3'b110, "unknown index");
    read_word(8'h05, 1'b0, 16'd0);
    start;
    byte_out(8'h00, a);
    byte_out(8'h5A, b);
    stop;
    start;
    byte_out(8'h5A, c);
    stop;
    check({a, b, c}, 3'b000, "others' addresses");

    // A block and a 32-bit value in one transfer.
    start;
    byte_out(8'h58, a);
    byte_out(8'h30, b);
    start;
    byte_out(8'h59, c);
    read_on(1'b1);
    check(got, 16'h1234, "first word of a block");
    read_on(1'b0);
    check(got, 16'h05A5, "second word of a block");
    stop;
    #(low_ps) check(hold0, 1'b0, "end of a block");

    // Every abort leaves SCRATCH unchanged, and the next transfer works.
    check(protocol_errors, 0, "protocol errors");
    for (how = 0; how < 3; how = how + 1) begin
      for (n = how == 2 ? 8 : 0; n < 36; n = n + (how == 2 ? 9 : step)) begin
        before = stores;
        aborted(n, how);
        if (n < 35) check(stores, before, "stores of an aborted write");
        write_word(8'h29, 16'd600 + n, 1'b1);
        read_word(8'h29, n[0], 16'd600 + n);
        if (n < 35) read_word(8'h04, 1'b0, 16'hA55A);
        else write_word(8'h04, 16'hA55A, 1'b1);
      end
    end
    check(timeouts, 4, "time-outs");
    if (failures == 0) $display("PASS %0d", checks);
    else $display("FAIL %0d of %0d", failures, checks);
    $finish;
  end

endmodule

`default_nettype wire
