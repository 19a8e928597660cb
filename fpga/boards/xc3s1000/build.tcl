# SPDX-License-Identifier: Apache-2.0
#
# Makes the bitstream of the XC3S1000 with Xilinx ISE (14.7 is the last with Spartan-3):
#
#   cd an empty folder; xtclsh .../fpga/boards/xc3s1000/build.tcl [unplaced]
#
# unplaced: without pins, for size and timing only; no bitstream. Needs the vendor's tools, which we
# do not have: this script's commands follow published ISE scripts, and it has not been run yet.

set here [file dirname [file normalize [info script]]]
set fpga [file normalize [file join $here .. ..]]
set pins [file join $here xc3s1000_pins.ucf]
set unplaced [expr {[lindex $argv 0] eq "unplaced"}]

set file [open $pins]
set text [read $file]
close $file
if {![regexp -line {^# PART = (xc3s1000)(-[45])-(\w+)} $text all device speed package]} {
  error "no PART in $pins"
}
set missing [regexp -all -inline -line {^#NET "[^"]+"} $text]
if {[llength $missing] > 0 && !$unplaced} {
  error "[llength $missing] pins have no place in $pins: [join $missing {, }]"
}

project new bridge.xise
project set family Spartan3
project set device $device
project set package $package
project set speed $speed
project set top_level_module_type HDL
project set synthesis_tool "XST (VHDL/Verilog)"
project set "Verilog Include Directories" "$fpga/rtl|$fpga/generated" -process "Synthesize - XST"
# The synchronisers must stay flip-flops, and the gates of the clock switch as they are.
project set "Shift Register Extraction" FALSE -process "Synthesize - XST"
project set "Equivalent Register Removal" FALSE -process "Synthesize - XST"
project set "Keep Hierarchy" Soft -process "Synthesize - XST"
project set "Unused IOB Pins" "Float" -process "Generate Programming File"

foreach folder {rtl generated boards/common boards/xc3s1000} {
  foreach source [lsort [glob [file join $fpga $folder *.v]]] {
    xfile add $source
  }
}
xfile add $pins
xfile add [file join $here xc3s1000_timing.ucf]
project set top xc3s1000_top

set last [expr {$unplaced ? "Place & Route" : "Generate Programming File"}]
foreach step [list "Synthesize" "Translate" "Map" "Place & Route" "Generate Programming File"] {
  if {![process run $step]} { error "$step failed" }
  if {$step eq $last} { break }
}
project close
