// SPDX-License-Identifier: Apache-2.0
// Pairs of two cameras with one trigger line.
#include <doctest/doctest.h>

#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <deque>
#include <functional>
#include <random>
#include <string>
#include <vector>

#include "core/error.h"
#include "rig/pair.h"
#include "synthetic/seed.hpp"

namespace {

constexpr uint32_t kWidth = 640, kHeight = 480;
constexpr uint64_t kLimitUs = 2000000;  // time limit for the report of a failure

struct World;

// Delivers a grey frame after each pulse that it sees.
struct Camera {
    World *world;
    const char *name;
    uint16_t level;
    uint64_t delay_us = 0;  // delay from the pulse to the first pixel
    uint64_t readout_us = 20000;
    uint64_t stamp_us = 0;  // stamps of the first pixel are this much too early
    bool wired = true, gone = false, started = false;
    int lent = 0;
    unsigned pulses = 0, lose = 0, tear = 0;  // 1: the next frame, 2: that after it, ...
    struct Held {
        uint64_t begin_us, end_us;
        uint32_t faults;
    };
    std::deque<Held> held{};
    std::vector<uint16_t> values = std::vector<uint16_t>(size_t(kWidth) * kHeight, level);

    void pulse();
    static int start(void *self, const hal_camera_format *);
    static int stop(void *self);
    static int take(void *self, uint64_t not_before_us, uint64_t deadline_us,
                    hal_camera_frame *frame);
    static void release(void *self);
};

struct World {
    uint64_t time_us = 1000000;
    uint64_t first_failed_us = 0;
    Camera cameras[2]{{this, "left", 50}, {this, "right", 90}};
    bool active = false;
    std::vector<bool> levels{};  // levels set so far
    uint64_t active_us = 0, longest_us = 0;
    unsigned sets = 0, fails_from = 0, fails_to = 0;  // calls of set, from 1
    int fails_with = ERROR_IO;
    std::function<bool()> keep_going = [] { return true; };

    static World &of(void *self) { return *static_cast<World *>(self); }
    static uint64_t now(void *self) { return of(self).time_us; }
    static void wait(void *self, uint64_t until_us) {
        of(self).time_us = std::max(of(self).time_us, until_us);
    }
    static int set(void *self, hal_gpio_line line, bool active) {
        World &me = of(self);
        REQUIRE(line == HAL_GPIO_TRIGGER);
        me.sets++;
        if (me.sets >= me.fails_from && me.sets <= me.fails_to) {
            me.failed();
            return me.fails_with;
        }
        me.levels.push_back(active);
        if (active && !me.active) {
            me.active_us = me.time_us;
            for (Camera &camera : me.cameras) {
                camera.pulse();
            }
        }
        if (!active && me.active) {
            me.longest_us = std::max(me.longest_us, me.time_us - me.active_us);
        }
        me.active = active;
        return ERROR_OK;
    }
    void failed() { first_failed_us = first_failed_us == 0 ? time_us : first_failed_us; }
};

void Camera::pulse() {
    if (!started || !wired) {
        return;
    }
    pulses++;
    const uint64_t begin_us = world->time_us + delay_us;
    // Still busy with the last frame: it misses the pulse.
    if (!held.empty() && held.back().end_us > world->time_us) {
        FAIL("a pulse while the camera reads out");
    }
    const bool lost = lose != 0 && --lose == 0;
    const bool torn = tear != 0 && --tear == 0;
    if (!lost && held.size() < 4) {
        held.push_back({begin_us, begin_us + readout_us, torn ? uint32_t(HAL_CAMERA_DAMAGED) : 0});
    }
}
int Camera::start(void *self, const hal_camera_format *) {
    auto &me = *static_cast<Camera *>(self);
    if (me.gone) {
        me.world->failed();
        return ERROR_DEVICE;
    }
    me.started = true;
    me.held.clear();
    return ERROR_OK;
}
int Camera::stop(void *self) {
    auto &me = *static_cast<Camera *>(self);
    me.started = false;
    return ERROR_OK;
}
int Camera::take(void *self, uint64_t not_before_us, uint64_t deadline_us,
                 hal_camera_frame *frame) {
    auto &me = *static_cast<Camera *>(self);
    REQUIRE(me.started);
    if (me.gone) {
        me.world->failed();
        return ERROR_DEVICE;
    }
    while (!me.held.empty() && me.held.front().begin_us - me.stamp_us < not_before_us) {
        me.held.pop_front();
    }
    if (me.held.empty() ||
        (me.held.front().end_us > deadline_us && me.held.front().end_us > me.world->time_us)) {
        World::wait(me.world, deadline_us);
        return ERROR_TIMEOUT;
    }
    const Held got = me.held.front();
    me.held.pop_front();
    World::wait(me.world, got.end_us);
    me.lent++;
    frame->image = {me.values.data(), kWidth, kHeight, kWidth, 8, RAW_GREY, release, &me};
    frame->sequence = me.pulses;
    frame->faults = got.faults;
    frame->begin_us = got.begin_us - me.stamp_us;
    frame->end_us = got.end_us;
    return ERROR_OK;
}
void Camera::release(void *self) {
    static_cast<Camera *>(self)->lent--;
}

constexpr hal_clock_operations kClock = {World::now, World::wait, nullptr};
constexpr hal_gpio_operations kGpio = {World::set, nullptr};
constexpr hal_camera_operations kCamera = {Camera::start, Camera::stop, Camera::take, nullptr,
                                           nullptr};

struct Triggered {
    World world{};
    hal_clock clock{&kClock, &world};
    hal_gpio gpio{&kGpio, &world};
    hal_camera ports[2]{{&kCamera, &world.cameras[0]}, {&kCamera, &world.cameras[1]}};
    ::rig rig{};
    Camera &left = world.cameras[0], &right = world.cameras[1];

    explicit Triggered(uint32_t trigger_us = 1000) {
        rig_profile profile{};
        REQUIRE(rig_profile_named("two-cameras", &profile) == ERROR_OK);
        profile.trigger = true;
        profile.trigger_us = trigger_us;
        rig_ports hangs_on{};
        hangs_on.clock = &clock;
        hangs_on.camera[RIG_LEFT] = &ports[RIG_LEFT];
        hangs_on.camera[RIG_RIGHT] = &ports[RIG_RIGHT];
        CHECK(std::string(rig_ports_missing(&profile, &hangs_on)) == "a trigger line");
        hangs_on.gpio = &gpio;
        const rig_observer observer = {
            [](void *self) { return !static_cast<World *>(self)->keep_going(); }, nullptr, &world};
        rig_init(&rig, &profile, &hangs_on, &observer);
    }
    Triggered(const Triggered &) = delete;
    Triggered &operator=(const Triggered &) = delete;
    int capture(::pair &pair, bool check_static = false) {
        const pair_options options = {check_static, 0, 0, 0, nullptr};
        const int error = pair_capture(&rig, &options, &pair);
        // The pixels remain, as they belong to the cameras.
        pair_frame frames[] = {pair.frame[RIG_LEFT], pair.frame[RIG_RIGHT]};
        if (error == ERROR_OK) {
            pair_release(frames);
        }
        return error;
    }
    std::string text() const { return rig.last_error.text; }
    // The line is inactive and no frame is left on loan.
    void check_rest() {
        CHECK(!world.active);
        CHECK(left.lent == 0);
        CHECK(right.lent == 0);
    }
};

}  // namespace

TEST_CASE("one pulse is one pair, whose frames begin with it") {
    std::mt19937_64 random(synthetic::test_seed());
    for (int i = 0; i < 20; i++) {
        const auto trigger_us = uint32_t(100 + random() % 30000);
        Triggered two(trigger_us);
        // Drivers that stamp the last pixel may compute a first one that is too early.
        two.left.stamp_us = two.right.stamp_us = i % 2 == 0 ? 0 : random() % 40000;
        two.left.readout_us = 1 + random() % 150000;
        two.right.readout_us = 1 + random() % 150000;
        two.right.delay_us = random() % 1000;
        REQUIRE(rig_bringup(&two.rig) == ERROR_OK);
        for (int k = 0; k < 3; k++) {
            two.world.time_us += random() % 10000000;  // a long idle time is not a failure
            const unsigned pulses = two.left.pulses;
            two.world.longest_us = 0;
            ::pair pair{};
            REQUIRE(two.capture(pair, k == 2) == ERROR_OK);
            CHECK(pair.skew_us == int64_t(two.right.delay_us));
            CHECK(two.left.pulses == pulses + (k == 2 ? 2 : 1));
            CHECK(two.right.pulses == two.left.pulses);
            CHECK(two.world.longest_us == trigger_us);
            CHECK(pair.frame[RIG_LEFT].image.data[3] == 50);
            CHECK(pair.frame[RIG_RIGHT].image.data[kWidth * kHeight - 1] == 90);
            two.check_rest();
        }
        CHECK(two.rig.health[RIG_PART_TRIGGER_LINE].present);
        CHECK(two.rig.health[RIG_PART_TRIGGER_LINE].failures == 0);
        REQUIRE(rig_check(&two.rig) == ERROR_OK);
    }
}

TEST_CASE("what the cameras hold of before is none of the pair") {
    Triggered two;
    REQUIRE(rig_bringup(&two.rig) == ERROR_OK);
    // Pulses of another program fill the drivers' buffers: later frames would be lost.
    for (int i = 0; i < 6; i++) {
        two.left.pulse();
        two.right.pulse();
        two.world.time_us += 100000;
    }
    two.right.values.assign(two.right.values.size(), 91);
    const uint64_t before_us = two.world.time_us;
    ::pair pair{};
    REQUIRE(two.capture(pair) == ERROR_OK);
    CHECK(pair.frame[RIG_LEFT].begin_us >= before_us);
    CHECK(pair.frame[RIG_RIGHT].begin_us >= before_us);
}

TEST_CASE("a frame that is lost or torn is taken again, of both with one pulse") {
    for (const bool torn : {false, true}) {
        Triggered two;
        REQUIRE(rig_bringup(&two.rig) == ERROR_OK);
        const unsigned pulses = two.left.pulses;
        (torn ? two.right.tear : two.right.lose) = 1;
        ::pair pair{};
        REQUIRE(two.capture(pair) == ERROR_OK);
        CHECK(two.left.pulses == pulses + 2);
        CHECK(pair.frame[RIG_LEFT].sequence == pair.frame[RIG_RIGHT].sequence);
        CHECK(pair.skew_us == 0);
        two.check_rest();
    }
}

TEST_CASE("without the pulse no frame comes: reported within two seconds, with camera and line") {
    for (const unsigned side : {RIG_LEFT, RIG_RIGHT}) {
        Triggered two;
        two.world.cameras[side].wired = false;
        const uint64_t begin_us = two.world.time_us;
        CHECK(rig_bringup(&two.rig) == ERROR_TIMEOUT);
        CHECK(two.world.time_us - begin_us < kLimitUs);
        const std::string camera = side == RIG_LEFT ? "left camera: " : "right camera: ";
        const std::string text = two.text();
        CHECK_MESSAGE(text.rfind(camera, 0) == 0, text);
        CHECK_MESSAGE(text.find("trigger_line") != std::string::npos, text);
        CHECK(two.rig.state == RIG_SAFE);
        CHECK(!two.left.started);
        two.check_rest();
        two.world.cameras[side].wired = true;
        REQUIRE(rig_bringup(&two.rig) == ERROR_OK);
        two.world.cameras[side].wired = false;
        const uint64_t again_us = two.world.time_us;
        ::pair pair{};
        CHECK(two.capture(pair) == ERROR_TIMEOUT);
        CHECK(two.world.time_us - again_us < kLimitUs);
        CHECK(two.text() == text);
        CHECK(two.rig.state == RIG_SAFE);
        two.check_rest();
    }
}

TEST_CASE("frames that begin too far apart are refused") {
    Triggered two;
    REQUIRE(rig_bringup(&two.rig) == ERROR_OK);
    two.right.delay_us = 70000;
    ::pair pair{};
    CHECK(two.capture(pair) == ERROR_MOVED);
    CHECK(pair.skew_us == 70000);
    CHECK(two.rig.state == RIG_READY);
    two.check_rest();
}

TEST_CASE("a free-running camera is reported at the bring-up") {
    Triggered two;
    two.right.wired = false;
    two.world.keep_going = [&two] {
        const uint64_t now_us = two.world.time_us;
        if (two.right.started && two.right.held.empty()) {
            two.right.held.push_back({now_us, now_us + 33333, 0});
        }
        return true;
    };
    CHECK(rig_bringup(&two.rig) == ERROR_VERIFY);
    CHECK(two.text().rfind("right camera: ", 0) == 0);
    CHECK(two.text().find("rig.trigger = no") != std::string::npos);
    two.check_rest();
}

TEST_CASE(
    "every call of the line fails, once and for ever: the line is named and the rig is safe") {
    for (const int error : {ERROR_IO, ERROR_DEVICE, ERROR_TIMEOUT, ERROR_UNSUPPORTED}) {
        unsigned calls = 0;
        for (unsigned nth = 1; calls == 0 || nth <= calls; nth++) {
            for (const bool for_ever : {false, true}) {
                CAPTURE(error);
                CAPTURE(nth);
                CAPTURE(for_ever);
                Triggered two;
                ::pair pair{};
                if (calls == 0) {
                    REQUIRE(rig_bringup(&two.rig) == ERROR_OK);
                    REQUIRE(two.capture(pair) == ERROR_OK);
                    calls = two.world.sets;
                    continue;
                }
                two.world.fails_with = error;
                two.world.fails_from = nth;
                two.world.fails_to = for_ever ? UINT32_MAX : nth;
                int result = rig_bringup(&two.rig);
                result = result == ERROR_OK ? two.capture(pair) : result;
                const uint64_t took_us = two.world.time_us - two.world.first_failed_us;
                if (result != ERROR_OK) {
                    CHECK(result == error);
                    CHECK(two.text().rfind("trigger line: ", 0) == 0);
                    CHECK(two.rig.state == RIG_SAFE);
                    CHECK(took_us < kLimitUs);
                }
                CHECK((result != ERROR_OK || !for_ever));
                CHECK((for_ever || !two.world.active));
            }
        }
        CHECK(calls == 5);  // initial rest, and two pulses
    }
}

TEST_CASE("a camera that goes is named, and the line is at rest") {
    Triggered two;
    two.right.gone = true;
    CHECK(rig_bringup(&two.rig) == ERROR_DEVICE);
    CHECK(two.rig.last_error.part == RIG_PART_RIGHT_CAMERA);
    two.right.gone = false;
    REQUIRE(rig_bringup(&two.rig) == ERROR_OK);
    two.left.gone = true;
    ::pair pair{};
    CHECK(two.capture(pair) == ERROR_DEVICE);
    CHECK(two.rig.last_error.part == RIG_PART_LEFT_CAMERA);
    CHECK(two.rig.state == RIG_SAFE);
    two.check_rest();
}

TEST_CASE("cancelled at any moment the line is at rest, and the rig as ready as it was") {
    for (int looks = 1; looks < 200; looks++) {
        CAPTURE(looks);
        Triggered two(300000);
        REQUIRE(rig_bringup(&two.rig) == ERROR_OK);
        int left = looks;
        two.world.keep_going = [&left] { return left > 0 && --left > 0; };
        ::pair pair{};
        const int result = two.capture(pair, true);
        two.check_rest();
        CHECK(two.rig.state == RIG_READY);
        two.world.keep_going = [] { return true; };
        if (result == ERROR_OK) {
            REQUIRE(looks > 10);
            return;
        }
        CHECK(result == ERROR_CANCELLED);
        // The interrupted pulse has left nothing behind.
        REQUIRE(two.capture(pair) == ERROR_OK);
        CHECK(pair.skew_us == 0);
    }
    FAIL("it never ends");
}
