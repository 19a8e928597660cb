// SPDX-License-Identifier: Apache-2.0
//
// The PPI's pins: data and the two frame syncs. clk_i is the inverted PPI clock: the pins change
// at its falling edge, the DSP samples at its rising one.
//
// clk_i            ^|_|^|_|^|_|^|_|^|_|^|_|^|_|^|_|^|_|^|_|^|_|^|_|^|_
// open_i           |^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^
// frame_i          ____|^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^|____________
// line_i           ________|^^^^^^^^^|_____|^^^^^^^^^|___________________
// line_o (FS1)     __________|^^^^^^^^^|_____|^^^^^^^^^|_________________
// frame_o (FS2)    ______|^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^|__________    first_line_i = 0
// frame_o (FS2)    __________|^^^^^^^^^|_______________________________    first_line_i = 1
//
// A line exists only inside a frame that the gate lets through. With tag_i the first pixel of a
// frame is {source_i, number of the frame since reset}, and so is data_o before it. `waiting` and
// `counted` keep what lies between a source's flip-flop and those here short: it is half a period.
// Both modes, and the source, are taken while the gate is closed; they may come from any domain.
// counter_rst_i starts the number again; rst_i, given while the clock is stopped, only the rest.
// Latency: half a period.

`default_nettype none

module ppi_output (
  input  wire clk_i,
  input  wire rst_i,
  input  wire counter_rst_i,
  input  wire first_line_i,
  input  wire tag_i,
  input  wire [1:0] source_i,
  input  wire open_i,
  input  wire [9:0] data_i,
  input  wire line_i,
  input  wire frame_i,
  output reg  [9:0] data_o,
  output reg  line_o,
  output reg  frame_o,
`ifdef PROVE_STREAM_SWITCH
  output wire waiting_o,
`endif
  output reg  passing_o
);

  reg first_line;
  reg tag;
  reg after_first;
  reg waiting;             // for the first pixel
  reg counted;
  reg [7:0] number;

`ifdef PROVE_STREAM_SWITCH
  assign waiting_o = waiting;
`endif

  wire frame = frame_i && open_i;
  wire line = line_i && frame;
  wire first_pixel = line && waiting;
  wire now_after_first = frame && (after_first || (line_o && !line));

  always @(posedge clk_i or posedge rst_i) begin
    if (rst_i) begin
      first_line <= 1'b0;
      tag <= 1'b0;
      after_first <= 1'b0;
      waiting <= 1'b1;
      data_o <= 10'd0;
      line_o <= 1'b0;
      frame_o <= 1'b0;
      passing_o <= 1'b0;
    end else begin
      if (!open_i) begin
        first_line <= first_line_i;
        tag <= tag_i;
      end
      after_first <= now_after_first;
      waiting <= !line && !now_after_first;
      data_o <= tag && waiting ? {source_i, number} : data_i;
      line_o <= line;
      frame_o <= first_line ? line && !after_first : frame;
      passing_o <= frame;
    end
  end

  always @(posedge clk_i or posedge counter_rst_i) begin
    if (counter_rst_i) begin
      counted <= 1'b0;
      number <= 8'd0;
    end else begin
      counted <= first_pixel;
      if (counted) number <= number + 8'd1;
    end
  end

`ifdef PROVE_PPI_OUTPUT
  ppi_output_properties properties (
    .clk_i(clk_i), .rst_i(rst_i), .counter_rst_i(counter_rst_i), .first_line_i(first_line_i),
    .tag_i(tag_i), .source_i(source_i), .open_i(open_i), .data_i(data_i), .line_i(line_i),
    .frame_i(frame_i), .data_o(data_o), .line_o(line_o), .frame_o(frame_o),
    .passing_o(passing_o), .first_line(first_line), .tag(tag), .after_first(after_first),
    .waiting(waiting), .counted(counted), .number(number)
  );
`endif

endmodule

`default_nettype wire
