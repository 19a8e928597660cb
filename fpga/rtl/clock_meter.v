// SPDX-License-Identifier: Apache-2.0
//
// Watches one pixel clock from the control domain: says when it is lost, and gives a pulse for each
// 16 periods to rate_meter.
//
// pixel_clk_i  |||||||||||||||||||||||||||||_______________________________
// slow         _|^^^^|____|^^^^|____|^^^^^^^^^^^^^^^^^^^^^^^   pixel_clk_i / 32
// activity_o   ___|____|____|____|____|____________________   one clk_i for each change
// strobe_i     ____|_____|_____|_____|_____|_____|_____|___   every 50 us
// lost_o       __________________________________________|^   150 to 200 us after the last change
//
// Fit for pixel clocks up to 5 times clk_i. Latency of activity_o: 2 clk_i.

`default_nettype none

module clock_meter (
  input  wire clk_i,
  input  wire rst_i,
  input  wire pixel_clk_i,
  input  wire pixel_rst_i,
  input  wire strobe_i,
  output wire activity_o,
  output wire lost_o
);

  reg [4:0] divider;
  always @(posedge pixel_clk_i or posedge pixel_rst_i) begin
    if (pixel_rst_i) divider <= 5'd0;
    else divider <= divider + 5'd1;
  end

  wire slow;
  sync_bit crossing (
    .clk_i(clk_i),
    .rst_i(rst_i),
    .level_i(divider[4]),
    .level_o(slow)
  );

  reg slow_before;
  reg [2:0] quiet;
  assign activity_o = slow != slow_before;
  assign lost_o = quiet[2];
  always @(posedge clk_i or posedge rst_i) begin
    if (rst_i) begin
      slow_before <= 1'b0;
      quiet <= 3'd0;
    end else begin
      slow_before <= slow;
      if (activity_o) quiet <= 3'd0;
      else if (strobe_i && !lost_o) quiet <= quiet + 3'd1;
    end
  end

`ifdef PROVE_CLOCK_METER
  clock_meter_properties properties (
    .clk_i(clk_i), .rst_i(rst_i), .strobe_i(strobe_i), .slow(slow), .quiet(quiet),
    .activity_o(activity_o), .lost_o(lost_o)
  );
`endif

endmodule

`default_nettype wire
