// SPDX-License-Identifier: Apache-2.0
/// Our matcher behind the benchmark's interface.
#ifndef VERGENCE_TESTS_BENCH_BENCH_OURS_HPP
#define VERGENCE_TESTS_BENCH_BENCH_OURS_HPP

#include "bench/harness/bench_method.hpp"
#include "stereo/match/match.h"

/// Creates the matcher of a preset, with or without subsequent refinement of its disparities.
std::function<std::unique_ptr<bench_method>(const bench_pair &pair)> bench_ours(
    match_preset preset, bool refine = false);

#endif
