// SPDX-License-Identifier: Apache-2.0
// The robust fit to vertical disparities, from samples with a known plane.
#include "stereo/row_trend.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "synthetic/scene.hpp"
#include "synthetic/seed.hpp"

using namespace synthetic;

namespace {

struct Block {
    int first_x, first_y, columns, rows;
};

row_trend fit(const std::vector<row_sample> &samples) {
    std::vector<int16_t> work(samples.size());
    row_trend trend{};
    row_trend_fit(samples.data(), static_cast<int>(samples.size()), work.data(), &trend);
    return trend;
}

double plane_at(const double plane_px[3], int x, int y) {
    return plane_px[0] + plane_px[1] * x + plane_px[2] * y;
}

}  // namespace

TEST_CASE("a plane is found below outliers, anywhere on the largest lattice") {
    Random random(test_seed());
    const Block blocks[] = {{-32, -24, 64, 48},  {-512, -2, 1024, 4}, {-2, -512, 4, 1024},
                            {448, -512, 64, 64}, {-512, 448, 64, 64}, {3, -7, 9, 12}};
    for (const Block &block : blocks) {
        CAPTURE(block.first_x);
        CAPTURE(block.first_y);
        const double middle_x = block.first_x + block.columns / 2.0;
        const double middle_y = block.first_y + block.rows / 2.0;
        double plane_px[3] = {0, random.uniform(-1, 1) / block.columns,
                              random.uniform(-1, 1) / block.rows};
        plane_px[0] = random.uniform(-1.5, 1.5) - plane_at(plane_px, 0, 0) -
                      plane_px[1] * middle_x - plane_px[2] * middle_y;
        std::vector<row_sample> samples;
        for (int y = block.first_y; y < block.first_y + block.rows; y++) {
            for (int x = block.first_x; x < block.first_x + block.columns; x++) {
                const bool is_outlier = random.uniform(0, 1) < 0.2;
                const double value_px = is_outlier
                                            ? random.uniform(-3, 3)
                                            : plane_at(plane_px, x, y) + 0.02 * random.normal();
                samples.push_back({static_cast<int16_t>(x), static_cast<int16_t>(y),
                                   static_cast<int16_t>(std::lround(4096 * value_px))});
            }
        }
        const row_trend trend = fit(samples);
        double worst = 0, greatest = 0;
        for (const row_sample &sample : samples) {
            const double expected = plane_at(plane_px, sample.x, sample.y);
            worst =
                std::max(worst, std::abs(plane_at(trend.plane_px, sample.x, sample.y) - expected));
            greatest = std::max(greatest, std::abs(expected));
        }
        CHECK(worst < 0.02);
        CHECK(trend.scatter_px > 0.02);
        CHECK(trend.scatter_px < 0.04);
        CHECK(trend.plane_p95_px < greatest + 0.02);
        if (std::abs(middle_x) < 8 && std::abs(middle_y) < 8) {  // else not determined
            CHECK(trend.curve_p95_px < 0.03);
        }
    }
}

TEST_CASE("samples on one line have a level and no slopes") {
    for (const bool is_row : {true, false}) {
        std::vector<row_sample> samples;
        for (int i = -512; i < 512; i++) {
            const auto at = static_cast<int16_t>(i);
            samples.push_back({is_row ? at : int16_t{500}, is_row ? int16_t{500} : at, 2048});
        }
        const row_trend trend = fit(samples);
        CHECK(trend.plane_px[0] == 0.5);
        CHECK(trend.plane_px[1] == 0);
        CHECK(trend.plane_px[2] == 0);
        CHECK(trend.median_px == 0.5);
        CHECK(trend.plane_p95_px == 0.5);
    }
}
