// SPDX-License-Identifier: Apache-2.0
/// One line per method over all pairs.
#ifndef VERGENCE_TESTS_BENCH_BENCH_SUMMARY_HPP
#define VERGENCE_TESTS_BENCH_BENCH_SUMMARY_HPP

#include <string>
#include <vector>

#include "bench/harness/bench_run.hpp"

/// Pairs with similar counts of searched disparities, over which times are pooled.
struct bench_group {
    const char *name;
    int min, max;  // disparities
};
constexpr bench_group bench_groups[] = {
    {"below 48", 1, 47},
    {"64 (48..96)", 48, 96},
    {"97..127", 97, 127},
    {"128 and more", 128, 1024},
};

struct bench_group_time {
    const bench_group *group;
    int pairs = 0;
    bench_spread ratio,
        cpu_ratio;  // relative to the reference, 1 thread, over all rounds of all its pairs
};

struct bench_summary {
    std::string method;
    bool is_ours = false;
    int pairs = 0;                    // with ground truth; the means are over these
    double bad_1px = 0, bad_2px = 0;  // filled, non-occluded, percent
    double to_best_mode = 0;          // bad_1px over that of OpenCV's HH4; 0: not run
    int against_plain = 0;            // pairs on which OpenCV's SGBM ran
    int better_than_plain = 0;        // of these, the ones with less bad_1px than it
    int better_than_all = 0;          // pairs with less than every OpenCV method of the run
    bench_kept visible, known;
    double worst_of_allowance_percent = 0;  // memory, on the pair with the largest value
    std::vector<bench_group_time> times;    // of the groups that have pairs
    bench_spread speedup;                   // by a second thread, over all rounds; 0: not run
};

/// In the order of the methods' first appearance.
std::vector<bench_summary> bench_summaries(const std::vector<bench_outcome> &all);

#endif
