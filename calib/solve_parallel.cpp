// SPDX-License-Identifier: Apache-2.0
#include "calib/solve_parallel.hpp"

#include <algorithm>
#include <atomic>
#include <thread>
#include <vector>

namespace calib {

void parallel_pieces(int threads, int count, const std::function<void(int)> &piece) {
    std::atomic<int> next{0};
    const auto work = [&] {
        for (int index = next++; index < count; index = next++) {
            piece(index);
        }
    };
    std::vector<std::thread> helpers;
    for (int i = 1; i < std::min(threads, count); i++) {
        helpers.emplace_back(work);
    }
    work();
    for (std::thread &helper : helpers) {
        helper.join();
    }
}

}  // namespace calib
