// SPDX-License-Identifier: Apache-2.0
/// The benchmark's results as tables.
#ifndef VERGENCE_TESTS_BENCH_BENCH_REPORT_HPP
#define VERGENCE_TESTS_BENCH_BENCH_REPORT_HPP

#include <vector>

#include "bench/harness/bench_run.hpp"

/// Names the methods, their settings and the OpenCV version.
void bench_print_methods(const std::vector<bench_method_entry> &methods);

/// The results of all methods on one pair.
void bench_print_table(const bench_pair &pair, const std::vector<bench_outcome> &outcomes);

/// One line per method over all recorded pairs, in the order of the methods' first appearance:
/// errors, errors with one set left out, time and memory. Times are pooled over pairs with similar
/// counts of searched disparities. Then the rendered scenes by object, with and without those for
/// checking. At the end the figures of bench_figures.hpp.
void bench_print_summaries(const std::vector<bench_outcome> &outcomes);

#endif
