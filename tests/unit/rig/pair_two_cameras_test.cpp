// SPDX-License-Identifier: Apache-2.0
// Pairs of two free-running cameras with their own ports.
#include <doctest/doctest.h>

#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <deque>
#include <random>
#include <string>
#include <vector>

#include "core/error.h"
#include "manual_clock.hpp"
#include "rig/pair.h"
#include "synthetic/seed.hpp"

namespace {

constexpr uint32_t kWidth = 640, kHeight = 480;

// Frames every `period_us`, read out in half of it, in colour. Like a driver, it buffers four
// frames, and drops later ones.
struct Camera {
    Clock &clock;
    uint64_t period_us, phase_us;
    uint16_t level;
    bool gone = false, started = false;
    int lent = 0;
    uint64_t lose_every = 0;  // n: one of n frames never comes
    uint64_t next = 0;        // frame that had not ended at the last check
    std::deque<uint64_t> waiting{};
    // Numbers of calls of start, stop and take, counted from 0.
    unsigned calls = 0, fails_from = UINT32_MAX, fails_to = 0;
    int fails_with = ERROR_OK;
    uint64_t failed_us = 0;  // time of the first failed call
    std::vector<uint16_t> values = std::vector<uint16_t>(size_t(3) * kWidth * kHeight, level);

    static Camera &of(void *self) { return *static_cast<Camera *>(self); }
    // 0, or the result that this call returns without being made.
    int fault() {
        const unsigned call = calls++;
        if (call < fails_from || call > fails_to) {
            return ERROR_OK;
        }
        failed_us = failed_us == 0 ? clock.time_us : failed_us;
        return fails_with;
    }
    static int start(void *self, const hal_camera_format *format) {
        if (const int error = of(self).fault(); error != ERROR_OK) {
            return error;
        }
        if (of(self).gone) {
            return ERROR_DEVICE;
        }
        of(self).started = format->width_px == kWidth && format->height_px == kHeight;
        of(self).waiting.clear();
        of(self).next = (of(self).clock.time_us - of(self).phase_us) / of(self).period_us + 1;
        return of(self).started ? ERROR_OK : ERROR_UNSUPPORTED;
    }
    static int stop(void *self) {
        of(self).started = false;
        return of(self).fault();
    }
    uint64_t end_us(uint64_t number) const { return phase_us + number * period_us + period_us / 2; }
    void catch_up() {
        for (; end_us(next) <= clock.time_us; next++) {
            if (waiting.size() < 4 && (lose_every == 0 || next % lose_every != 0)) {
                waiting.push_back(next);
            }
        }
    }
    static int take(void *self, uint64_t not_before_us, uint64_t deadline_us,
                    hal_camera_frame *frame) {
        Camera &me = of(self);
        REQUIRE(me.started);
        if (const int error = me.fault(); error != ERROR_OK) {
            Clock::wait(&me.clock, error == ERROR_TIMEOUT ? deadline_us : 0);
            return error;
        }
        if (me.gone) {
            return ERROR_DEVICE;
        }
        uint64_t number = 0;
        for (me.catch_up();; me.catch_up()) {
            if (me.waiting.empty()) {
                Clock::wait(&me.clock, std::min(deadline_us, me.end_us(me.next)));
                if (me.clock.time_us >= deadline_us && me.end_us(me.next) > deadline_us) {
                    return ERROR_TIMEOUT;
                }
                continue;
            }
            number = me.waiting.front();
            me.waiting.pop_front();
            if (me.phase_us + number * me.period_us >= not_before_us) {
                break;
            }
        }
        const uint64_t begin_us = me.phase_us + number * me.period_us;
        const uint64_t end_us = me.end_us(number);
        me.lent++;
        frame->image = {me.values.data(), kWidth, kHeight, 3 * kWidth, 8, RAW_RGB, release, &me};
        frame->sequence = uint32_t(number);
        frame->faults = 0;
        frame->begin_us = begin_us;
        frame->end_us = end_us;
        return ERROR_OK;
    }
    static void release(void *self) { of(self).lent--; }
};

// The value that its controls have after they were set, whatever was requested.
int32_t reported_control = 0;

int control(void *, hal_camera_control, int32_t, int32_t *applied) {
    *applied = reported_control;
    return ERROR_OK;
}

constexpr hal_camera_operations kCamera = {Camera::start, Camera::stop, Camera::take, nullptr,
                                           nullptr};
constexpr hal_camera_operations kControlled = {Camera::start, Camera::stop, Camera::take, control,
                                               nullptr};

struct TwoCameras {
    Clock time;
    Camera left, right;
    hal_clock clock{&kClock, &time};
    hal_camera ports[2]{{&kCamera, &left}, {&kCamera, &right}};
    ::rig rig{};

    TwoCameras(uint64_t period_us, uint64_t phase_us)
        : TwoCameras(period_us, period_us, phase_us) {}
    TwoCameras(uint64_t left_us, uint64_t right_us, uint64_t phase_us)
        : left{time, left_us, 0, 50}, right{time, right_us, phase_us, 90} {
        rig_profile profile{};
        REQUIRE(rig_profile_named("two-cameras", &profile) == ERROR_OK);
        const rig_ports hangs_on = {&clock,  nullptr, nullptr, {&ports[0], &ports[1]},
                                    nullptr, nullptr, nullptr};
        rig_init(&rig, &profile, &hangs_on, nullptr);
    }
    int capture(::pair &pair) {
        const pair_options options = {true, 0, 0, 0, nullptr};
        const int error = pair_capture(&rig, &options, &pair);
        CHECK(left.lent == (error == ERROR_OK));
        CHECK(right.lent == (error == ERROR_OK));
        // The pixels remain, as they belong to the cameras.
        pair_frame frames[] = {pair.frame[RIG_LEFT], pair.frame[RIG_RIGHT]};
        if (error == ERROR_OK) {
            pair_release(frames);
        }
        return error;
    }
};

}  // namespace

TEST_CASE("the two frames that are nearest to each other are the pair") {
    std::mt19937_64 random(synthetic::test_seed());
    for (int i = 0; i < 20; i++) {
        const uint64_t period_us = 16000 + random() % 60000;
        TwoCameras two(period_us, random() % period_us);
        CAPTURE(period_us);
        two.left.lose_every = i % 3 == 1 ? 4 : 0;
        REQUIRE(rig_bringup(&two.rig) == ERROR_OK);
        two.time.time_us += random() % 1000000;  // the drivers' buffers fill up
        ::pair pair{};
        REQUIRE(two.capture(pair) == ERROR_OK);
        CHECK(uint64_t(std::llabs(pair.skew_us)) <= period_us / 2 + 1);
        CHECK(pair.change_permille == 0);
        CHECK(pair.frame[RIG_LEFT].image.data[3] == 50);
        CHECK(pair.frame[RIG_RIGHT].image.data[3 * kWidth * kHeight - 1] == 90);
        CHECK(pair.frame[RIG_LEFT].image.stride == 3 * kWidth);
        CHECK(pair.frame[RIG_LEFT].before.pan_q4 == 0);
        CHECK(pair.frame[RIG_LEFT].before.lens[LENS_ZOOM].position_q4 == INT32_MIN);
        CHECK(two.left.lent == 0);
        CHECK(two.right.lent == 0);
    }
}

TEST_CASE("the skew is reported, and rejected beyond the limit") {
    TwoCameras slow(150000, 70000);
    REQUIRE(rig_bringup(&slow.rig) == ERROR_OK);
    ::pair pair{};
    CHECK(slow.capture(pair) == ERROR_MOVED);
    CHECK(std::llabs(pair.skew_us) == 70000);
    const std::string text = slow.rig.last_error.text;
    CHECK_MESSAGE(text.rfind("right camera: its frame began 70 ms", 0) == 0, text);
    CHECK_MESSAGE(text.find("allowed: 50 ms") != std::string::npos, text);
    CHECK_MESSAGE(text.find("rig.skew_limit") != std::string::npos, text);
    CHECK(slow.rig.state == RIG_READY);
    slow.rig.profile.skew_limit_us = 80000;
    CHECK(slow.capture(pair) == ERROR_OK);
}

TEST_CASE("cameras of different speeds are asked again until their frames meet") {
    TwoCameras two(33333, 140000, 0);
    REQUIRE(rig_bringup(&two.rig) == ERROR_OK);
    for (int i = 0; i < 20; i++) {
        two.time.time_us += 12345;
        ::pair pair{};
        REQUIRE(two.capture(pair) == ERROR_OK);
        CHECK(std::llabs(pair.skew_us) <= 50000);
    }
}

TEST_CASE("a camera that is missing or goes is named, and the rig is safe") {
    TwoCameras two(33333, 10000);
    two.right.gone = true;
    CHECK(rig_bringup(&two.rig) == ERROR_DEVICE);
    CHECK(two.rig.last_error.part == RIG_PART_RIGHT_CAMERA);
    CHECK(two.rig.state == RIG_SAFE);
    two.right.gone = false;
    REQUIRE(rig_bringup(&two.rig) == ERROR_OK);
    two.left.gone = true;
    ::pair pair{};
    CHECK(two.capture(pair) == ERROR_DEVICE);
    CHECK(two.rig.last_error.part == RIG_PART_LEFT_CAMERA);
    CHECK(two.rig.state == RIG_SAFE);
    CHECK(!two.right.started);
}

TEST_CASE("what two cameras do not have is rejected") {
    TwoCameras two(33333, 10000);
    REQUIRE(rig_bringup(&two.rig) == ERROR_OK);
    CHECK(rig_window(&two.rig, 640, 480, 2) == ERROR_UNSUPPORTED);
    CHECK(rig_window(&two.rig, 320, 240, 1) == ERROR_UNSUPPORTED);
    CHECK(two.rig.state == RIG_READY);
    uint32_t applied_us = 0;
    CHECK(rig_exposure(&two.rig, 3, 10000, &applied_us) == ERROR_UNSUPPORTED);
    ::pair pair{};
    CHECK(two.capture(pair) == ERROR_OK);
}

TEST_CASE("frames that are exposed for longer than the profile's frame time are waited for") {
    TwoCameras two(33333, 0);
    for (hal_camera &port : two.ports) {
        port.operations = &kControlled;
    }
    REQUIRE(rig_bringup(&two.rig) == ERROR_OK);
    constexpr uint32_t kExposureUs = 1500000;
    REQUIRE(kExposureUs > 4 * two.rig.profile.frame_us);
    reported_control = kExposureUs;
    uint32_t applied_us = 0;
    REQUIRE(rig_exposure(&two.rig, 3, kExposureUs, &applied_us) == ERROR_OK);
    // Now they are as slow as that makes them.
    for (Camera *camera : {&two.left, &two.right}) {
        camera->period_us = kExposureUs;
        camera->waiting.clear();
        camera->next = two.time.time_us / kExposureUs + 1;
    }
    ::pair pair{};
    const int error = two.capture(pair);
    const std::string text = two.rig.last_error.text;
    CAPTURE(text);
    CHECK(error == ERROR_OK);
    CHECK(two.rig.state == RIG_READY);
}

TEST_CASE("a long exposure that a camera still has from before is waited for") {
    constexpr int32_t kExposureUs = 5000000;
    TwoCameras two(kExposureUs, 10000);
    two.ports[RIG_LEFT].operations = two.ports[RIG_RIGHT].operations = &kControlled;
    reported_control = kExposureUs;
    const int error = rig_bringup(&two.rig);
    INFO(two.rig.last_error.text);
    REQUIRE(error == ERROR_OK);
    CHECK(two.rig.camera[RIG_LEFT].exposure_us == 0);  // not set by any program
    ::pair pair{};
    CHECK(two.capture(pair) == ERROR_OK);
    // A failed camera is reported after the time that the exposure explains, and not later.
    two.right.fails_from = two.right.calls + 2;  // stop and start
    two.right.fails_to = UINT32_MAX;
    two.right.fails_with = ERROR_TIMEOUT;
    const uint64_t begin_us = two.time.time_us;
    CHECK(rig_bringup(&two.rig) == ERROR_TIMEOUT);
    CHECK(two.rig.last_error.part == RIG_PART_RIGHT_CAMERA);
    CHECK(two.time.time_us - begin_us <= 2 * uint64_t(kExposureUs) + 2000000);
    CHECK(two.rig.state == RIG_SAFE);
    // Impossible values are not accepted.
    for (const int32_t value : {INT32_MIN, -1, 0, INT32_MAX}) {
        reported_control = value;
        two.right.calls = 0;
        two.right.fails_from = 1;
        const uint64_t again_us = two.time.time_us;
        CHECK(rig_bringup(&two.rig) == ERROR_TIMEOUT);
        CHECK(two.time.time_us - again_us <=
              (value > 0 ? 2 * uint64_t(RIG_EXPOSURE_MAX_US) : 0) + 2000000 + kExposureUs);
    }
    reported_control = 0;
}

TEST_CASE("a camera that reports impossible values of its controls is named") {
    uint32_t exposure_us = 7;
    uint16_t gain_q3 = 7;
    for (const int32_t reported : {INT32_MIN, -1, 1001, INT32_MAX}) {
        CAPTURE(reported);
        TwoCameras two(33333, 10000);
        two.ports[1].operations = &kControlled;
        reported_control = reported;
        REQUIRE(rig_bringup(&two.rig) == ERROR_OK);
        CHECK(rig_gain(&two.rig, 1u << RIG_RIGHT, 16, &gain_q3) == ERROR_VERIFY);
        CHECK(two.rig.state == RIG_SAFE);
        const std::string text = two.rig.last_error.text;
        CHECK_MESSAGE(text.rfind("right camera: ", 0) == 0, text);
        CHECK_MESSAGE(text.find("setting " + std::to_string(reported)) != std::string::npos, text);
        REQUIRE(rig_bringup(&two.rig) == ERROR_OK);
        CHECK(rig_exposure(&two.rig, 1u << RIG_RIGHT, 1000, &exposure_us) ==
              (reported < 0 ? ERROR_VERIFY : ERROR_OK));
    }
    CHECK(gain_q3 == 7);
}

// A bring-up and a pair, with these calls of one or both cameras failing. Returns the number of
// calls of each.
static unsigned run_with(unsigned sides, unsigned from, unsigned to, int error) {
    constexpr uint64_t kLimitUs = 2000000;
    TwoCameras two(33333, 10000);
    for (unsigned side = 0; side < RIG_SIDES; side++) {
        Camera &camera = side == RIG_LEFT ? two.left : two.right;
        if ((sides >> side & 1) != 0) {
            camera.fails_from = from;
            camera.fails_to = to;
            camera.fails_with = error;
        }
    }
    ::pair pair{};
    int result = rig_bringup(&two.rig);
    result = result == ERROR_OK ? two.capture(pair) : result;
    const uint64_t first_us = two.left.failed_us == 0 ? two.right.failed_us
                              : two.right.failed_us == 0
                                  ? two.left.failed_us
                                  : std::min(two.left.failed_us, two.right.failed_us);
    if (result != ERROR_OK) {
        const std::string text = two.rig.last_error.text;
        CAPTURE(text);
        CHECK(two.time.time_us - first_us < kLimitUs);
        const rig_part part = two.rig.last_error.part;
        CHECK((part == RIG_PART_LEFT_CAMERA || part == RIG_PART_RIGHT_CAMERA));
        CHECK((sides >> (part - RIG_PART_LEFT_CAMERA) & 1) == 1);
        CHECK(text.rfind(rig_part_text(part), 0) == 0);
        CHECK(two.rig.state == RIG_SAFE);
        CHECK(!two.left.started);
        CHECK(!two.right.started);
    }
    CHECK((result != ERROR_OK || to != UINT32_MAX || first_us == 0));
    CHECK(two.left.lent + two.right.lent == 0);
    return std::max(two.left.calls, two.right.calls);
}

TEST_CASE(
    "every call of a camera or of both fails, once and permanently: reported in time, and safe") {
    const unsigned calls = run_with(0, UINT32_MAX, 0, ERROR_OK);
    REQUIRE(calls > 4);
    for (const int error : {ERROR_TIMEOUT, ERROR_DEVICE, ERROR_IO}) {
        for (unsigned sides = 1; sides < 4; sides++) {
            for (unsigned call = 0; call < calls; call++) {
                CAPTURE(error);
                CAPTURE(sides);
                CAPTURE(call);
                run_with(sides, call, call, error);
                run_with(sides, call, UINT32_MAX, error);
            }
        }
    }
}
