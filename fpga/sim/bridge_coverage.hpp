// SPDX-License-Identifier: Apache-2.0
/// Sums the coverage of all models of one process, for builds with VERGENCE_FPGA_COVERAGE.
#ifndef VERGENCE_FPGA_SIM_BRIDGE_COVERAGE_HPP
#define VERGENCE_FPGA_SIM_BRIDGE_COVERAGE_HPP

#if VM_COVERAGE
class Vbridge_sim;

/// Adds a model's counts before it is destroyed. At the end of the process the sum is written to
/// the file named by the environment variable VERGENCE_COVERAGE.
void add_coverage(Vbridge_sim &top);
#else
template <class Top>
void add_coverage(Top &) {}
#endif

#endif
