// SPDX-License-Identifier: Apache-2.0
/// What goes wrong with pairs in the field: exposures that differ, noise, lenses, and pairs in
/// which there is no surface to be found at all.
#ifndef VERGENCE_TESTS_BENCH_TROUBLE_HPP
#define VERGENCE_TESTS_BENCH_TROUBLE_HPP

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "bench/harness/bench_pair.hpp"

/// A change of images that leaves the truth as it is.
struct trouble_case {
    const char *name;  // short, for a column
    const char *what;
    std::function<void(bench_pair &pair)> apply;  // to a copy that shares no pixels
};

/// The first is "clean": no change at all. Noise is the same in every run.
const std::vector<trouble_case> &photometric_troubles();

/// The one by whose growth a matcher's patience with exposures is judged.
constexpr const char *trouble_exposure = "exposure";

/// A pair without a surface: whatever is kept of it is wrong.
struct trouble_nothing {
    const char *name;
    const char *what;
    /// Made from a pair and, for the unrelated images, from another.
    std::function<bench_pair(const bench_pair &pair, const bench_pair &other)> make;
};
const std::vector<trouble_nothing> &no_surface_troubles();

/// A copy with pixels of its own.
bench_pair trouble_copy(const bench_pair &pair);

#endif
