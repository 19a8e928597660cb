// SPDX-License-Identifier: Apache-2.0
/// Which of OpenCV's sensible settings is best for each of its modes.
#ifndef VERGENCE_TESTS_BENCH_BENCH_SETTINGS_HPP
#define VERGENCE_TESTS_BENCH_BENCH_SETTINGS_HPP

#include <vector>

#include "bench/harness/bench_opencv.hpp"

/// A setting and its mean over the pairs: filled, non-occluded.
struct bench_setting_score {
    opencv_setting setting;
    double bad_1px = 0, bad_2px = 0;
};

/// One mode: all candidates, the best first.
struct bench_setting_search {
    opencv_mode mode;
    std::vector<bench_setting_score> scores;
    bench_setting_score built_in;                // used by the benchmark
    std::vector<bench_setting_score> of_worker;  // its scores of the best and of the built-in one
};

/// Tries all candidates of the modes whose name contains `choice.only` on the pairs with ground
/// truth, in the linked OpenCV. The worker's, if there is one, runs only the best and the built-in
/// setting: the methods have not changed between versions, and this verifies it. Throws when no
/// pair has a truth.
std::vector<bench_setting_search> bench_search_settings(const std::vector<bench_pair> &pairs,
                                                        const bench_choice &choice);

void bench_print_settings(const std::vector<bench_setting_search> &searches, bool json);

#endif
