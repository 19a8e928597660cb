// SPDX-License-Identifier: Apache-2.0
// Calculations from the sensor's settings: times compared with the datasheet's table and with
// published measurements, gain codes compared with all existing codes.
#include "device/mt9t001.h"

#include <doctest/doctest.h>

#include <cmath>
#include <cstdint>
#include <random>
#include <vector>

#include "core/error.h"
#include "synthetic/seed.hpp"

namespace {

constexpr uint32_t kClockHz = 48000000;

mt9t001_timing timing_of(const mt9t001_window &window, uint32_t rows = 1) {
    mt9t001_timing timing{};
    REQUIRE(mt9t001_timing_of(&window, rows, kClockHz, &timing) == ERROR_OK);
    return timing;
}

mt9t001_window centred(uint16_t width_px, uint16_t height_px, uint8_t skip = 1, uint8_t bin = 1) {
    mt9t001_window window{};
    REQUIRE(mt9t001_centred_window(width_px, height_px, skip, bin, &window) == ERROR_OK);
    return window;
}

double frames_per_s(uint16_t width_px, uint16_t height_px, uint16_t hblank_clocks,
                    uint16_t vblank_rows, uint8_t skip = 1, uint8_t bin = 1) {
    mt9t001_window window = centred(width_px, height_px, skip, bin);
    window.hblank_clocks = hblank_clocks;
    window.vblank_rows = vblank_rows;
    return 1e6 / double(timing_of(window).frame_us);
}

}  // namespace

TEST_CASE("frame rates are those of the datasheet's table") {
    // The table does not state the blanking: that of a reset for the full window, and the least
    // columns for the others, come closest.
    CHECK(frames_per_s(2048, 1536, 142, 25) == doctest::Approx(12).epsilon(0.002));
    CHECK(frames_per_s(1600, 1200, 21, 25) == doctest::Approx(20).epsilon(0.02));
    CHECK(frames_per_s(1280, 1024, 21, 25) == doctest::Approx(27).epsilon(0.02));
    CHECK(frames_per_s(1024, 768, 21, 25) == doctest::Approx(43).epsilon(0.02));
    CHECK(frames_per_s(640, 480, 21, 25) == doctest::Approx(93).epsilon(0.02));
}

TEST_CASE("frame rates are those measured of a camera with this sensor") {
    CHECK(frames_per_s(2048, 1536, 21, 3, 2, 2) == doctest::Approx(35.65).epsilon(0.005));
    CHECK(frames_per_s(2048, 1536, 1024, 3) == doctest::Approx(9.0).epsilon(0.01));
}

TEST_CASE("a row is never shorter than the sensor can make it") {
    mt9t001_window window = centred(100, 100);
    window.hblank_clocks = 21;
    CHECK(timing_of(window).row_clocks == 511);
    window.hblank_clocks = 142;
    CHECK(timing_of(window).row_clocks == 100 + 331 + 38 + 142);
}

TEST_CASE("the full window is that of a reset, and rows are 53.31 us") {
    const mt9t001_timing timing = timing_of(mt9t001_full_window());
    CHECK(timing.width_px == 2048);
    CHECK(timing.height_px == 1536);
    CHECK(timing.row_clocks == 2559);
    CHECK(timing.row_ns == 53313);
    CHECK(timing.frame_rows == 1536 + 25 + 1);
}

TEST_CASE("a long exposure makes frames longer, to the row") {
    const mt9t001_window window = mt9t001_full_window();
    CHECK(timing_of(window, 1561).frame_rows == 1562);
    CHECK(timing_of(window, 1562).frame_rows == 1563);
    CHECK(timing_of(window, 40000).frame_rows == 40001);
}

TEST_CASE("rows for a time are the nearest, and never none") {
    std::mt19937_64 random(synthetic::test_seed());
    for (int i = 0; i < 20000; i++) {
        const auto skip = uint8_t(1 + random() % 8);
        const auto bin = uint8_t(1 + random() % std::min<unsigned>(skip, 3));
        const auto width_px = uint16_t((1 + random() % (1024 / skip)) * 2 * skip);
        const auto height_px = uint16_t((1 + random() % (768 / skip)) * 2 * skip);
        mt9t001_window window = centred(width_px, height_px, skip, bin);
        window.hblank_clocks = uint16_t(21 + random() % 2027);
        const mt9t001_timing timing = timing_of(window);
        const uint64_t wanted_us = random() % (uint64_t(1) << random() % 33);
        const uint32_t rows = mt9t001_rows_for(&timing, wanted_us);
        CHECK(rows >= 1);
        CHECK(rows <= MT9T001_SHUTTER_ROWS_MAX);
        const double row_us = double(timing.row_clocks) / 48;
        const double real_us = double(mt9t001_exposure_us(&timing, rows));
        if (rows > 1 && rows < MT9T001_SHUTTER_ROWS_MAX) {
            CHECK(std::abs(real_us - double(wanted_us)) <= row_us / 2 + 2);
        } else if (rows == 1) {
            CHECK(double(wanted_us) <= real_us + row_us / 2 + 2);
        } else {
            CHECK(double(wanted_us) >= real_us - row_us / 2 - 2);
        }
        // And the inverse.
        CHECK(mt9t001_rows_for(&timing, uint64_t(real_us)) == rows);
    }
}

TEST_CASE("gain codes are the best of all that the sensor's fields can hold") {
    // First stage 8 .. 32 eighths, doubled by bit 6, times 1 + digital / 8. Analogue gain adds less
    // noise, so digital steps are only used above both stages.
    struct Code {
        unsigned real_q3;
        uint16_t code;
    };
    std::vector<Code> all;
    for (unsigned analog = 8; analog <= 32; analog++) {
        all.push_back({analog, uint16_t(analog)});
        if (2 * analog > 32) {
            all.push_back({2 * analog, uint16_t(0x40 | analog)});
        }
    }
    for (unsigned digital = 1; digital <= 120; digital++) {
        all.push_back({64 + 8 * digital, uint16_t(digital << 8 | 0x60)});
    }
    for (unsigned wanted = 8; wanted <= 1024; wanted++) {
        uint16_t code = 0, real_q3 = 0;
        REQUIRE(mt9t001_gain_code(uint16_t(wanted), &code, &real_q3) == ERROR_OK);
        unsigned best = ~0u;
        bool exists = false;
        for (const Code &other : all) {
            best = std::min(best, unsigned(std::abs(int(other.real_q3) - int(wanted))));
            exists = exists || (other.code == code && other.real_q3 == real_q3);
        }
        CHECK(exists);
        CHECK(unsigned(std::abs(int(real_q3) - int(wanted))) == best);
    }
}

TEST_CASE("gains that the sensor does not have are rejected") {
    uint16_t code = 1, real_q3 = 2;
    CHECK(mt9t001_gain_code(7, &code, &real_q3) == ERROR_RANGE);
    CHECK(mt9t001_gain_code(1025, &code, &real_q3) == ERROR_RANGE);
    CHECK(code == 1);
    CHECK(real_q3 == 2);
}

TEST_CASE("windows lie in the middle, on even rows and columns") {
    const mt9t001_window window = centred(640, 480);
    CHECK(window.column_px == 704);
    CHECK(window.row_px == 528);
    CHECK(centred(2046, 1534).column_px == 0);
    CHECK(centred(2044, 1532).column_px == 2);
}

TEST_CASE("windows that the sensor cannot show are refused") {
    mt9t001_window window{};
    CHECK(mt9t001_centred_window(2050, 100, 1, 1, &window) == ERROR_RANGE);
    CHECK(mt9t001_centred_window(100, 1538, 1, 1, &window) == ERROR_RANGE);
    CHECK(mt9t001_centred_window(101, 100, 1, 1, &window) == ERROR_RANGE);
    CHECK(mt9t001_centred_window(102, 100, 2, 1, &window) == ERROR_RANGE);
    CHECK(mt9t001_centred_window(0, 100, 1, 1, &window) == ERROR_RANGE);
    CHECK(mt9t001_centred_window(100, 100, 0, 1, &window) == ERROR_RANGE);
    CHECK(mt9t001_centred_window(144, 144, 9, 1, &window) == ERROR_RANGE);
    CHECK(mt9t001_centred_window(100, 100, 2, 3, &window) == ERROR_RANGE);
    CHECK(mt9t001_centred_window(128, 128, 4, 4, &window) == ERROR_RANGE);
    mt9t001_timing timing{};
    window = mt9t001_full_window();
    window.hblank_clocks = 20;
    CHECK(mt9t001_timing_of(&window, 1, kClockHz, &timing) == ERROR_RANGE);
    window = mt9t001_full_window();
    window.vblank_rows = 2;
    CHECK(mt9t001_timing_of(&window, 1, kClockHz, &timing) == ERROR_RANGE);
    window = mt9t001_full_window();
    window.column_px = 2;
    CHECK(mt9t001_timing_of(&window, 1, kClockHz, &timing) == ERROR_RANGE);
    window = mt9t001_full_window();
    CHECK(mt9t001_timing_of(&window, 0, kClockHz, &timing) == ERROR_RANGE);
    CHECK(mt9t001_timing_of(&window, 0x100000, kClockHz, &timing) == ERROR_RANGE);
}
