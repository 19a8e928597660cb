// SPDX-License-Identifier: Apache-2.0
/// The matchers under comparison behind one face.
#ifndef VERGENCE_TESTS_BENCH_BENCH_METHOD_HPP
#define VERGENCE_TESTS_BENCH_BENCH_METHOD_HPP

#include <memory>
#include <string>
#include <vector>

#include "bench/bench_pair.hpp"

/// What stays the same over a whole comparison.
struct bench_setting {
    int threads = 1;
    bool padded = true;  // OpenCV's images are widened so that it searches the left border too
};

/// One matcher on one pair. Made, run any number of times, read once.
class bench_method {
  public:
    virtual ~bench_method() = default;

    /// The work that is timed: from two grey images to a disparity map. Memory that the method
    /// keeps from one pair to the next is there after the first run.
    virtual void run() = 0;

    /// The map of the last run; not finite where rejected.
    virtual std::vector<float> disparity_px() const = 0;

    /// Working memory beside images and result in bytes, when the method itself knows it; 0 when it
    /// is to be measured from outside during the first run.
    virtual std::size_t known_memory_bytes() const { return 0; }
};

struct bench_method_entry {
    const char *name;
    const char *settings;
    bool is_ours;
    std::unique_ptr<bench_method> (*make)(const bench_pair &pair, const bench_setting &setting);
};

/// Ours first, then OpenCV's. Name of the one that all times are compared with.
const std::vector<bench_method_entry> &bench_methods();
constexpr const char *bench_reference = "SGBM 3-way";

#endif
