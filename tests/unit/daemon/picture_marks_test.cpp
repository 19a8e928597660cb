// SPDX-License-Identifier: Apache-2.0
// Marks for aiming: which edges count as in focus, whatever noise, contrast and thinning are; what
// is too bright and too dark.
#include "daemon/images/picture_marks.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <random>
#include <vector>

#include "synthetic/seed.hpp"

namespace {

constexpr int width = 128, height = 96;
constexpr focus_noise sensor{42, 240, 7563};  // noise of the default rig at gain 1, with rounding

/// A mosaic of a scene: light at a place in pixels of the sensor, 0..1. `skip` reads every skip-th
/// pair of rows and columns, as sensors do.
struct scene {
    std::function<double(double x, double y)> light;
    double full = 600;  // values above black
    int skip = 1;
    double noisy = 1;
};

std::vector<uint16_t> mosaic_of(const scene &what, std::mt19937_64 &random) {
    std::normal_distribution<double> normal;
    std::vector<uint16_t> values(width * height);
    for (int y = 0; y < height; y++) {
        for (int x = 0; x < width; x++) {
            const double at_x = x / 2 * 2 * what.skip + x % 2, at_y = y / 2 * 2 * what.skip + y % 2;
            const double colour = (x + y) % 2 == 0 ? 1 : x % 2 == 1 ? 0.6 : 0.5;
            const double mean = colour * what.full * what.light(at_x, at_y);
            const double sigma = std::sqrt(218 / 256.0 + mean * 7563 / 65536.0);
            const double value = 42 + mean + what.noisy * sigma * normal(random);
            values[static_cast<size_t>(y * width + x)] =
                static_cast<uint16_t>(std::clamp(std::lround(value), 0L, 1023L));
        }
    }
    return values;
}

struct marked {
    picture_marks marks;
    std::vector<uint8_t> pixels;
};

marked mark(const std::vector<uint16_t> &values, int skip = 1, int shrink = 1) {
    const raw_image raw{values.data(), width, height, width, 10, RAW_BAYER_GRBG, nullptr, nullptr};
    marked result{
        {}, std::vector<uint8_t>(static_cast<size_t>(width / shrink * (height / shrink)), 100)};
    picture picture{result.pixels.data(),
                    width / shrink,
                    height / shrink,
                    1,
                    static_cast<size_t>(width / shrink),
                    nullptr,
                    nullptr};
    picture_mark(&raw, &sensor, skip, shrink, &picture, &result.marks);
    CHECK(result.marks.blocks == width * height / 4);
    return result;
}

/// Steep bars with edges that a blur of this diameter smears into ramps.
scene bars(double blur_px, int skip = 1, double contrast = 0.8) {
    return {[=](double x, double y) {
                const double from_edge = std::abs(std::fmod(x + 0.3 * y, 46) - 23) - 11.5;
                const double ramp = std::clamp(from_edge / blur_px + 0.5, 0.0, 1.0);
                return 0.2 + contrast * ramp;
            },
            600, skip};
}

/// Around the bars' edges, six a row of 128 pixels.
constexpr uint32_t edges = 5 * height / 2;

}  // namespace

TEST_CASE("edges in focus are marked, blurred ones are not") {
    std::mt19937_64 random(synthetic::test_seed());
    CHECK(mark(mosaic_of(bars(1.5), random)).marks.sharp > edges / 4);
    CHECK(mark(mosaic_of(bars(3), random)).marks.sharp > edges / 8);
    CHECK(mark(mosaic_of(bars(12), random)).marks.sharp <= 2);
    CHECK(mark(mosaic_of(bars(40), random)).marks.sharp <= 2);
    // Contrast does not replace focus, nor does focus need much of it.
    CHECK(mark(mosaic_of(bars(2, 1, 0.2), random)).marks.sharp > edges / 8);
}

TEST_CASE("the count grows with each step towards focus") {
    std::mt19937_64 random(synthetic::test_seed());
    for (const double contrast : {0.2, 0.8}) {
        uint32_t before = 0;
        for (const double blur_px : {12.0, 8.0, 6.0, 5.0, 4.0, 3.0, 2.0, 1.5, 1.0}) {
            CAPTURE(blur_px);
            CAPTURE(contrast);
            const uint32_t sharp = mark(mosaic_of(bars(blur_px, 1, contrast), random)).marks.sharp;
            CHECK(sharp >= before);
            before = sharp;
        }
        CHECK(before > edges / 5);
    }
}

TEST_CASE("a thinned frame still shows what is in focus") {
    std::mt19937_64 random(synthetic::test_seed());
    for (const int skip : {2, 4}) {
        CAPTURE(skip);
        CHECK(mark(mosaic_of(bars(1.5, skip), random), skip).marks.sharp > edges / 4);
        CHECK(mark(mosaic_of(bars(12, skip), random), skip).marks.sharp <= 2);
    }
}

TEST_CASE("noise is never in focus, whatever the light") {
    std::mt19937_64 random(synthetic::test_seed());
    uint32_t sharp = 0;
    for (const double full : {20.0, 100.0, 400.0, 900.0}) {
        for (int i = 0; i < 8; i++) {
            sharp +=
                mark(mosaic_of({[](double, double) { return 0.9; }, full}, random)).marks.sharp;
        }
    }
    CHECK(sharp <= 2);  // maximum for 98304 blocks
}

TEST_CASE("what is too bright has stripes, what is too dark is blue") {
    std::mt19937_64 random(1);
    const auto halves = [](double x, double) { return x < width / 2 ? 0.0 : 2.0; };
    const marked result = mark(mosaic_of({halves, 900, 1, 0}, random));
    CHECK(result.marks.dark == width * height / 8);
    CHECK(result.marks.saturated == width * height / 8);
    CHECK(result.marks.sharp == 0);
    const auto count = [&result](uint8_t value, int from, int to) {
        int all = 0;
        for (int y = 0; y < height; y++) {
            all += static_cast<int>(
                std::count(&result.pixels[static_cast<size_t>(y * width + from)],
                           &result.pixels[static_cast<size_t>(y * width + to - 1)] + 1, value));
        }
        return all;
    };
    CHECK(count(PICTURE_MARK_DARK, 0, width / 2) > 0.95 * width * height / 2);
    const int striped = count(PICTURE_MARK_SATURATED, width / 2, width);
    CHECK(striped > 0.4 * width * height / 2);
    CHECK(striped < 0.6 * width * height / 2);
    CHECK(count(PICTURE_MARK_CROSS, 0, width) > 8);
}

TEST_CASE("marks of a reduced picture lie where they are") {
    std::mt19937_64 random(2);
    const auto edge = [](double, double y) { return y < 51 ? 0.3 : 0.9; };
    const marked result = mark(mosaic_of({edge, 600, 1, 0}, random), 1, 4);
    for (int y = 0; y < height / 4; y++) {
        const uint8_t *row = &result.pixels[static_cast<size_t>(y * width / 4)];
        CAPTURE(y);
        CHECK((std::count(row, row + width / 4, PICTURE_MARK_SHARP) > width / 8) == (y == 12));
    }
}

TEST_CASE("the palette is grey up to the marks") {
    uint8_t palette[PICTURE_COLOURS][3];
    picture_marks_palette(palette);
    CHECK(palette[0][0] == 0);
    CHECK(palette[PICTURE_MARK_GREYS - 1][2] == 255);
    for (int i = 1; i < PICTURE_MARK_GREYS; i++) {
        CHECK(palette[i][0] > palette[i - 1][0]);
        CHECK(palette[i][0] == palette[i][1]);
    }
    CHECK(palette[PICTURE_MARK_SHARP][1] == 255);
    CHECK(palette[PICTURE_MARK_SATURATED][0] == 255);
    CHECK(palette[PICTURE_MARK_DARK][2] == 255);
}
