// SPDX-License-Identifier: Apache-2.0
/// What the benchmark found, as a table for people and as JSON for programs.
#ifndef VERGENCE_TESTS_BENCH_BENCH_REPORT_HPP
#define VERGENCE_TESTS_BENCH_BENCH_REPORT_HPP

#include <map>
#include <string>
#include <vector>

#include "bench/bench_pair.hpp"
#include "tools/host/evaluate.hpp"

struct bench_timing {
    double best_ms = 0;
    double ratio = 0, ratio_low = 0, ratio_high = 0;  // to the reference: median, quartiles
};

struct bench_outcome {
    std::string pair, method;
    bool is_ours = false;
    int width = 0, height = 0, disparities = 0;
    bool has_truth = false;
    evaluate_result errors;
    double density_percent = 0;
    std::size_t memory_bytes = 0;
    std::map<int, bench_timing> timing_by_threads;
};

/// The outcomes of all methods on one pair, in lines.
void bench_print_table(const bench_pair &pair, const std::vector<bench_outcome> &outcomes);

/// Means over all pairs that have a truth or times.
void bench_print_means(const std::vector<bench_outcome> &all);

/// Everything as one JSON object on standard output.
void bench_print_json(const std::vector<bench_outcome> &all, int rounds, bool padded);

#endif
