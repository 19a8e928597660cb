// SPDX-License-Identifier: Apache-2.0
// What bridge_core adds to its parts: the resets, the interrupt, the line to the DSP. Interrupt and
// resets are the real ones; the outputs of all other parts are free.
`default_nettype none

module bridge_core_properties (
  input wire       clk_i,
  input wire       rst_i,
  input wire       rst,
  input wire       soft_rst,
  input wire       soft_reset,
  input wire       irq_o,
  input wire [7:0] irq_status,
  input wire [7:0] irq_enable,
  input wire [7:0] irq_test,
  input wire [7:0] irq_clear,
  input wire [9:0] events,
  input wire       target_low,
  input wire       router_low,
  input wire       sda_low_o,
  input wire       fs3_o,
  input wire [1:0] sensor_oe,
  input wire [1:0] extclk,
  input wire       stream,
  input wire [1:0] wanted
);
  // Three events of I2C share bit 5.
  wire [7:0] causes = {events[9], events[8], |events[7:5], events[4:0]} | irq_test;
  reg begun = 1'b0;
  reg was_soft, line_due;
  reg [3:0] quiet;                     // clocks since rst_i
  reg [3:0] soft_quiet;                // since rst_i or a soft reset
  reg [7:0] status_due;
  always @(posedge clk_i) begin
    if (!begun) assume (rst_i);
    begun <= 1'b1;
    quiet <= rst_i ? 4'd0 : quiet == 4'd15 ? quiet : quiet + 4'd1;
    soft_quiet <= rst_i || soft_reset ? 4'd0 : soft_quiet == 4'd15 ? soft_quiet
      : soft_quiet + 4'd1;
    was_soft <= soft_reset;
    line_due <= !soft_rst && (irq_status & irq_enable) != 8'd0;
    status_due <= soft_rst ? 8'd0 : (irq_status & ~irq_clear) | causes;
    if (begun) begin
      // Only rst_i resets the whole bridge; a soft reset resets what it is meant to.
      a_reset: assert (!rst_i || (rst && soft_rst));
      a_reset_ends: assert (quiet < 4'd8 || rst_i || !rst);
      a_soft_reset: assert (!was_soft || soft_rst);
      a_soft_reset_ends: assert (soft_quiet < 4'd8 || rst_i || !soft_rst);
      a_fs3: assert (!fs3_o);
      a_sda: assert (sda_low_o == (target_low || router_low));
      a_wanted: assert (wanted == (stream ? sensor_oe & extclk : 2'd0));
      if (!soft_rst) begin
        a_irq: assert (irq_o == line_due);
        a_status: assert (irq_status == status_due);
      end
      a_irq_in_reset: assert (!soft_rst || (!irq_o && irq_status == 8'd0));
      c_irq: cover (irq_o && !soft_rst);
      c_soft_reset: cover (soft_rst && !rst);
    end
  end
endmodule

`default_nettype wire
