// SPDX-License-Identifier: Apache-2.0
//
// Edges of SCL, START and STOP on an I2C bus, from filtered lines.
//
//             ________________________          _______
// scl_i     _|                        |________|
//           ____________
// sda_i                 |______________________________
// start_o   ____________________|^|____________________    HOLD clocks after the edge of SDA
// scl_fall_o __________________________|^|_____________
//
// A change of SDA counts as START or STOP only if SCL stays high for HOLD clocks after it: near an
// edge of SCL, filters and slow edges can show a change of data too early. HOLD clocks and the
// filters' uncertainty must stay below the 260 ns that a START lasts at 1 MHz.
// Latency: edges 0 clocks (combinational), START and STOP HOLD clocks.

`default_nettype none

module bus_condition #(
  parameter HOLD = 2
) (
  input  wire clk_i,
  input  wire rst_i,
  input  wire scl_i,
  input  wire sda_i,
  output wire scl_rise_o,
  output wire scl_fall_o,
  output wire start_o,
  output wire stop_o
);

  reg scl_last;
  reg sda_last;
  reg [HOLD-1:0] changed;
  wire change = scl_i && scl_last && sda_i != sda_last;

  always @(posedge clk_i or posedge rst_i) begin
    if (rst_i) begin
      scl_last <= 1'b1;
      sda_last <= 1'b1;
      changed <= {HOLD{1'b0}};
    end else begin
      scl_last <= scl_i;
      sda_last <= sda_i;
      changed <= scl_i ? {changed[HOLD-2:0], change} : {HOLD{1'b0}};
    end
  end

  assign scl_rise_o = scl_i && !scl_last;
  assign scl_fall_o = !scl_i && scl_last;
  assign start_o = changed[HOLD-1] && scl_i && !sda_i;
  assign stop_o = changed[HOLD-1] && scl_i && sda_i;

`ifdef PROVE_BUS_CONDITION
  bus_condition_properties #(.HOLD(HOLD)) properties (
    .clk_i(clk_i), .rst_i(rst_i), .scl_i(scl_i), .sda_i(sda_i), .scl_rise_o(scl_rise_o),
    .scl_fall_o(scl_fall_o), .start_o(start_o), .stop_o(stop_o), .scl_last_i(scl_last),
    .sda_last_i(sda_last)
  );
`endif

endmodule

`default_nettype wire
