// SPDX-License-Identifier: Apache-2.0
// The thread pool under the matcher and the whole reconstruction: the same bytes for any number of
// threads, run after run, also with two pools at once.
#include <doctest/doctest.h>

#include <memory>
#include <thread>

#include "core/error.h"
#include "daemon/base/workers.h"
#include "stereo/refine.h"
#include "synthetic/matched.hpp"
#include "synthetic/scenes.hpp"
#include "synthetic/seed.hpp"

using namespace synthetic;

namespace {

struct Pool {
    explicit Pool(int threads) : workers(workers_create(threads), workers_destroy) {}
    const struct parallel *parallel() const { return workers_parallel(workers.get()); }
    std::unique_ptr<struct workers, void (*)(struct workers *)> workers;
};

Pair test_pair(uint64_t seed) {
    const Rig rig = rectified_rig(200, 150, 800, 100);
    RenderOptions options;
    options.seed = seed;
    options.left.noise_grey = options.right.noise_grey = 1;
    return render(everything(rig, 40, {3, 0.15}, seed), rig, options);
}

struct Answer {
    std::vector<int32_t> disparity_q8;
    std::vector<uint8_t> reason;
    std::vector<uint16_t> sigma_q8;
    bool operator==(const Answer &other) const {
        return disparity_q8 == other.disparity_q8 && reason == other.reason &&
               sigma_q8 == other.sigma_q8;
    }
};

// Doctest's checks work only on its own thread: an empty answer means failure.
Answer answer_of(const Pair &pair, const struct parallel *parallel) {
    MatchSetting setting;
    setting.parallel = parallel;
    Matched matched = run_match(pair, match_default_options(0, 48), setting);
    matched.bind();
    Answer answer;
    answer.sigma_q8.resize(matched.reason.size());
    image_u16 sigma = {answer.sigma_q8.data(), matched.width, matched.height, matched.width};
    const Memory memory(refine_need_bytes(matched.width, matched.height, parallel->threads));
    arena arena;
    arena_init(&arena, memory.data(), memory.size());
    if (matched.status != ERROR_OK ||
        refine_disparities(&matched.input, parallel, &arena, &matched.output, &sigma) != ERROR_OK) {
        return {};
    }
    answer.disparity_q8 = matched.disparity_q8;
    answer.reason = matched.reason;
    return answer;
}

}  // namespace

TEST_CASE("the pool gives the same bytes as one thread, repeatedly") {
    const uint64_t seed = test_seed();
    INFO("VERGENCE_SEED=", seed);
    const Pair pair = test_pair(seed);
    const Answer serial = answer_of(pair, &parallel_serial);
    REQUIRE(!serial.reason.empty());
    for (int threads = 1; threads <= 8; threads++) {
        const Pool pool(threads);
        REQUIRE(pool.workers != nullptr);
        CAPTURE(threads);
        for (int round = 0; round < 3; round++) {
            CHECK(answer_of(pair, pool.parallel()) == serial);
        }
    }
}

TEST_CASE("two pools at once do not interfere") {
    const uint64_t seed = test_seed();
    INFO("VERGENCE_SEED=", seed);
    const Pair pairs[2] = {test_pair(seed), test_pair(seed + 1)};
    Answer together[2];
    std::thread other([&] {
        const Pool pool(3);
        together[1] = answer_of(pairs[1], pool.parallel());
    });
    {
        const Pool pool(2);
        together[0] = answer_of(pairs[0], pool.parallel());
    }
    other.join();
    for (int i = 0; i < 2; i++) {
        REQUIRE(!together[i].reason.empty());
        CHECK(together[i] == answer_of(pairs[i], &parallel_serial));
    }
    CHECK(!(together[0] == together[1]));
}
