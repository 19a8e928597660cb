// SPDX-License-Identifier: Apache-2.0
// How much of the subject a surface shows: drawn surfaces of a disc before a wall.
#include "console/measure/measure_share.h"

#include <doctest/doctest.h>

#include <cstdint>
#include <functional>
#include <vector>

namespace {

constexpr int kWidth = 640, kHeight = 480, kRadius = 150, kSubjectUm = 1800000, kWallUm = 2500000;

bool on_disc(int x, int y) {
    const int dx = x - kWidth / 2, dy = y - kHeight / 2;
    return dx * dx + dy * dy < kRadius * kRadius;
}

/// As much memory as it takes.
struct lent {
    explicit lent(const reconstruct_result &result) : bytes(measure_share_need_bytes(&result)) {
        arena_init(&memory, bytes.data(), bytes.size());
    }
    std::vector<uint8_t> bytes;
    arena memory{};
};

/// A surface that is kept, with points that are 1 mm deep for each 640 px across.
struct drawn {
    std::vector<uint8_t> why = std::vector<uint8_t>(kWidth * kHeight);
    std::vector<triangulate_point> points;
    std::vector<uint32_t> pixel;
    reconstruct_result result{};

    explicit drawn(const std::function<reason(int, int)> &reason_at) {
        for (int y = 0; y < kHeight; y++) {
            for (int x = 0; x < kWidth; x++) {
                const auto reason = reason_at(x, y);
                why[static_cast<size_t>(y * kWidth + x)] = static_cast<uint8_t>(reason);
                result.reason_count[reason]++;
                if (reason == REASON_VALID) {
                    const int32_t z_um = on_disc(x, y) ? kSubjectUm + 100 * x : kWallUm;
                    triangulate_point point{};
                    point.x_um = (x - kWidth / 2) * 500;
                    point.y_um = (y - kHeight / 2) * 500;
                    point.z_um = z_um;
                    point.sigma_um = on_disc(x, y) ? 300 : 900;
                    points.push_back(point);
                    pixel.push_back(static_cast<uint32_t>(y * kWidth + x));
                }
            }
        }
        result.plan.width_px = kWidth;
        result.plan.height_px = kHeight;
        result.match.reason = {why.data(), kWidth, kHeight, kWidth};
        result.points = points.data();
        result.vertex_pixel = pixel.data();
        result.vertex_count = static_cast<uint32_t>(points.size());
    }

    measure_share share(surface_figures_depths depths = {kSubjectUm - 1000, kSubjectUm + 100000}) {
        measure_share found;
        lent memory(result);
        REQUIRE(measure_share_of(&result, &depths, &memory.memory, &found));
        return found;
    }
};

uint32_t disc_pixels(const std::function<bool(int, int)> &where) {
    uint32_t count = 0;
    for (int y = 0; y < kHeight; y++) {
        for (int x = 0; x < kWidth; x++) {
            count += on_disc(x, y) && where(x, y);
        }
    }
    return count;
}

}  // namespace

TEST_CASE("a blank or a measured wall beside the subject does not count") {
    for (const reason wall : {REASON_VALID, REASON_NO_TEXTURE, REASON_OCCLUDED, REASON_BEYOND}) {
        CAPTURE(wall);
        drawn surface([wall](int x, int y) { return on_disc(x, y) ? REASON_VALID : wall; });
        const measure_share share = surface.share();
        CHECK(share.missed == 0);
        CHECK(share.measured == disc_pixels([](int, int) { return true; }));
        CHECK(share.hole == REASON_VALID);
        CHECK(share.spread.sigma_mm[1] == doctest::Approx(0.3));
        CHECK(share.spread.depth_mm[1] == doctest::Approx(1832).epsilon(0.001));
    }
}

TEST_CASE("what is missing inside of the subject counts, with its reason") {
    // All but its contour is blank; the wall is, too.
    const auto inside = [](int x, int y) {
        const int dx = x - kWidth / 2, dy = y - kHeight / 2;
        return dx * dx + dy * dy < (kRadius - 12) * (kRadius - 12);
    };
    drawn ring([&](int x, int y) {
        return on_disc(x, y) && !inside(x, y) ? REASON_VALID : REASON_NO_TEXTURE;
    });
    const measure_share share = ring.share();
    CHECK(share.missed == disc_pixels(inside));
    CHECK(share.hole == REASON_NO_TEXTURE);
    // A part that reaches the contour at one side is closed along the columns.
    const auto right = [](int x, int y) { return x > kWidth / 2 && y > 200 && y < 280; };
    drawn bitten([&](int x, int y) {
        return !on_disc(x, y) ? REASON_NO_TEXTURE : right(x, y) ? REASON_AMBIGUOUS : REASON_VALID;
    });
    CHECK(bitten.share().missed > disc_pixels(right) * 9 / 10);
    CHECK(bitten.share().missed <= disc_pixels(right));
}

TEST_CASE("single mistakes on a blank wall do not make it the subject's") {
    drawn surface([](int x, int y) {
        return on_disc(x, y)                ? REASON_VALID
               : (x % 50 < 3 && y % 2 == 0) ? REASON_VALID
                                            : REASON_NO_TEXTURE;
    });
    for (size_t i = 0; i < surface.points.size(); i++) {
        surface.points[i].z_um = kSubjectUm;  // the mistakes have its depth
    }
    CHECK(surface.share().missed == 0);
}

TEST_CASE("the subject is found in the whole surface as in a coarse one") {
    measure_subject_request request{};
    measure_subject subject{};
    drawn surface([](int, int) { return REASON_VALID; });
    lent memory(surface.result);
    REQUIRE(measure_share_find(&surface.result, &request, &memory.memory, &subject));
    CHECK(subject.near_um > kSubjectUm * 0.97);
    CHECK(subject.far_um < kSubjectUm * 1.06);
    drawn nothing([](int x, int y) { return on_disc(x, y) ? REASON_NO_TEXTURE : REASON_VALID; });
    CHECK(nothing.share().measured == 0);
}
