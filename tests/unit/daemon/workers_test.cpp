// SPDX-License-Identifier: Apache-2.0
// The thread pool: every part runs once, on any thread, also if runs follow each other faster than
// threads wake up.
#include "daemon/base/workers.h"

#include <doctest/doctest.h>

#include <atomic>
#include <thread>
#include <vector>

namespace {

struct tally {
    std::vector<std::atomic<int>> runs;
    explicit tally(size_t parts) : runs(parts) {}
};

void count_part(void *context, int index) {
    static_cast<tally *>(context)->runs[static_cast<size_t>(index)]++;
}

struct pool {
    workers *handle;
    explicit pool(int threads) : handle(workers_create(threads)) { REQUIRE(handle != nullptr); }
    pool(const pool &) = delete;
    pool &operator=(const pool &) = delete;
    ~pool() { workers_destroy(handle); }
    void run(void (*part)(void *, int), void *context, int count) const {
        const parallel *work = workers_parallel(handle);
        work->run(work->self, part, context, count);
    }
};

}  // namespace

TEST_CASE("every part runs exactly once") {
    for (const int threads : {1, 2, 3, 8}) {
        const pool threads_pool(threads);
        CHECK(workers_parallel(threads_pool.handle)->threads == threads);
        for (const int count : {0, 1, 2, 7, 1000}) {
            tally seen(static_cast<size_t>(count));
            threads_pool.run(count_part, &seen, count);
            for (const std::atomic<int> &runs : seen.runs) {
                CHECK(runs == 1);
            }
        }
    }
}

TEST_CASE("short runs in close succession lose and repeat no part") {
    const pool threads_pool(4);
    long wrong = 0;
    for (int round = 0; round < 20000; round++) {
        const int count = 2 + round % 5;
        tally seen(5 + 2);
        threads_pool.run(count_part, &seen, count);
        for (int i = 0; i < 7; i++) {
            wrong += seen.runs[static_cast<size_t>(i)] != (i < count ? 1 : 0);
        }
    }
    CHECK(wrong == 0);
}

TEST_CASE("sleeping threads wake up") {
    const pool threads_pool(3);
    for (int round = 0; round < 5; round++) {
        std::this_thread::sleep_for(std::chrono::milliseconds(20));
        tally seen(64);
        threads_pool.run(count_part, &seen, 64);
        for (const std::atomic<int> &runs : seen.runs) {
            CHECK(runs == 1);
        }
    }
}

TEST_CASE("a part may start a nested run") {
    struct nested {
        const pool *threads_pool;
        tally inner{40};
    };
    const pool threads_pool(2);
    nested context{&threads_pool};
    threads_pool.run(
        [](void *self, int) {
            auto *outer = static_cast<nested *>(self);
            outer->threads_pool->run(count_part, &outer->inner, 40);
        },
        &context, 10);
    for (const std::atomic<int> &runs : context.inner.runs) {
        CHECK(runs == 10);
    }
}

TEST_CASE("all processors by default") {
    const pool threads_pool(0);
    CHECK(workers_parallel(threads_pool.handle)->threads >= 1);
    CHECK(workers_parallel(threads_pool.handle)->threads <= WORKERS_MAX_THREADS);
}
