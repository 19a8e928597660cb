// SPDX-License-Identifier: Apache-2.0
// Merged exposures against the same estimate in double precision, and against the light itself.
#include "stereo/image/merge_exposures.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <random>
#include <vector>

#include "core/error.h"
#include "synthetic/seed.hpp"

namespace {

constexpr int kWidth = 128, kHeight = 96, kBlack = 42;
constexpr double kWell = 8500, kRead = 8;
// Light that saturates a frame, and so a merged image.
constexpr double kMergedWell = kWell * (1008 - kBlack) / (1023 - kBlack);
constexpr size_t kValues = size_t(kWidth) * kHeight;

using Values = std::vector<uint16_t>;

raw_image view(const Values &values, int bits, raw_layout layout = RAW_BAYER_GRBG) {
    const int channels = layout == RAW_RGB ? 3 : 1;
    return {values.data(), kWidth, kHeight, channels * kWidth, bits, layout, nullptr, nullptr};
}

// Electrons of each pixel in an exposure of 1: from a few to `brightest`, in steps of one column.
std::vector<double> ramp(double darkest, double brightest) {
    std::vector<double> light(kValues);
    for (size_t i = 0; i < kValues; i++) {
        light[i] = darkest * std::pow(brightest / darkest, double(i % kWidth) / (kWidth - 1));
    }
    return light;
}

struct Shot {
    double ratio;
    uint16_t gain_q3 = 8;
};

Values exposed(const std::vector<double> &light, const Shot &shot, int bits,
               std::mt19937_64 *random) {
    std::normal_distribution<double> noise(0, 1);
    const double full = (1 << bits) - 1, black = kBlack * (full + 1) / 1024;
    const double per_e = shot.gain_q3 / 8.0 * (full - black) / kWell;
    Values values;
    for (const double one : light) {
        const double mean = one * shot.ratio;
        const double spread = random == nullptr ? 0 : std::sqrt(mean) * noise(*random);
        const double read = random == nullptr ? 0 : kRead * noise(*random);
        const double electrons = std::clamp(mean + spread, 0.0, kWell) + read;
        values.push_back(uint16_t(std::clamp(std::round(black + electrons * per_e), 0.0, full)));
    }
    return values;
}

merge_exposure exposure_of(const Shot &shot) {
    return {uint32_t(std::lround(10000 * shot.ratio)), shot.gain_q3};
}

// From here on a value is saturated.
double full_of(int bits) {
    const int max = (1 << bits) - 1;
    return max - max / 64;
}

double light_of(const merge_exposure &exposure) {
    return double(exposure.exposure_us) * exposure.gain_q3;
}

struct Merged {
    Values values;
    merge_exposures merge{};
    std::vector<uint32_t> sums, changed;
};

merge_plan plan_of(const std::vector<Shot> &shots, int bits, raw_layout layout = RAW_BAYER_GRBG) {
    const bool linear = layout == RAW_BAYER_GRBG;
    return {{nullptr, kWidth, kHeight, 0, bits, layout, nullptr, nullptr},
            uint16_t(linear ? kBlack << (bits - 10) : 0),
            unsigned(shots.size()),
            exposure_of(shots.front()),
            exposure_of(shots.back())};
}

Merged merged_of(const std::vector<Values> &frames, const std::vector<Shot> &shots, int bits,
                 raw_layout layout = RAW_BAYER_GRBG) {
    Merged out;
    const merge_plan plan = plan_of(shots, bits, layout);
    out.sums.resize(merge_exposures_values(&plan.form));
    REQUIRE(merge_exposures_begin(&out.merge, &plan, out.sums.data()) == ERROR_OK);
    for (size_t i = 0; i < frames.size(); i++) {
        const raw_image frame = view(frames[i], bits, layout);
        const merge_exposure exposure = exposure_of(shots[i]);
        uint32_t changed = 99;
        REQUIRE(merge_exposures_add(&out.merge, &frame, &exposure, &changed) == ERROR_OK);
        out.changed.push_back(changed);
    }
    out.values.resize(out.sums.size());
    merge_exposures_end(&out.merge, out.values.data());
    return out;
}

std::vector<Values> take(const std::vector<double> &light, const std::vector<Shot> &shots, int bits,
                         std::mt19937_64 *random) {
    std::vector<Values> frames;
    for (const Shot &shot : shots) {
        frames.push_back(exposed(light, shot, bits, random));
    }
    return frames;
}

// What merge_exposures.h promises, with the weights that it chose.
double reference(const std::vector<Values> &frames, const std::vector<Shot> &shots,
                 const merge_exposures &merge, size_t at, int bits) {
    const double full = full_of(bits), black = merge.plan.black;
    double sum = 0, exposures = 0;
    for (size_t i = 0; i < frames.size(); i++) {
        const double ratio = light_of(exposure_of(shots[i])) / light_of(exposure_of(shots[0]));
        const bool longer =
            i > 0 && light_of(exposure_of(shots[i])) > light_of(exposure_of(shots[i - 1]));
        const double usable = std::floor((full - black) * 15 / 16);
        if (frames[i][at] >= full || (longer && sum / exposures * ratio > usable)) {
            break;
        }
        const double weight = merge.prefix[i + 1].weights - merge.prefix[i].weights;
        sum += weight * (frames[i][at] - black);
        exposures += weight * ratio;
    }
    return exposures == 0
               ? 65535
               : std::clamp(int(MERGE_BLACK) +
                                sum / exposures * (65535 - int(MERGE_BLACK)) / (full - black),
                            0.0, 65535.0);
}

}  // namespace

TEST_CASE("merged values are those of the same estimate in double precision") {
    std::mt19937_64 random(synthetic::test_seed());
    for (const int bits : {10, 12, 16}) {
        for (const std::vector<Shot> &shots : {std::vector<Shot>{{1}},
                                               {{1}, {1}, {1}, {1}},
                                               {{1}, {4}, {16}},
                                               {{1}, {3}, {9}, {27}, {81}},
                                               {{1, 8}, {1, 16}, {4, 16}}}) {
            const std::vector<double> light = ramp(3, 12000);
            const std::vector<Values> frames = take(light, shots, bits, &random);
            const Merged merged = merged_of(frames, shots, bits);
            double worst = 0;
            for (size_t i = 0; i < kValues; i++) {
                const double expected = reference(frames, shots, merged.merge, i, bits);
                worst = std::max(worst, std::abs(merged.values[i] - expected));
            }
            CAPTURE(bits);
            CAPTURE(shots.size());
            CHECK(worst <= 0.51);
        }
    }
}

namespace {

struct Errors {
    double bias, rms;  // mean and sigma of the error, in electrons
};

// Of the pixels of one column of the ramp, against their light.
Errors errors_of(const Values &values, const std::vector<double> &light, size_t column,
                 double merged_black, double full, double one) {
    double sum = 0, squares = 0;
    const double expected = light[column];
    for (size_t i = column; i < kValues; i += kWidth) {
        const double electrons = (values[i] - merged_black) / (full - merged_black) * one;
        sum += electrons - expected;
        squares += (electrons - expected) * (electrons - expected);
    }
    const double mean = sum / kHeight;
    return {mean, std::sqrt(squares / kHeight - mean * mean)};
}

}  // namespace

TEST_CASE("the noise of N equal exposures falls with the root of N, without bias") {
    std::mt19937_64 random(synthetic::test_seed());
    const std::vector<double> light = ramp(20, 6000);
    const Values one = exposed(light, {1}, 10, &random);
    for (const size_t frames : {2u, 8u, 64u}) {
        const std::vector<Shot> shots(frames, Shot{1});
        const Merged merged = merged_of(take(light, shots, 10, &random), shots, 10);
        double gain = 0;
        for (size_t column = 0; column < size_t(kWidth); column++) {
            const Errors single = errors_of(one, light, column, kBlack, 1023, kWell);
            const Errors many =
                errors_of(merged.values, light, column, MERGE_BLACK, 65535, kMergedWell);
            gain += single.rms / many.rms / kWidth;
            const double sigma = std::sqrt(light[column] + kRead * kRead);
            CHECK(std::abs(many.bias) < 5 * sigma / std::sqrt(double(frames) * kHeight) + 1);
        }
        CAPTURE(frames);
        CHECK(gain == doctest::Approx(std::sqrt(double(frames))).epsilon(0.06));
    }
}

TEST_CASE("a bracket shows dark parts with the noise of its longest exposure") {
    std::mt19937_64 random(synthetic::test_seed());
    const std::vector<double> light = ramp(4, 8000);
    const std::vector<Shot> shots{{1}, {4}, {16}};
    const Merged merged = merged_of(take(light, shots, 10, &random), shots, 10);
    double bias = 0, worst = 0;
    for (size_t column = 0; column < size_t(kWidth); column++) {
        const Errors errors =
            errors_of(merged.values, light, column, MERGE_BLACK, 65535, kMergedWell);
        // The least variance that exposures which do not saturate allow.
        double information = 0;
        for (const Shot &shot : shots) {
            if (light[column] * shot.ratio < kMergedWell * 7 / 8) {
                const double electrons = light[column] * shot.ratio;
                information += shot.ratio * shot.ratio / (electrons + kRead * kRead + 5.8);
            }
        }
        bias = std::max(bias, std::abs(errors.bias) / light[column]);
        worst = std::max(worst, errors.rms * std::sqrt(information));
    }
    CHECK(bias < 0.05);
    CHECK(worst < 1.35);  // the spread of 96 values is known to 7 %, of the worst of 128 columns
}

TEST_CASE("what saturates the shortest exposure is saturated, and nothing else") {
    const std::vector<double> light = ramp(100, 20000);
    const std::vector<Shot> shots{{1}, {4}};
    const std::vector<Values> frames = take(light, shots, 10, nullptr);
    const Merged merged = merged_of(frames, shots, 10);
    for (size_t i = 0; i < kValues; i++) {
        CHECK((merged.values[i] == 65535) == (frames[0][i] >= 1008));
        const double expected =
            int(MERGE_BLACK) + std::min(light[i] / kMergedWell, 1.0) * (65535 - int(MERGE_BLACK));
        CHECK(std::abs(merged.values[i] - expected) <= 40);
    }
}

TEST_CASE("encoded pictures are averaged as they are") {
    Values dark(3 * kValues, 10), bright(3 * kValues, 13);
    const std::vector<Shot> shots{{1}, {1}};
    const Merged merged = merged_of({dark, bright}, shots, 8, RAW_RGB);
    CHECK(std::abs(merged.values.front() - 11.5 * 65535 / full_of(8)) <= 0.5);
    CHECK(merged.values.back() == merged.values.front());
}

TEST_CASE("what moves between exposures is found, and noise is not") {
    std::mt19937_64 random(synthetic::test_seed());
    const std::vector<double> light = ramp(5, 7000);
    std::vector<double> moved = light;
    for (size_t i = 0; i < kValues; i++) {
        if (i % kWidth / 20 == 3 && i / kWidth / 20 == 1) {  // 20 x 20 pixels
            moved[i] *= 0.7;
        }
    }
    for (const std::vector<Shot> &shots : {std::vector<Shot>{{1}, {1}, {1}, {1}, {1}, {1}},
                                           {{1}, {4}, {16}},
                                           {{1}, {2}, {4}, {8}}}) {
        std::vector<Values> frames = take(light, shots, 10, &random);
        const Merged still = merged_of(frames, shots, 10);
        CHECK(*std::max_element(still.changed.begin(), still.changed.end()) == 0);
        frames.back() = exposed(moved, shots.back(), 10, &random);
        CHECK(merged_of(frames, shots, 10).changed.back() >= 20);

        // The frame that is taken at the end, at any of the exposures.
        const raw_image merged = view(still.values, MERGE_BITS);
        const merge_plan plan = plan_of(shots, 10);
        for (const Shot &shot : shots) {
            const merge_exposure exposure = exposure_of(shot);
            const Values same = exposed(light, shot, 10, &random);
            const Values other = exposed(moved, shot, 10, &random);
            const raw_image frames_after[] = {view(same, 10), view(other, 10)};
            CHECK(merge_exposures_changed(&plan, &merged, &frames_after[0], &exposure) == 0);
            CHECK(merge_exposures_changed(&plan, &merged, &frames_after[1], &exposure) >= 15);
        }
    }
}

TEST_CASE("exposures that cannot be merged are rejected") {
    const Values frame(kValues, 100);
    std::vector<uint32_t> sums(kValues);
    merge_exposures merge{};
    merge_plan plan = plan_of({{1}, {4}, {16}}, 10);
    plan.last = {10000u * 5000, 8};
    CHECK(merge_exposures_begin(&merge, &plan, sums.data()) == ERROR_RANGE);
    plan.last = {5000, 8};
    CHECK(merge_exposures_begin(&merge, &plan, sums.data()) == ERROR_RANGE);
    plan.last = {40000, 8};
    plan.black = 0;  // a ratio says nothing without a black level
    CHECK(merge_exposures_begin(&merge, &plan, sums.data()) == ERROR_RANGE);
    plan.black = kBlack;
    REQUIRE(merge_exposures_begin(&merge, &plan, sums.data()) == ERROR_OK);
    const raw_image image = view(frame, 10);
    uint32_t changed = 0;
    const merge_exposure first = {10000, 8}, longer = {30000, 8}, shorter = {20000, 8};
    CHECK(merge_exposures_add(&merge, &image, &first, &changed) == ERROR_OK);
    CHECK(merge_exposures_add(&merge, &image, &longer, &changed) == ERROR_OK);
    CHECK(merge_exposures_add(&merge, &image, &shorter, &changed) == ERROR_RANGE);
}

TEST_CASE("a bracket reaches from the bright parts to the dark ones") {
    Values frame(kValues, 400);
    std::fill(frame.begin(), frame.begin() + kValues / 20, kBlack + 6);
    const raw_image image = view(frame, 10);
    merge_bracket bracket = merge_bracket_for(&image, kBlack, 3);
    CHECK(!bracket.shorter);
    // 6 above black becomes an eighth of the range, but for the octave.
    CHECK(bracket.factor == 5);
    CHECK(merge_bracket_for(&image, kBlack, 6).factor == 2);
    std::fill(frame.end() - kValues / 100, frame.end(), 1023);
    bracket = merge_bracket_for(&image, kBlack, 3);
    CHECK(bracket.shorter);
    CHECK(bracket.factor == 8);
    std::fill(frame.begin(), frame.end(), 0);
    CHECK(merge_bracket_for(&image, kBlack, 4).factor == 7);
}
