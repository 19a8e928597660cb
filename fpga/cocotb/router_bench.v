// SPDX-License-Identifier: Apache-2.0
// The router with its filters between a master and two sensors: wired AND of the lines, clock and
// ticks. A test holds lines low through hold_*.
`timescale 1ns / 1ps
module router_bench;
  reg  clk = 1'b0;
  reg  rst = 1'b1;
  reg  tick_us = 1'b0;
  reg  tick_ms = 1'b0;
  reg  [4:0] phase = 5'd0;
  reg  [9:0] us = 10'd0;
  reg  master_scl = 1'b1;
  reg  master_sda = 1'b1;
  reg  left_scl = 1'b1, left_sda = 1'b1, right_scl = 1'b1, right_sda = 1'b1;
  reg  [1:0] hold_sda = 2'd0;
  reg  [1:0] hold_scl = 2'd0;
  reg  enable = 1'b1;
  reg  [1:0] bypass = 2'd0;
  reg  [1:0] clear = 2'd0;
  reg  idle_ticks = 1'b0;                // a millisecond in 40 clocks
  wire answer_low;
  wire [1:0] scl_low, sda_low, clearing;
  wire error, stretch, timeout;
  wire scl = master_scl;
  wire sda = master_sda && !answer_low;
  wire left_scl_line = left_scl && !scl_low[0] && !hold_scl[0];
  wire left_sda_line = left_sda && !sda_low[0] && !hold_sda[0];
  wire right_scl_line = right_scl && !scl_low[1] && !hold_scl[1];
  wire right_sda_line = right_sda && !sda_low[1] && !hold_sda[1];

  always #20 clk = !clk;
  always @(negedge clk) begin
    phase <= phase == 5'd24 ? 5'd0 : phase + 5'd1;
    tick_us <= phase == 5'd24;
    if (phase == 5'd24) us <= us == 10'd999 ? 10'd0 : us + 10'd1;
    tick_ms <= phase == 5'd24 && (us == 10'd999 || idle_ticks);
  end

  wire scl_clean, scl_sample, sda_clean, start, stop;
  wire [1:0] branch_scl, branch_sda;
  glitch_filter scl_filter (.clk_i(clk), .rst_i(rst), .line_i(scl), .level_o(scl_clean),
                            .sample_o(scl_sample), .spike_o());
  glitch_filter sda_filter (.clk_i(clk), .rst_i(rst), .line_i(sda), .level_o(sda_clean),
                            .sample_o(), .spike_o());
  glitch_filter scl0 (.clk_i(clk), .rst_i(rst), .line_i(left_scl_line), .level_o(branch_scl[0]),
                      .sample_o(), .spike_o());
  glitch_filter sda0 (.clk_i(clk), .rst_i(rst), .line_i(left_sda_line), .level_o(branch_sda[0]),
                      .sample_o(), .spike_o());
  glitch_filter scl1 (.clk_i(clk), .rst_i(rst), .line_i(right_scl_line), .level_o(branch_scl[1]),
                      .sample_o(), .spike_o());
  glitch_filter sda1 (.clk_i(clk), .rst_i(rst), .line_i(right_sda_line), .level_o(branch_sda[1]),
                      .sample_o(), .spike_o());
  bus_condition conditions (.clk_i(clk), .rst_i(rst), .scl_i(scl_clean), .scl_sample_i(scl_sample),
                            .sda_i(sda_clean), .scl_rise_o(), .scl_fall_o(), .start_o(start),
                            .stop_o(stop));
  i2c_router router (
    .clk_i(clk), .rst_i(rst), .tick_us_i(tick_us), .tick_ms_i(tick_ms), .enable_i(enable),
    .bypass_i(bypass), .clear_i(clear), .scl_i(scl_clean), .sda_i(sda_clean), .start_i(start),
    .stop_i(stop), .sda_low_o(answer_low), .branch_scl_i(branch_scl), .branch_sda_i(branch_sda),
    .branch_scl_low_o(scl_low), .branch_sda_low_o(sda_low), .clearing_o(clearing),
    .error_o(error), .stretch_o(stretch), .timeout_o(timeout)
  );

  // Events counted for the tests.
  reg [15:0] errors = 16'd0, stretches = 16'd0, timeouts = 16'd0, left_rises = 16'd0,
             right_rises = 16'd0;
  always @(posedge clk) if (!rst) begin
    errors <= errors + {15'd0, error};
    stretches <= stretches + {15'd0, stretch};
    timeouts <= timeouts + {15'd0, timeout};
  end
  always @(posedge left_scl_line) left_rises <= left_rises + 16'd1;
  always @(posedge right_scl_line) right_rises <= right_rises + 16'd1;

  // Fast mode at the branches, by the numbers: high and low time of SCL, data set-up and hold.
  time rise_at[0:1], fall_at[0:1], moved_at[0:1];
  reg [15:0] timing_faults = 16'd0;
  task fault(input [8*20:1] what, input integer branch, input time t);
    begin
      timing_faults = timing_faults + 16'd1;
      if (timing_faults < 20) $display("%0t branch %0d: %0s %0t", $time, branch, what, t);
    end
  endtask
  initial begin
    rise_at[0] = 0; rise_at[1] = 0; fall_at[0] = 0; fall_at[1] = 0; moved_at[0] = 0;
    moved_at[1] = 0;
  end
  always @(scl_low[0] or scl_low[1]) if (!rst) begin : clocks
    integer k;
    for (k = 0; k < 2; k = k + 1) begin
      if (scl_low[k] && rise_at[k] >= fall_at[k]) begin
        if ($time - rise_at[k] < 500) fault("high time", k, $time - rise_at[k]);
        fall_at[k] = $time;
      end
      if (!scl_low[k] && fall_at[k] > rise_at[k]) begin
        if ($time - fall_at[k] < 1200) fault("low time", k, $time - fall_at[k]);
        if ($time - moved_at[k] < 100) fault("set-up", k, $time - moved_at[k]);
        rise_at[k] = $time;
      end
    end
  end
  always @(sda_low[0]) if (!rst) begin
    if (scl_low[0] && $time - fall_at[0] < 180) fault("hold", 0, $time - fall_at[0]);
    moved_at[0] = $time;
  end
  always @(sda_low[1]) if (!rst) begin
    if (scl_low[1] && $time - fall_at[1] < 180) fault("hold", 1, $time - fall_at[1]);
    moved_at[1] = $time;
  end
endmodule
