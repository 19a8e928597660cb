// SPDX-License-Identifier: Apache-2.0
/// Degraded pairs as they occur in the field: different exposures, noise, lenses, and pairs without
/// any surface.
#ifndef VERGENCE_TESTS_BENCH_DISTURBANCE_HPP
#define VERGENCE_TESTS_BENCH_DISTURBANCE_HPP

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "bench/harness/bench_pair.hpp"

/// A change of images that leaves the truth unchanged.
struct disturbance {
    const char *name;  // short, for a column
    const char *what;
    std::function<void(bench_pair &pair)> apply;  // changes a copy that shares no pixels
};

/// The first is "clean": no change. Noise is the same in every run.
const std::vector<disturbance> &photometric_disturbances();

/// The one whose growth measures a matcher's tolerance of exposure differences.
constexpr const char *disturbance_exposure = "exposure";
/// The one with noise of 1 % of the exposure.
constexpr const char *disturbance_noise = "noise";

/// A pair without a surface: every pixel kept of it is wrong.
struct disturbance_nothing {
    const char *name;
    const char *what;
    /// Made from a pair and, for the unrelated images, from another one.
    std::function<bench_pair(const bench_pair &pair, const bench_pair &other)> make;
};
const std::vector<disturbance_nothing> &no_surface_disturbances();

/// A copy with its own pixels.
bench_pair disturbance_copy(const bench_pair &pair);

#endif
