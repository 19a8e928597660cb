// SPDX-License-Identifier: Apache-2.0
#include "synthetic/threads.hpp"

#include <algorithm>
#include <numeric>
#include <thread>
#include <vector>

#include "synthetic/scene.hpp"

namespace synthetic {

Threads::Threads(int threads, uint64_t seed)
    : parallel_{run, this, threads, nullptr}, seed_(seed) {}

void Threads::run(void *self, void (*part)(void *context, int index), void *context, int count) {
    auto *threads = static_cast<Threads *>(self);
    Random random(threads->seed_ + static_cast<uint64_t>(threads->calls_++));
    std::vector<int> order(static_cast<size_t>(count));
    std::iota(order.begin(), order.end(), 0);
    for (size_t i = order.size(); i > 1; i--) {
        std::swap(order[i - 1], order[random.bits() % i]);
    }
    std::atomic<size_t> next{0};
    const auto work = [&] {
        for (size_t i = next++; i < order.size(); i = next++) {
            part(context, order[i]);
        }
    };
    std::vector<std::thread> helpers;
    for (int i = 1; i < std::min(threads->parallel_.threads, count); i++) {
        helpers.emplace_back(work);
    }
    work();
    for (std::thread &helper : helpers) {
        helper.join();
    }
}

}  // namespace synthetic
