// SPDX-License-Identifier: Apache-2.0
// The subject among points that the test scatters over surfaces, and its dark part.
#include "measure/measure_subject.h"

#include <doctest/doctest.h>

#include <cmath>
#include <cstdint>
#include <random>
#include <vector>

#include "measure/measure_dark.h"
#include "synthetic/seed.hpp"

namespace {

using Random = std::mt19937_64;

double uniform(Random &random, double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
}

// Points of a box of surfaces, mm.
void scatter(Random &random, std::vector<triangulate_point> &points, int count, double x_mm,
             double half_mm, double near_mm, double far_mm) {
    const auto um = [](double mm) { return static_cast<int32_t>(std::lround(1000 * mm)); };
    for (int i = 0; i < count; i++) {
        const double z_mm = uniform(random, near_mm, far_mm);
        points.push_back({um(x_mm + uniform(random, -half_mm, half_mm)),
                          um(uniform(random, -half_mm, half_mm)), um(z_mm), 0, 0});
    }
}

bool find(const std::vector<triangulate_point> &points, const measure_subject_request &request,
          measure_subject &subject) {
    return measure_subject_find(points.data(), static_cast<uint32_t>(points.size()), &request,
                                &subject);
}

measure_ray ray_at(double x_mm, double z_mm) {
    return {{0, 0, 0}, {static_cast<int32_t>(std::lround(x_mm / z_mm * (1 << 20))), 0}};
}

}  // namespace

TEST_CASE("the subject is what is nearest on the ray, as deep as it is without a gap") {
    const uint64_t seed = synthetic::test_seed();
    INFO("VERGENCE_SEED=", seed);
    Random random(seed);
    for (int i = 0; i < 100; i++) {
        const double x_mm = uniform(random, -300, 300), half_mm = uniform(random, 40, 200);
        const double near_mm = uniform(random, 800, 3000),
                     far_mm = near_mm * uniform(random, 1.05, 1.2);
        const double wall_mm = far_mm * uniform(random, 1.1, 2);
        std::vector<triangulate_point> points;
        scatter(random, points, 4000, x_mm, half_mm, near_mm, far_mm);
        scatter(random, points, 20000, 0, 2000, wall_mm, wall_mm * 1.02);
        scatter(random, points, 30, 0, 2000, 200, 20000);  // wrong ones
        measure_subject subject{};
        REQUIRE(find(points, {ray_at(x_mm, (near_mm + far_mm) / 2), 0, 0, 0}, subject));
        CHECK(subject.near_um == doctest::Approx(1000 * near_mm).epsilon(0.025));
        CHECK(subject.far_um == doctest::Approx(1000 * far_mm).epsilon(0.025));
        CHECK((subject.middle_um[2] > 1000 * near_mm && subject.middle_um[2] < 1000 * far_mm));
        CHECK(subject.middle_um[0] == doctest::Approx(1000 * x_mm).epsilon(0.2).scale(1e5));
        // Off the axis the ray leaves the subject's middle from its near to its far end.
        const double slant_mm = std::fabs(x_mm) * (far_mm - near_mm) / 2 / near_mm;
        CHECK(subject.width_um > 0.9 * 2000 * half_mm);
        CHECK(subject.width_um < 1.15 * 2000 * (half_mm + slant_mm) + 4000);
        CHECK(subject.points == doctest::Approx(4000).epsilon(0.05));
    }
}

TEST_CASE("depths and width that are stated limit what counts") {
    Random random(7);
    std::vector<triangulate_point> points;
    scatter(random, points, 3000, 0, 50, 900, 920);
    scatter(random, points, 10, 0, 3, 300, 600);  // wrong ones on the ray
    scatter(random, points, 800, 0, 50, 1800, 1850);
    scatter(random, points, 3000, 400, 50, 1850, 2400);
    measure_subject subject{};
    const measure_ray ray = ray_at(0, 1);
    REQUIRE(find(points, {ray, 0, 0, 0}, subject));
    CHECK((subject.near_um > 880000 && subject.far_um < 950000));
    REQUIRE(find(points, {ray, 0, 1500000, 3000000}, subject));
    CHECK(subject.near_um == doctest::Approx(1800000).epsilon(0.02));
    CHECK(subject.far_um > 2300000);
    REQUIRE(find(points, {ray, 100000, 1500000, 3000000}, subject));
    CHECK(subject.far_um < 1900000);
    // A ray from the right camera sees along another line.
    const measure_ray right = {{400000, 0, 0}, {0, 0}};
    REQUIRE(find(points, {right, 0, 0, 0}, subject));
    CHECK(subject.near_um > 1750000);
    CHECK(subject.middle_um[0] == 400000);
}

TEST_CASE("a table that reaches from near to far is not the subject on it") {
    Random random(9);
    std::vector<triangulate_point> points;
    scatter(random, points, 4000, 0, 90, 1720, 1790);
    for (int row = 0; row < 200; row++) {  // rows of a picture, and where each meets the table
        const double z_mm = 125.0 / (0.05 + 0.1 * row / 200);
        scatter(random, points, 20, 0, 250, z_mm, z_mm);
        for (size_t i = points.size() - 20; i < points.size(); i++) {
            points[i].y_um = 125000;
        }
    }
    measure_subject subject{};
    REQUIRE(find(points, {ray_at(0, 1), 216000, 0, 0}, subject));
    CHECK(subject.near_um > 1650000);
    CHECK(subject.far_um < 1850000);
}

TEST_CASE("too few points are not a subject, and no values do harm") {
    const uint64_t seed = synthetic::test_seed();
    INFO("VERGENCE_SEED=", seed);
    Random random(seed);
    measure_subject subject{};
    const measure_ray ray = ray_at(0, 1);
    CHECK_FALSE(find({}, {ray, 0, 0, 0}, subject));
    std::vector<triangulate_point> points;
    scatter(random, points, MEASURE_SUBJECT_POINTS_MIN - 1, 0, 10, 1000, 1100);
    CHECK_FALSE(find(points, {ray, 0, 0, 0}, subject));
    scatter(random, points, 1, 0, 10, 1000, 1100);
    CHECK(find(points, {ray, 0, 0, 0}, subject));
    CHECK_FALSE(find(points, {ray, 0, 2000000, 3000000}, subject));
    for (int i = 0; i < 200; i++) {
        const auto any = [&] { return static_cast<int32_t>(random()); };
        const auto slope = [&] { return any() % (1 << 23); };
        points.clear();
        for (int j = 0; j < 300; j++) {
            const int32_t z_um = random() % 2 == 0 ? any() : any() / (1 << (random() % 12));
            points.push_back(
                {any() / (1 << (random() % 16)), any() / (1 << (random() % 16)), z_um, 0, 0});
        }
        const measure_subject_request request = {{{any(), any(), any()}, {slope(), slope()}},
                                                 random() % 2 == 0 ? 0 : std::abs(any() / 2),
                                                 0,
                                                 0};
        if (find(points, request, subject)) {
            CHECK((subject.near_um > 0 && subject.near_um < subject.far_um));
        }
    }
}

TEST_CASE("the dark part is that of the blocks in the box, by their green") {
    constexpr int kWidth = 64, kHeight = 48;
    for (const raw_layout layout : {RAW_GREY, RAW_RGB, RAW_BAYER_GRBG}) {
        const int channels = layout == RAW_RGB ? 3 : 1;
        const uint16_t black = 42;
        std::vector<uint16_t> values(static_cast<size_t>(kWidth * kHeight * channels));
        for (int y = 0; y < kHeight; y++) {
            for (int x = 0; x < kWidth; x++) {
                // Dark on the left quarter, where other colours are bright.
                const int level = x < kWidth / 4 ? black + 38 : black + 41;
                for (int c = 0; c < channels; c++) {
                    const bool green = layout == RAW_GREY || (layout == RAW_RGB && c == 1) ||
                                       (layout == RAW_BAYER_GRBG && (x & 1) == (y & 1));
                    values[static_cast<size_t>((y * kWidth + x) * channels + c)] =
                        static_cast<uint16_t>(green ? level : 900);
                }
            }
        }
        const raw_image image = {values.data(), kWidth,  kHeight, kWidth * channels, 10,
                                 layout,        nullptr, nullptr};
        const auto dark = [&](measure_box box) {
            return measure_dark_permille(&image, black, &box);
        };
        CHECK(dark({0, 0, kWidth, kHeight}) == 250);
        CHECK(dark({0, 0, 16, kHeight}) == 1000);
        CHECK(dark({3, 5, 29, 20}) == 333);  // whole blocks only: columns 8 to 31
        CHECK(dark({-1000, -1000, 2000, 2000}) == 250);
        CHECK(dark({16, 0, 48, 48}) == 0);
        CHECK(dark({0, 0, 7, 7}) == 0);
        CHECK(dark({INT32_MAX, INT32_MAX, INT32_MAX, INT32_MAX}) == 0);
        CHECK(dark({INT32_MIN, INT32_MIN, INT32_MAX, INT32_MAX}) == 0);
        const measure_box all = {0, 0, kWidth, kHeight};
        CHECK(measure_dark_permille(&image, 1023, &all) == 0);
    }
}
