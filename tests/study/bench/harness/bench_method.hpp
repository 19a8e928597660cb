// SPDX-License-Identifier: Apache-2.0
/// A common interface to the matchers under comparison.
#ifndef VERGENCE_TESTS_BENCH_BENCH_METHOD_HPP
#define VERGENCE_TESTS_BENCH_BENCH_METHOD_HPP

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "bench/harness/bench_pair.hpp"

/// Time of one run: elapsed, and of all processors together.
struct bench_time {
    double wall_ms = 0, cpu_ms = 0;
};

/// Runs `work` and times it.
bench_time bench_timed(const std::function<void()> &work);

/// What our matcher knows about each pixel beyond the map; empty: unknown.
struct bench_planes {
    std::vector<float> guess_px;           // the disparity, of rejected pixels too
    std::vector<std::uint8_t> reason;      // enum reason
    std::vector<std::uint8_t> confidence;  // confidence of the winner
    std::vector<float> sigma_px;           // predicted, 0 where rejected
};

/// One matcher on one pair. Created, run once for its memory, then any number of times.
class bench_method {
  public:
    virtual ~bench_method() = default;

    /// The first run, on one thread. Returns the working memory in addition to images and result,
    /// in bytes; 0 if unknown.
    virtual std::size_t first_run_bytes() = 0;

    /// One more run: from two grey images to a disparity map. State that the method keeps between
    /// runs exists already. Only this work is timed, not the change of the thread count.
    virtual bench_time run(int threads) = 0;

    /// The map of the last run; not finite where rejected.
    virtual std::vector<float> disparity_px() = 0;

    /// Of the last run.
    virtual bench_planes planes() { return {}; }
};

struct bench_method_entry {
    std::string name, settings;
    bool is_ours;
    std::function<std::unique_ptr<bench_method>(const bench_pair &pair)> make;
};

/// Ours first, then OpenCV's: those whose name contains one of the texts in `only`, which commas
/// separate, and the reference. Throws when `only` matches no method.
std::vector<bench_method_entry> bench_methods(const std::string &only);

/// Names of the methods that times and errors are compared with.
constexpr const char *bench_reference = "SGBM 3-way plain";
constexpr const char *bench_best_mode = "SGBM HH4";

#endif
