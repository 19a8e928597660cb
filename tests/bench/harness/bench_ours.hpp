// SPDX-License-Identifier: Apache-2.0
/// Our matcher behind the benchmark's face.
#ifndef VERGENCE_TESTS_BENCH_BENCH_OURS_HPP
#define VERGENCE_TESTS_BENCH_BENCH_OURS_HPP

#include "bench/harness/bench_method.hpp"
#include "stereo/match/match.h"

/// Makes the matcher of a preset, with or without the refinement of its disparities after it.
std::function<std::unique_ptr<bench_method>(const bench_pair &pair)> bench_ours(
    match_preset preset, bool refine = false);

#endif
