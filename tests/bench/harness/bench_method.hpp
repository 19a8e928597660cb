// SPDX-License-Identifier: Apache-2.0
/// The matchers under comparison behind one face.
#ifndef VERGENCE_TESTS_BENCH_BENCH_METHOD_HPP
#define VERGENCE_TESTS_BENCH_BENCH_METHOD_HPP

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "bench/harness/bench_pair.hpp"

class opencv_worker;

/// Time that one run took: on the clock, and of all processors together.
struct bench_time {
    double wall_ms = 0, cpu_ms = 0;
};

/// Runs `work` and times it.
bench_time bench_timed(const std::function<void()> &work);

/// One matcher on one pair. Made, run once for its memory, then any number of times.
class bench_method {
  public:
    virtual ~bench_method() = default;

    /// The first run, on one thread. Returns the working memory that it took beside images and
    /// result, in bytes; 0 where that cannot be told.
    virtual std::size_t first_run_bytes() = 0;

    /// One more run: from two grey images to a disparity map. What the method keeps from one run to
    /// the next is there already. Only this work is timed, not the change of the thread count.
    virtual bench_time run(int threads) = 0;

    /// The map of the last run; not finite where rejected.
    virtual std::vector<float> disparity_px() = 0;
};

struct bench_method_entry {
    std::string name, settings;
    bool is_ours;
    std::function<std::unique_ptr<bench_method>(const bench_pair &pair)> make;
};

/// Which methods, and how.
struct bench_choice {
    bool padded = true;  // OpenCV's images are widened so that it searches the left border too
    std::string only;    // part of the name; the reference is always taken. Empty: all
    std::shared_ptr<opencv_worker> worker;  // another OpenCV in its own process; NULL: none
};

/// Ours first, then OpenCV's. Throws when `only` matches none.
std::vector<bench_method_entry> bench_methods(const bench_choice &choice);

/// Names of the ones that times, errors and counts of better pairs are compared with.
constexpr const char *bench_reference = "SGBM 3-way plain";
constexpr const char *bench_best_mode = "SGBM HH4";
constexpr const char *bench_plain_mode = "SGBM";

#endif
