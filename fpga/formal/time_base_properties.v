// SPDX-License-Identifier: Apache-2.0
// Properties of time_base: exact distances between ticks, in ticks.
`default_nettype none

module time_base_properties (
  input wire clk_i,
  input wire rst_i,
  input wire tick_us_i,
  input wire tick_10us_o,
  input wire tick_50us_o,
  input wire tick_ms_o,
  input wire tick_16ms_o,
  input wire [3:0] tens,
  input wire [2:0] fives,
  input wire [4:0] twenties,
  input wire [3:0] sixteens
);
  reg begun = 1'b0;
  reg [9:0] us_1000;
  reg ms_ended;                   // in the clock before
  wire [9:0] us_1000_now = us_1000 + {9'd0, tick_us_i};
  reg [5:0] us_10, us_50, ms_16;  // ticks since the last one that came out
  wire [5:0] us_10_now = us_10 + {5'd0, tick_us_i};
  wire [5:0] us_50_now = us_50 + {5'd0, tick_us_i};
  wire [5:0] ms_16_now = ms_16 + {5'd0, tick_ms_o};
  always @(posedge clk_i) begin
    if (!begun) assume (rst_i);
    begun <= 1'b1;
    us_10 <= rst_i || tick_10us_o ? 6'd0 : us_10_now;
    us_50 <= rst_i || tick_50us_o ? 6'd0 : us_50_now;
    us_1000 <= rst_i || us_1000_now == 10'd1000 ? 10'd0 : us_1000_now;
    ms_ended <= !rst_i && us_1000_now == 10'd1000;
    ms_16 <= rst_i || tick_16ms_o ? 6'd0 : ms_16_now;
    if (begun && !rst_i) begin
      a_10us: assert (tick_10us_o == (us_10_now == 6'd10 && tick_us_i));
      a_50us: assert (tick_50us_o == (us_50_now == 6'd50 && tick_us_i));
      a_ms: assert (tick_ms_o == ms_ended);
      a_16ms: assert (tick_16ms_o == (ms_16_now == 6'd16 && tick_ms_o));
      // Helps the induction.
      a_state: assert (us_10 == {2'd0, tens} && us_10 < 6'd10 && us_50 < 6'd50 &&
                       us_50 == fives * 10 + {2'd0, tens} && ms_16 == {2'd0, sixteens} &&
                       twenties < 5'd20 && us_1000 == twenties * 50 + {4'd0, us_50});
    end
    c_50us: cover (begun && !rst_i && tick_50us_o);
  end
endmodule

`default_nettype wire
