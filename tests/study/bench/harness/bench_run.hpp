// SPDX-License-Identifier: Apache-2.0
/// Runs methods on a pair: error, memory and times in interleaved rounds.
#ifndef VERGENCE_TESTS_BENCH_BENCH_RUN_HPP
#define VERGENCE_TESTS_BENCH_BENCH_RUN_HPP

#include <cmath>
#include <map>
#include <string>
#include <vector>

#include "bench/harness/bench_method.hpp"
#include "bench/harness/bench_region.hpp"
#include "tools/host/evaluate/evaluate.hpp"

/// Quality of the pixels, seen by both cameras, that the method did not reject.
struct bench_kept {
    double density_percent = 0;  // share of kept among known pixels
    double bad_3px_percent = 0;  // share of kept pixels with an error above 3 px
};

/// Error of a map.
struct bench_error {
    evaluate_result all;
    bench_kept visible;
};

/// Errors of a map against the pair's truth, which must exist.
bench_error bench_error_of(const bench_pair &pair, const std::vector<float> &disparity_px);

/// Rms of error over predicted sigma (and the rounding of a truth that is stored in steps), of the
/// kept visible pixels that are off by at most 1 px (the others are wrong matches, not noise). NaN
/// without sigma, or with truth in whole pixels.
double bench_z_rms(const bench_pair &pair, const std::vector<float> &disparity_px,
                   const std::vector<float> &sigma_px);

/// The map, filled as `vergence reconstruct --fill` does; not finite where that fills nothing.
std::vector<float> bench_filled(const bench_pair &pair, const std::vector<float> &disparity_px);

/// Share of finite values in percent.
double bench_density_percent(const std::vector<float> &disparity_px);

/// Median, quartiles and so on, by linear interpolation; 0 without values.
double bench_quantile(std::vector<double> values, double share);
struct bench_spread {
    double median = 0, low = 0, high = 0;  // quartiles
};
bench_spread bench_spread_of(const std::vector<double> &values);

/// Times of one method, one per round.
struct bench_times {
    std::vector<double> wall_ms;  // elapsed time of each round
    std::vector<double> ratios;   // relative to the reference with as many in the same round
};

struct bench_outcome {
    std::string pair, set, part, method;  // see bench_pair.hpp
    bool is_ours = false;
    int width = 0, height = 0, disparities = 0;
    bool has_truth = false;
    bench_error error;
    double z_rms = NAN;                 // see bench_z_rms
    double filled_bad_1px = 0;          // bad-1.0 filled as `vergence reconstruct --fill` does
    std::vector<float> disparity_px;    // not finite where rejected
    bench_planes planes;                // planes of the same run
    std::vector<double> noise_bad_1px;  // bad-1.0 with noise of 1 % exposure; empty: not measured
    std::vector<bench_region> regions;  // regions of rendered scenes
    double density_percent = 0;         // share of all pixels that are not rejected
    std::size_t memory_bytes = 0;
    std::map<int, bench_times> times;  // key: number of threads
    std::vector<double> speedups;      // one thread's time over that of two, one per round

    /// 24 bytes per column and disparity and 64 per column: the allowance of a row-based matcher.
    std::size_t allowance_bytes() const {
        return static_cast<std::size_t>(width) * (24 * static_cast<std::size_t>(disparities) + 64);
    }
};

struct bench_rounds {
    int count = 7;             // 0: no timing
    bool two_threads = false;  // each run is followed by one on two threads
};

/// All methods on one pair. In a round each method runs once, in another order each time. Methods
/// four times slower than the reference run in every third round only.
std::vector<bench_outcome> bench_run_pair(const std::vector<bench_method_entry> &methods,
                                          const bench_pair &pair, const bench_rounds &rounds);

#endif
