// SPDX-License-Identifier: Apache-2.0
/// Our matcher behind the benchmark's face.
#ifndef VERGENCE_TESTS_BENCH_BENCH_OURS_HPP
#define VERGENCE_TESTS_BENCH_BENCH_OURS_HPP

#include "bench/bench_method.hpp"

std::unique_ptr<bench_method> bench_make_match(const bench_pair &pair);
std::unique_ptr<bench_method> bench_make_refined(const bench_pair &pair);

#endif
