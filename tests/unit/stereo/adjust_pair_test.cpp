// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <vector>

#include "core/error.h"
#include "stereo/zoom/sparse_align.h"
#include "stereo/zoom/wide_pair.h"
#include "synthetic/zoom_rig.hpp"

namespace {

using synthetic::Camera;
using synthetic::Vector;

constexpr int kSkip = 2, kWidth = 1024, kHeight = 768;

double hash(int x, int y) {
    uint32_t h = static_cast<uint32_t>(x) * 374761393U + static_cast<uint32_t>(y) * 668265263U;
    h = (h ^ (h >> 13)) * 1274126177U;
    return static_cast<double>((h ^ (h >> 16)) & 0xffffU) / 65535.0;
}

// Smooth noise with a grain of 1.
double grain(double x, double y) {
    const int ix = static_cast<int>(std::floor(x)), iy = static_cast<int>(std::floor(y));
    double tx = x - ix, ty = y - iy;
    tx = tx * tx * (3 - 2 * tx);
    ty = ty * ty * (3 - 2 * ty);
    const double above = hash(ix, iy) + tx * (hash(ix + 1, iy) - hash(ix, iy));
    const double below = hash(ix, iy + 1) + tx * (hash(ix + 1, iy + 1) - hash(ix, iy + 1));
    return above + ty * (below - above);
}

double relief_mm(double x, double y) {
    return 1800 + 40 * std::sin(x / 170 + 0.5) * std::cos(y / 130);
}

// What a camera sees of the relief, every second pixel of the sensor both ways.
std::vector<uint8_t> picture(const Camera &camera, double texture_mm, double contrast) {
    std::vector<uint8_t> grey(static_cast<size_t>(kWidth) * kHeight);
    for (int v = 0; v < kHeight; v++) {
        for (int u = 0; u < kWidth; u++) {
            const Vector d = camera.direction({kSkip * u - 0.5, kSkip * v - 0.5});
            double z = 1800, at_x = 0, at_y = 0;
            for (int step = 0; step < 5; step++) {
                at_x = camera.centre_mm.x + d.x / d.z * (z - camera.centre_mm.z);
                at_y = camera.centre_mm.y + d.y / d.z * (z - camera.centre_mm.z);
                z = relief_mm(at_x, at_y);
            }
            const double value = 0.6 * grain(at_x / texture_mm, at_y / texture_mm) +
                                 0.4 * grain(at_x / (3 * texture_mm) + 40, at_y / (3 * texture_mm));
            grey[static_cast<size_t>(v) * kWidth + static_cast<size_t>(u)] =
                static_cast<uint8_t>(30 + contrast * value);
        }
    }
    return grey;
}

struct Scene {
    std::vector<uint8_t> pixels[2];
    Camera truth[2];
    adjust_picture picture;
};

// Motors off by `counts` and `pan_rad`, in opposite ways; `texture_mm` 0: of 6 px.
Scene scene(double zoom, double counts, double pan_rad, double texture_mm = 0,
            double contrast = 190) {
    Scene scene = {};
    scene.picture.axes = zoom_rig::state(zoom, 1800);
    scene.picture.depth_near_mm = 500;
    scene.picture.depth_far_mm = INFINITY;
    for (int side = 0; side < 2; side++) {
        const auto &at = scene.picture.axes.side[side];
        const double sign = side == 0 ? 1 : -1;
        scene.truth[side] = zoom_rig::camera_at(side, at.zoom_counts + sign * counts,
                                                at.focus_counts, at.pan_rad + sign * pan_rad, true);
        const double grain_mm = texture_mm > 0 ? texture_mm : 6 * 1800 / scene.truth[0].fx;
        scene.pixels[side] = ::picture(scene.truth[side], grain_mm, contrast);
        scene.picture.grey[side] = {scene.pixels[side].data(), kWidth, kHeight, kWidth};
        scene.picture.window[side] = {0, 0, kSkip};
    }
    return scene;
}

struct Memory {
    std::vector<unsigned char> bytes;
    arena pool = {};
    explicit Memory(size_t size) : bytes(size) { arena_init(&pool, bytes.data(), size); }
};

size_t need() {
    return adjust_calibration_need_bytes(kWidth, kHeight);
}

TEST_CASE("a refined pair has its rows together and its focal lengths in the right ratio") {
    const auto rig = zoom_rig::calibration();
    for (const double zoom : {310.0, 840.0}) {
        CAPTURE(zoom);
        Scene at = scene(zoom, 2, 0.3 * M_PI / 180);
        Memory memory(need());
        calibration result;
        adjust_report report;
        calibration_fault fault = {};
        REQUIRE(adjust_calibration(rig.get(), &at.picture, &memory.pool, &result, &report,
                                   &fault) == ERROR_OK);
        CHECK(memory.pool.peak_bytes <= need());
        CHECK(memory.pool.used_bytes == 0);
        CHECK(report.used > 300);
        CHECK(report.rows_before_px > 0.5);
        CHECK(report.rows_px < 0.2);
        CHECK(report.depth.after < 0.7 * report.depth.before);
        const double ratio = at.truth[1].fx / at.truth[0].fx;
        CHECK(std::abs(result.right.fx_px / result.left.fx_px / ratio - 1) <
              4 * report.ratio.after);
        CHECK(result.left.width_px == kWidth);
        CHECK(std::abs(result.left.fx_px * kSkip / at.truth[0].fx - 1) < 4 * report.focal.before);
        CHECK(calibration_depth_sigma_mm(&result, report.depth_mm) >= report.depth.after * 0.999);
    }
}

TEST_CASE("rows that are apart in pictures with skipped pixels do not accuse the calibration") {
    const auto rig = zoom_rig::calibration();
    Scene at = scene(500, 0, 0);
    Memory memory(adjustment_need_bytes(1) + need());
    adjustment adjustment;
    adjust_report report;
    REQUIRE(adjustment_begin(rig.get(), &at.picture.axes, 1, &memory.pool, &adjustment) ==
            ERROR_OK);
    REQUIRE(adjust_pair(&at.picture, &memory.pool, &adjustment, &report) == ERROR_OK);
    CHECK(report.health != ADJUST_CALIBRATE);
    report.rows_px = 0.9;
    for (const int skip : {1, 2}) {
        CAPTURE(skip);
        at.picture.window[0].skip = at.picture.window[1].skip = skip;
        adjust_pair_assess(&at.picture, &adjustment, &report);
        CHECK((report.health == ADJUST_CALIBRATE) == (skip == 1));
    }
}

// What is out of focus or has faint grain shows its corners only at a smaller scale.
TEST_CASE("a pair with smooth texture is refined from smaller pictures") {
    const auto rig = zoom_rig::calibration();
    const double grain_mm = 32 * 1800 / scene(840, 0, 0).truth[0].fx;
    Scene at = scene(840, 2, 0.3 * M_PI / 180, grain_mm, 45);
    Memory memory(need());
    calibration result;
    adjust_report report;
    calibration_fault fault = {};
    REQUIRE(adjust_calibration(rig.get(), &at.picture, &memory.pool, &result, &report, &fault) ==
            ERROR_OK);
    CHECK(memory.pool.peak_bytes <= need());
    CHECK(report.corners > 200);
    CHECK(report.used > 100);
    CHECK(report.rows_px < 0.4);
    const double ratio = at.truth[1].fx / at.truth[0].fx;
    CHECK(std::abs(result.right.fx_px / result.left.fx_px / ratio - 1) < 4 * report.ratio.after);
    CHECK(result.left.width_px == kWidth);
}

TEST_CASE("pictures before and after zooming show where the rings are") {
    const auto rig = zoom_rig::calibration();
    Scene at[2] = {scene(310, 1, 0.3 * M_PI / 180, 4), scene(430, 1, 0.3 * M_PI / 180, 4)};
    at[1].picture.state = 1;
    const zoom_state axes[2] = {at[0].picture.axes, at[1].picture.axes};
    const adjust_picture pictures[2] = {at[0].picture, at[1].picture};
    Memory memory(adjustment_need_bytes(2) + wide_pair_need_bytes(kWidth, kHeight));
    adjustment adjustment;
    wide_pair_report report;
    REQUIRE(adjustment_begin(rig.get(), axes, 2, &memory.pool, &adjustment) == ERROR_OK);
    REQUIRE(wide_pair_adjust(pictures, &memory.pool, &adjustment, &report) == ERROR_OK);
    CHECK(report.carried > 100);
    CHECK(report.carried_px < 0.4);
    for (int state = 0; state < 2; state++) {
        CAPTURE(state);
        const adjust_report &pair = report.pair[state];
        CHECK(pair.focal.after < 0.5 * pair.focal.before);
        for (int side = 0; side < 2; side++) {
            const double focal =
                adjustment.view[adjust_view(state, side)].lens.fx_px / at[state].truth[side].fx - 1;
            CHECK(std::abs(focal) < 4 * pair.focal.after);
        }
        CHECK(pair.depth.after < 0.3 * pair.depth.before);
    }
}

TEST_CASE("without texture the prior stays, and its sigma is reported") {
    const auto rig = zoom_rig::calibration();
    Scene at = {};
    at.picture.axes = zoom_rig::state(500, 1800);
    at.picture.depth_near_mm = 900;
    at.picture.depth_far_mm = INFINITY;
    for (int side = 0; side < 2; side++) {
        at.pixels[side].assign(static_cast<size_t>(kWidth) * kHeight, 128);
        at.picture.grey[side] = {at.pixels[side].data(), kWidth, kHeight, kWidth};
        at.picture.window[side] = {0, 0, kSkip};
    }
    Memory memory(need());
    calibration result, plain;
    adjust_report report;
    REQUIRE(adjust_calibration(rig.get(), &at.picture, &memory.pool, &result, &report, nullptr) ==
            ERROR_OK);
    REQUIRE(zoom_calibration_at(rig.get(), &at.picture.axes, &plain, nullptr) == ERROR_OK);
    CHECK(report.used == 0);
    CHECK(report.depth.after == report.depth.before);
    CHECK(report.depth.after > 50);
    CHECK(report.health == ADJUST_TOUCH_UP);
    CHECK(result.left.fx_px == doctest::Approx(plain.left.fx_px / kSkip));
}

TEST_CASE("pictures of different things are not matched") {
    const auto rig = zoom_rig::calibration();
    Scene at = scene(500, 0, 0);
    std::reverse(at.pixels[1].begin(), at.pixels[1].end());
    Memory memory(need());
    calibration result;
    adjust_report report;
    REQUIRE(adjust_calibration(rig.get(), &at.picture, &memory.pool, &result, &report, nullptr) ==
            ERROR_OK);
    CHECK(report.used == 0);
}

TEST_CASE("too little memory is reported") {
    const auto rig = zoom_rig::calibration();
    Scene at = scene(500, 0, 0);
    Memory memory(need() / 2);
    calibration result;
    adjust_report report;
    CHECK(adjust_calibration(rig.get(), &at.picture, &memory.pool, &result, &report, nullptr) ==
          ERROR_MEMORY);
}

}  // namespace

TEST_CASE("windows are aligned on a surface that is seen aslant") {
    constexpr int kSide = 64, kPlaces = 100;
    constexpr double kStretch = 0.10, kShear = 0.15, kAlong = 31.3, kDown = 30.6;
    double squares = 0;
    int aligned = 0;
    for (int place = 0; place < kPlaces; place++) {
        std::vector<uint8_t> left(kSide * kSide), right(kSide * kSide);
        for (int v = 0; v < kSide; v++) {
            for (int u = 0; u < kSide; u++) {
                const auto at = size_t(v * kSide + u);
                left[at] = uint8_t(20 + 200 * grain((u - 32) / 3.0 + 50 * place, (v - 32) / 3.0));
                const double y = v - kDown;
                const double x = (u - kAlong - kShear * y) / (1 + kStretch);
                right[at] = uint8_t(20 + 200 * grain(x / 3.0 + 50 * place, y / 3.0));
            }
        }
        const image_u8 a = {left.data(), kSide, kSide, kSide};
        const image_u8 b = {right.data(), kSide, kSide, kSide};
        double px[2] = {32, 31};
        if (sparse_align(&a, 32, 32, &b, px)) {
            aligned++;
            squares += std::pow(px[0] - kAlong, 2) + std::pow(px[1] - kDown, 2);
        }
    }
    CHECK(aligned > 90);
    CHECK(std::sqrt(squares / (2 * aligned)) < 0.03);
}
