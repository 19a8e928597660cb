// SPDX-License-Identifier: Apache-2.0
// Cameras with their own ports: bring-up takes over their settings, a region is a part of their
// frames, and their focus control moves their lens.
#include <doctest/doctest.h>

#include <map>
#include <string>
#include <vector>

#include "core/error.h"
#include "manual_clock.hpp"
#include "rig/auto/autofocus.h"
#include "rig/auto/focus_mover.h"
#include "rig/rig_region.h"

namespace {

constexpr int kWidth = 640, kHeight = 480;
constexpr uint64_t kPeriodUs = 33333;

// A grey camera whose pixel x, y is x + 1000 * y, modulo 16 bits.
struct Camera {
    Clock &clock;
    bool gone = false;
    int lent = 0, damaged = 0;
    int32_t automatic = 0, focus_steps = 0;
    std::map<int, int32_t> values = {{HAL_CAMERA_EXPOSURE_US, 12000}, {HAL_CAMERA_GAIN_PART, 250}};
    std::vector<uint16_t> pixels = std::vector<uint16_t>(size_t(kWidth) * kHeight);
    int bits = 16;
    double sharp_part = -1;  // focus part at which its texture is sharp; < 0: none

    explicit Camera(Clock &of) : clock(of) {
        for (size_t i = 0; i < pixels.size(); i++) {
            pixels[i] = uint16_t(i % kWidth + 1000 * (i / kWidth));
        }
    }
    static Camera &of(void *self) { return *static_cast<Camera *>(self); }
    // A texture of 8 bits with a contrast that falls to half at 60 parts from the focus.
    void paint() {
        const double off = (values[HAL_CAMERA_FOCUS_PART] - sharp_part) / 60;
        const double amplitude = 40 / (1 + off * off);
        uint32_t random = 12345;
        bits = 8;
        for (uint16_t &pixel : pixels) {
            random = random * 1664525 + 1013904223;
            const double noise = double(random >> 8 & 0xFF) / 128 - 1;
            pixel = uint16_t(100 + ((random >> 24 & 1) != 0 ? amplitude : -amplitude) + noise);
        }
    }
    static int start(void *self, const hal_camera_format *format) {
        return of(self).gone                     ? ERROR_DEVICE
               : format->width_px == int(kWidth) ? ERROR_OK
                                                 : ERROR_UNSUPPORTED;
    }
    static int stop(void *) { return ERROR_OK; }
    static int take(void *self, uint64_t not_before_us, uint64_t deadline_us,
                    hal_camera_frame *frame) {
        Camera &me = of(self);
        const uint64_t begin_us = (not_before_us + kPeriodUs) / kPeriodUs * kPeriodUs;
        if (me.gone) {
            return ERROR_DEVICE;
        }
        if (begin_us + kPeriodUs > deadline_us) {
            Clock::wait(&me.clock, deadline_us);
            return ERROR_TIMEOUT;
        }
        Clock::wait(&me.clock, begin_us + kPeriodUs);
        me.lent++;
        if (me.sharp_part >= 0) {
            me.paint();
        }
        *frame = {};
        frame->image = {me.pixels.data(), kWidth, kHeight, kWidth, me.bits, RAW_GREY, release, &me};
        frame->faults = me.damaged-- > 0 ? HAL_CAMERA_DAMAGED : 0;
        frame->begin_us = begin_us;
        frame->end_us = begin_us + kPeriodUs;
        return ERROR_OK;
    }
    static void release(void *self) { of(self).lent--; }
    static int control(void *self, hal_camera_control which, int32_t value, int32_t *applied) {
        Camera &me = of(self);
        switch (which) {
            case HAL_CAMERA_AUTOMATIC_OFF:
                *applied = me.automatic;
                return ERROR_OK;
            case HAL_CAMERA_EXPOSURE_FOUND_US:
                *applied = me.values[HAL_CAMERA_EXPOSURE_US];
                return ERROR_OK;
            case HAL_CAMERA_GAIN_FOUND_PART:
                *applied = me.values[HAL_CAMERA_GAIN_PART];
                return ERROR_OK;
            case HAL_CAMERA_FOCUS_STEPS:
                *applied = me.focus_steps;
                return ERROR_OK;
            case HAL_CAMERA_FOCUS_FOUND_PART:
                *applied = me.values[HAL_CAMERA_FOCUS_PART];
                return ERROR_OK;
            default:
                me.values[which] = *applied = value;
                return me.gone ? ERROR_DEVICE : ERROR_OK;
        }
    }
};

constexpr hal_camera_operations kCamera = {Camera::start, Camera::stop, Camera::take,
                                           Camera::control, nullptr};

void write_log(void *self, hal_log_level level, const char *text) {
    static_cast<std::vector<std::string> *>(self)->push_back(std::to_string(level) + " " + text);
}

constexpr hal_log_operations kLog = {write_log};

struct Bench {
    Clock time;
    Camera left{time}, right{time};
    hal_clock clock{&kClock, &time};
    hal_camera ports[2]{{&kCamera, &left}, {&kCamera, &right}};
    std::vector<std::string> logged;
    hal_log log{&kLog, &logged};
    bool stop = false;
    ::rig rig{};

    Bench() {
        rig_profile profile{};
        REQUIRE(rig_profile_named("two-cameras", &profile) == ERROR_OK);
        rig_ports hangs_on{};
        hangs_on.clock = &clock;
        hangs_on.camera[RIG_LEFT] = &ports[RIG_LEFT];
        hangs_on.camera[RIG_RIGHT] = &ports[RIG_RIGHT];
        hangs_on.log = &log;
        const rig_observer observer = {[](void *self) { return *static_cast<bool *>(self); },
                                       nullptr, &stop};
        rig_init(&rig, &profile, &hangs_on, &observer);
    }
};

}  // namespace

TEST_CASE("bring-up switches off what cameras set automatically, and logs it") {
    Bench bench;
    bench.left.automatic = HAL_CAMERA_AUTO_EXPOSURE | HAL_CAMERA_AUTO_FOCUS;
    bench.right.automatic = HAL_CAMERA_AUTO_WHITE_BALANCE | HAL_CAMERA_AUTO_GAIN |
                            HAL_CAMERA_AUTO_GAIN << HAL_CAMERA_AUTO_STILL;
    bench.left.focus_steps = 50;
    REQUIRE(rig_bringup(&bench.rig) == ERROR_OK);
    REQUIRE(bench.logged.size() == 4);
    CHECK(bench.logged[0] == "5 left camera: its automatic exposure is now off");
    CHECK(bench.logged[1] == "5 left camera: its automatic focus is now off");
    CHECK(bench.logged[2].rfind("4 right camera: its automatic gain cannot be", 0) == 0);
    CHECK(bench.logged[3] == "5 right camera: its automatic white balance is now off");
    CHECK(bench.rig.camera[RIG_LEFT].focus_steps == 50);
    CHECK(bench.rig.camera[RIG_RIGHT].focus_steps == 0);
}

TEST_CASE("a camera's focus control is moved like a lens") {
    Bench bench;
    bench.left.focus_steps = 50;
    bench.left.values[HAL_CAMERA_FOCUS_PART] = 300;
    int32_t applied = -1;
    CHECK(rig_focus_part(&bench.rig, RIG_LEFT, 500, &applied) == ERROR_NOT_READY);
    REQUIRE(rig_bringup(&bench.rig) == ERROR_OK);
    CHECK(bench.rig.camera[RIG_LEFT].focus_part == 300);
    CHECK(rig_focus_part(&bench.rig, RIG_LEFT, 1001, &applied) == ERROR_RANGE);
    CHECK(rig_focus_part(&bench.rig, RIG_LEFT, -1, &applied) == ERROR_RANGE);
    CHECK(rig_focus_part(&bench.rig, RIG_RIGHT, 500, &applied) == ERROR_UNSUPPORTED);
    CHECK(std::string(bench.rig.rejected.text).find("right camera: it has no focus control") == 0);
    const uint64_t set_us = bench.time.time_us;
    REQUIRE(rig_focus_part(&bench.rig, RIG_LEFT, 700, &applied) == ERROR_OK);
    CHECK(applied == 700);
    CHECK(bench.rig.camera[RIG_LEFT].focus_part == 700);
    CHECK(bench.left.values[HAL_CAMERA_FOCUS_PART] == 700);
    // Frames of the way there do not count.
    const rig_rectangle where = {0, 0, 64, 64};
    rig_region region{};
    rig_region_frame frame{};
    REQUIRE(rig_region_begin(&bench.rig, &region, RIG_LEFT, &where, 1) == ERROR_OK);
    REQUIRE(rig_region_take(&bench.rig, &region, 0, &frame) == ERROR_OK);
    CHECK(frame.exposed_us > set_us + 160000);
    raw_image_release(&frame.image);
    CHECK(rig_region_end(&bench.rig, &region, false) == ERROR_OK);
}

TEST_CASE("a region is a part of a frame, and the settings come back") {
    Bench bench;
    REQUIRE(rig_bringup(&bench.rig) == ERROR_OK);
    const rig_rectangle corners[] = {{0, 0, 100, 80},
                                     {540, 0, 100, 80},
                                     {0, 400, 100, 80},
                                     {540, 400, 100, 80},
                                     {0, 0, 640, 480}};
    for (const rig_rectangle &where : corners) {
        rig_region region{};
        rig_region_frame frame{};
        REQUIRE(rig_region_begin(&bench.rig, &region, RIG_RIGHT, &where, 8) == ERROR_OK);
        CHECK(region.skip == 1);
        const uint64_t asked_us = bench.time.time_us;
        REQUIRE(rig_region_take(&bench.rig, &region, asked_us, &frame) == ERROR_OK);
        CHECK(frame.image.width_px == where.width_px);
        CHECK(frame.image.height_px == where.height_px);
        CHECK(frame.exposure_us == 12000);
        CHECK(frame.black == 0);
        CHECK(frame.exposed_us >= asked_us + 6000);
        for (const int y : {0, where.height_px - 1}) {
            for (const int x : {0, where.width_px - 1}) {
                CHECK(raw_image_row(&frame.image, y)[x] ==
                      uint16_t(where.column_px + x + 1000 * (where.row_px + y)));
            }
        }
        raw_image_release(&frame.image);
        uint32_t applied_us = 0;
        uint16_t applied_q3 = 0;
        CHECK(rig_region_exposure(&bench.rig, &region, 3000, &applied_us) == ERROR_OK);
        CHECK(rig_region_gain(&bench.rig, &region, 512, &applied_q3) == ERROR_OK);
        CHECK(bench.right.values[HAL_CAMERA_EXPOSURE_US] == 3000);
        CHECK(rig_region_end(&bench.rig, &region, false) == ERROR_OK);
        CHECK(bench.right.values[HAL_CAMERA_EXPOSURE_US] == 12000);
        CHECK(bench.right.values[HAL_CAMERA_GAIN_PART] == 250);
        CHECK(bench.rig.camera[RIG_RIGHT].exposure_us == 0);
        CHECK(bench.rig.camera[RIG_RIGHT].gain_q3 == 0);
        CHECK(bench.right.lent == 0);
    }
    rig_region region{};
    uint32_t applied_us = 0;
    REQUIRE(rig_region_begin(&bench.rig, &region, RIG_RIGHT, &corners[0], 1) == ERROR_OK);
    CHECK(rig_region_exposure(&bench.rig, &region, 3000, &applied_us) == ERROR_OK);
    CHECK(rig_region_end(&bench.rig, &region, true) == ERROR_OK);
    CHECK(bench.right.values[HAL_CAMERA_EXPOSURE_US] == 3000);
    for (const rig_rectangle &where :
         {rig_rectangle{0, 0, 642, 480}, rig_rectangle{542, 0, 100, 80}, rig_rectangle{1, 0, 8, 8},
          rig_rectangle{0, 402, 100, 80}, rig_rectangle{0, 0, 0, 80}}) {
        CHECK(rig_region_begin(&bench.rig, &region, RIG_LEFT, &where, 1) == ERROR_RANGE);
        CHECK(std::string(bench.rig.rejected.text).find("640 x 480 px") != std::string::npos);
    }
}

TEST_CASE("damaged frames are not measured, and a camera that goes ends the region") {
    Bench bench;
    REQUIRE(rig_bringup(&bench.rig) == ERROR_OK);
    const rig_rectangle where = {0, 0, 100, 80};
    rig_region region{};
    rig_region_frame frame{};
    uint32_t applied_us = 0;
    REQUIRE(rig_region_begin(&bench.rig, &region, RIG_LEFT, &where, 1) == ERROR_OK);
    bench.left.damaged = 1;
    REQUIRE(rig_region_take(&bench.rig, &region, 0, &frame) == ERROR_OK);
    raw_image_release(&frame.image);
    bench.left.damaged = 2;
    CHECK(rig_region_take(&bench.rig, &region, 0, &frame) == ERROR_FRAME);
    CHECK(bench.rig.state == RIG_READY);
    bench.stop = true;
    CHECK(rig_region_take(&bench.rig, &region, 0, &frame) == ERROR_CANCELLED);
    bench.stop = false;
    CHECK(rig_region_exposure(&bench.rig, &region, 3000, &applied_us) == ERROR_OK);
    bench.left.gone = true;
    CHECK(rig_region_take(&bench.rig, &region, 0, &frame) == ERROR_DEVICE);
    const std::string text = bench.rig.last_error.text;
    CHECK(text.find("left camera: it is gone") == 0);
    CHECK(bench.rig.state == RIG_SAFE);
    CHECK(bench.left.lent == 0);
    CHECK(rig_region_take(&bench.rig, &region, 0, &frame) == ERROR_NOT_READY);
    CHECK(rig_region_end(&bench.rig, &region, false) == ERROR_OK);
    CHECK(bench.rig.last_error.text == text);
    CHECK(rig_region_end(&bench.rig, &region, false) == ERROR_OK);
    // A camera that is still there gets its settings back when another part has failed.
    bench.left.gone = false;
    REQUIRE(rig_bringup(&bench.rig) == ERROR_OK);
    bench.left.values[HAL_CAMERA_EXPOSURE_US] = 12000;
    REQUIRE(rig_bringup(&bench.rig) == ERROR_OK);
    REQUIRE(rig_region_begin(&bench.rig, &region, RIG_LEFT, &where, 1) == ERROR_OK);
    CHECK(rig_region_exposure(&bench.rig, &region, 3000, &applied_us) == ERROR_OK);
    bench.right.gone = true;
    CHECK(rig_check(&bench.rig) == ERROR_DEVICE);
    rig_safe(&bench.rig);
    CHECK(rig_region_end(&bench.rig, &region, false) == ERROR_OK);
    CHECK(bench.left.values[HAL_CAMERA_EXPOSURE_US] == 12000);
}

TEST_CASE("autofocus finds the peak of cameras with a focus control") {
    for (const double sharp_part : {120., 500., 870.}) {
        CAPTURE(sharp_part);
        Bench bench;
        for (Camera *camera : {&bench.left, &bench.right}) {
            camera->focus_steps = 250;
            camera->sharp_part = sharp_part;
            camera->values[HAL_CAMERA_FOCUS_PART] = 400;
        }
        const rig_autofocus_options options{};
        CHECK(rig_autofocus(&bench.rig, 3, &options) == ERROR_NOT_CONNECTED);
        REQUIRE(rig_bringup(&bench.rig) == ERROR_OK);
        const uint64_t begun_us = bench.time.time_us;
        REQUIRE(rig_autofocus(&bench.rig, 3, &options) == ERROR_OK);
        for (unsigned side = 0; side < RIG_SIDES; side++) {
            const focus_result &result = bench.rig.camera[side].focus.search.result;
            CHECK(focus_verdict_text(result.verdict) == std::string("focused"));
            CHECK(bench.rig.camera[side].focus_part == doctest::Approx(sharp_part).epsilon(0.02));
            CHECK(result.position == focus_mover_position(&bench.rig, side));
            CHECK(bench.rig.camera[side].focus.frames < 100);
        }
        CHECK(bench.time.time_us - begun_us < 24000000);
        CHECK(bench.left.lent == 0);
    }
}

TEST_CASE("a focus control finds no contrast on a plain wall, and returns") {
    Bench bench;
    bench.left.focus_steps = 50;
    bench.left.sharp_part = 1e6;
    bench.left.values[HAL_CAMERA_FOCUS_PART] = 400;
    REQUIRE(rig_bringup(&bench.rig) == ERROR_OK);
    const rig_autofocus_options options{};
    REQUIRE(rig_autofocus(&bench.rig, 1, &options) == ERROR_OK);
    CHECK(bench.rig.camera[RIG_LEFT].focus.search.result.verdict == FOCUS_NO_CONTRAST);
    CHECK(bench.rig.camera[RIG_LEFT].focus_part == 400);
    CHECK(rig_autofocus(&bench.rig, 2, &options) == ERROR_NOT_CONNECTED);
    bench.left.gone = true;
    CHECK(rig_autofocus(&bench.rig, 1, &options) == ERROR_DEVICE);
    CHECK(bench.rig.state == RIG_SAFE);
    CHECK(std::string(bench.rig.last_error.text).find("left camera: ") == 0);
}
