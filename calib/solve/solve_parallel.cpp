// SPDX-License-Identifier: Apache-2.0
#include "calib/solve/solve_parallel.hpp"

#include <algorithm>
#include <atomic>
#include <exception>
#include <thread>
#include <vector>

#include "core/invariant.h"

namespace calib {

void parallel_pieces(int threads, int count, const std::function<void(int)> &piece,
                     const std::function<void()> &between) {
    std::atomic<int> next{0};
    INVARIANT(count >= 0);
    const auto work = [&](const std::function<void()> &before) {
        for (int index = next++; index < count; index = next++) {
            if (before) {
                before();
            }
            piece(index);
        }
    };
    std::vector<std::thread> helpers;
    for (int i = 1; i < std::min(threads, count); i++) {
        helpers.emplace_back(work, nullptr);
    }
    std::exception_ptr thrown;
    try {
        work(between);
    } catch (...) {
        thrown = std::current_exception();
        next = count;
    }
    for (std::thread &helper : helpers) {
        helper.join();
    }
    if (thrown) {
        std::rethrow_exception(thrown);
    }
}

}  // namespace calib
