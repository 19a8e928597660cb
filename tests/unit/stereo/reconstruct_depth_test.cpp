// SPDX-License-Identifier: Apache-2.0
// The requested depths: objects outside are not part of the surface.
#include <doctest/doctest.h>

#include <algorithm>
#include <string>

#include "core/error.h"
#include "stereo/match/match.h"
#include "synthetic/matched.hpp"
#include "synthetic/scenes.hpp"
#include "synthetic/seed.hpp"
#include "synthetic/verged.hpp"

using namespace synthetic;

namespace {

// An object of 90 x 110 px in front of a wall; depths in mm.
Verged object_before_wall(double object_mm, double wall_mm, uint64_t seed) {
    constexpr double kFocalPx = 700, kBaselineMm = 120;
    Verged setup;
    setup.rig = rectified_rig(kVergedWidth, kVergedHeight, kFocalPx, kBaselineMm);
    setup.calib = calibration_of(setup.rig, {0, 0, 0}, {-kBaselineMm, 0, 0});
    setup.calib.rectified = true;
    Builder builder(setup.rig, seed);
    const auto textured = [&](double px) { return builder.noise(px, 3, 0.15); };
    const double far_px = kFocalPx * kBaselineMm / wall_mm;
    const double near_px = kFocalPx * kBaselineMm / object_mm;
    setup.scene.surfaces.push_back(builder.plane(far_px, 0.01, 0.01, textured(far_px)));
    setup.scene.surfaces.push_back(builder.piece(near_px, 130, 70, 90, 110, textured(near_px)));
    Sensor sensor;
    sensor.bits = kVergedBits;
    sensor.noise_grey = 1;
    setup.left = render_view(setup.scene, setup.rig.left, sensor, 3, seed);
    setup.right = render_view(setup.scene, setup.rig.right, sensor, 3, seed + 1);
    return setup;
}

// The share of points whose pixel shows something other than `surface`; and of the pixels of that
// surface seen by both cameras, the share with a point.
struct Shares {
    double ghosts, found;
};
Shares shares_of(const Verged &setup, const reconstruct_result &result, int surface) {
    const ViewTruth truth = truth_of(setup.scene, setup.rig.left, setup.rig.right, true);
    int kept = 0, ghosts = 0, wanted = 0, found = 0;
    for (int y = 0; y < kVergedHeight; y++) {
        for (int x = 0; x < kVergedWidth; x++) {
            const size_t i = static_cast<size_t>(y) * kVergedWidth + static_cast<size_t>(x);
            const bool valid = image_u8_row(&result.match.reason, y)[x] == REASON_VALID;
            const bool is_wanted =
                truth.surface[i] == surface && truth.visibility[i] == Visibility::Visible;
            kept += valid;
            ghosts += valid && truth.surface[i] != surface;
            wanted += is_wanted;
            found += is_wanted && valid;
        }
    }
    return {kept > 0 ? static_cast<double>(ghosts) / kept : 0, static_cast<double>(found) / wanted};
}

constexpr match_preset kPresets[] = {MATCH_PRESET_FAST, MATCH_PRESET_STANDARD, MATCH_PRESET_BEST,
                                     MATCH_PRESET_BOARD};

}  // namespace

TEST_CASE("objects outside the requested depths leave no ghosts inside") {
    const Verged setup = object_before_wall(1350, 2400, test_seed());
    const struct {
        const char *what;
        double near_mm, far_mm;
        int surface;
        double found_min;
    } cases[] = {{"the object, without the wall behind it", 1200, 1500, 1, 0.95},
                 {"the wall, without the object before it", 1900, 4000, 0, 0.9}};
    for (const auto &asked : cases) {
        for (const match_preset preset : kPresets) {
            CAPTURE(std::string(asked.what));
            CAPTURE(std::string(match_preset_name(preset)));
            VergedSetting setting;
            setting.options.preset = preset;
            setting.options.rectify.depth_near_mm = asked.near_mm;
            setting.options.rectify.depth_far_mm = asked.far_mm;
            const VergedRun done = run_verged(setup, setting);
            REQUIRE(done.status == ERROR_OK);
            CHECK(done.peak_bytes <= done.need_bytes);
            const Shares shares = shares_of(setup, done.result, asked.surface);
            MESSAGE(std::string(match_preset_name(preset))
                    << ", " << std::string(asked.what) << ": " << 100 * shares.ghosts
                    << " % ghosts, " << 100 * shares.found << " % found");
            CHECK(shares.ghosts <= 0.01);
            CHECK(shares.found >= asked.found_min);
        }
    }
}

TEST_CASE("no point lies outside the depths asked for, and none within them is lost") {
    const Verged setup = make_verged(test_seed());
    // Between two disparities that are searched in any case: the points themselves are cut.
    constexpr double kNearMm = 900, kFarMm = 1003.5;
    VergedSetting asked;
    asked.options.rectify.depth_near_mm = kNearMm;
    asked.options.rectify.depth_far_mm = kFarMm;
    const VergedRun done = run_verged(setup, asked);
    REQUIRE(done.status == ERROR_OK);
    int outside = 0;
    for (uint32_t i = 0; i < done.result.vertex_count; i++) {
        const double z_mm = done.result.points[i].z_um / 1000.0;
        outside += z_mm < kNearMm - 0.001 || z_mm > kFarMm + 0.001;
    }
    CHECK(outside == 0);
    CHECK(done.result.reason_count[REASON_VALID] == done.result.vertex_count);

    asked.options.keep_all = true;
    const VergedRun all = run_verged(setup, asked);
    REQUIRE(all.status == ERROR_OK);
    double min_mm = 1e9, max_mm = 0;
    for (uint32_t i = 0; i < all.result.vertex_count; i++) {
        min_mm = std::min(min_mm, all.result.points[i].z_um / 1000.0);
        max_mm = std::max(max_mm, all.result.points[i].z_um / 1000.0);
    }
    CHECK(min_mm < kNearMm);
    CHECK(max_mm > kFarMm);

    // The same search, stated as disparities: its interior equals the points kept.
    VergedSetting searched = asked;
    searched.options.keep_all = false;
    searched.options.rectify.disparity_min = done.result.plan.disparity_min;
    searched.options.rectify.disparity_count = done.result.plan.disparity_count;
    const VergedRun wide = run_verged(setup, searched);
    REQUIRE(wide.status == ERROR_OK);
    const auto within =
        std::count_if(wide.result.points, wide.result.points + wide.result.vertex_count,
                      [](const triangulate_point &point) {
                          return point.z_um >= 1000 * kNearMm && point.z_um <= 1000 * kFarMm + 1;
                      });
    CHECK(within == static_cast<long>(done.result.vertex_count));
    CHECK(wide.result.vertex_count > done.result.vertex_count);
}

TEST_CASE("empty depths give no surface") {
    const Verged setup = make_verged(5);
    VergedSetting asked;
    // One disparity is 39 mm there, and the search exceeds the request by one or more.
    asked.options.rectify.depth_near_mm = 1399;
    asked.options.rectify.depth_far_mm = 1399.01;
    const VergedRun done = run_verged(setup, asked);
    CHECK(done.status == ERROR_NO_SURFACE);
    CHECK(done.result.reason_count[REASON_VALID] == 0);
}

TEST_CASE("texture that repeats is counted, and no other") {
    const Rig rig = rectified_rig(kVergedWidth, kVergedHeight, 700, 120);
    Builder builder(rig, test_seed());
    const struct {
        Texture texture;
        double min, max;
    } cases[] = {{builder.stripes(26, 10, 0.3), 0.8, 1},
                 {builder.stripes(26, 24, 0.3), 0.5, 1},
                 {builder.stripes(26, 24, 0.02), 0.5, 1},  // five grey levels
                 {builder.noise(26, 3, 0.15), 0, 0.05},
                 {builder.noise(26, 12, 0.15), 0, 0.1}};
    for (const auto &one : cases) {
        Scene scene;
        scene.surfaces.push_back(builder.plane(26.3, 0, 0, one.texture));
        RenderOptions options;
        options.left.noise_grey = options.right.noise_grey = 1;
        const Pair pair = render(scene, rig, options);
        match_options search = match_default_options(0, 64);
        search.keep_all = true;
        const Matched matched = run_match(pair, search);
        REQUIRE(matched.status == ERROR_OK);
        std::vector<uint64_t> memory(match_repeats_need_bytes(pair.width, 1) / 8 + 8);
        arena lent;
        arena_init(&lent, memory.data(), memory.size() * sizeof memory[0]);
        uint32_t count = 0;
        REQUIRE(match_count_repeats(&matched.input, &search, &parallel_serial, &lent,
                                    &matched.output, 0, pair.height, &count) == ERROR_OK);
        const double share = count / (matched.share(REASON_VALID) * pair.width * pair.height);
        CHECK(share >= one.min);
        CHECK(share <= one.max);
        // Where no other period is searched, nothing is ambiguous.
        search.disparity_min = 22;
        search.disparity_count = 9;
        const Matched sure = run_match(pair, search);
        count = 0;
        REQUIRE(match_count_repeats(&sure.input, &search, &parallel_serial, &lent, &sure.output, 0,
                                    pair.height, &count) == ERROR_OK);
        CHECK(count == 0);
    }
}
