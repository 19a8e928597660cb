// SPDX-License-Identifier: Apache-2.0
/// The few figures that our matcher is judged by, beside OpenCV's best mode.
#ifndef VERGENCE_TESTS_BENCH_BENCH_FIGURES_HPP
#define VERGENCE_TESTS_BENCH_BENCH_FIGURES_HPP

#include <vector>

#include "bench/harness/bench_run.hpp"

/// Prints a line for each rendered view and then a table of all figures, with a column for each of
/// standard, best, both refined, and OpenCV's best mode, if they have been run.
void bench_print_figures(const std::vector<bench_outcome> &outcomes);

#endif
