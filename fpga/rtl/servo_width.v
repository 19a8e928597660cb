// SPDX-License-Identifier: Apache-2.0
// The next width of a servo's pulse: request -> MIN, MAX -> slew limit -> hardware limits.
//
//   inputs       ==X= steady ====================
//   next_q4_o    ========================X= theirs     (5 clocks later)
//
// The hardware limits, 600 and 2400 us, come last, so that no input brings a width outside them.
// MAX counts if MIN > MAX. The slew limit has 11 bits (up to 127.9 us a frame, twice what the servo
// can follow), so with an actual width inside the hardware limits neither sum leaves 16 bits.
// Latency: 5 clocks, one for each limit: the control clock is faster than a chain of them.
`default_nettype none

module servo_width (
  input  wire        clk_i,
  input  wire        rst_i,
  input  wire [15:0] request_q4_i,
  input  wire [15:0] min_q4_i,
  input  wire [15:0] max_q4_i,
  input  wire [10:0] slew_q4_i,
  input  wire [15:0] actual_q4_i,
  output reg  [15:0] next_q4_o
);
  localparam [15:0] LOWEST_Q4 = 16'd9600;    // 600 us
  localparam [15:0] HIGHEST_Q4 = 16'd38400;  // 2400 us
  localparam [15:0] CENTRE_Q4 = 16'd24000;   // 1500 us

  reg [15:0] raised, limited, down, up, not_below, near;

  always @(posedge clk_i or posedge rst_i) begin
    if (rst_i) begin
      {raised, limited, down, up, not_below, near, next_q4_o} <= {7{CENTRE_Q4}};
    end else begin
      raised <= request_q4_i < min_q4_i ? min_q4_i : request_q4_i;
      limited <= raised > max_q4_i ? max_q4_i : raised;
      down <= actual_q4_i - {5'd0, slew_q4_i};
      up <= actual_q4_i + {5'd0, slew_q4_i};
      not_below <= limited < down ? down : limited;
      near <= not_below > up ? up : not_below;
      next_q4_o <= near < LOWEST_Q4 ? LOWEST_Q4 : near > HIGHEST_Q4 ? HIGHEST_Q4 : near;
    end
  end

`ifdef PROVE_SERVO_WIDTH
  servo_width_properties properties (
    .clk_i(clk_i), .rst_i(rst_i), .request_q4_i(request_q4_i), .min_q4_i(min_q4_i),
    .max_q4_i(max_q4_i), .slew_q4_i(slew_q4_i), .actual_q4_i(actual_q4_i), .next_q4_o(next_q4_o)
  );
`endif
endmodule

`default_nettype wire
