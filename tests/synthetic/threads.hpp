// SPDX-License-Identifier: Apache-2.0
/// A simple implementation of core's `struct parallel` for tests: parts run in an order shuffled by
/// a seed and on any number of threads, so that no result can depend on either.
#ifndef VERGENCE_TESTS_SYNTHETIC_THREADS_HPP
#define VERGENCE_TESTS_SYNTHETIC_THREADS_HPP

#include <atomic>
#include <cstdint>

#include "core/parallel.h"

namespace synthetic {

class Threads {
  public:
    explicit Threads(int threads, uint64_t seed = 1);
    Threads(const Threads &) = delete;
    Threads &operator=(const Threads &) = delete;

    const struct parallel *parallel() const { return &parallel_; }
    int calls() const { return calls_; }

  private:
    static void run(void *self, void (*part)(void *context, int index), void *context, int count);

    struct parallel parallel_;
    uint64_t seed_;
    std::atomic<int> calls_{0};
};

}  // namespace synthetic

#endif
