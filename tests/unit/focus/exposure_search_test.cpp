// SPDX-License-Identifier: Apache-2.0
// The exposure search against a sensor model of its own: random starts, lights over six decades,
// scenes with highlights and windows, flicker, and irises that differ from what the search assumes.
// VERGENCE_DRAWS sets the number of cases, VERGENCE_TRACE shows one of them.
#include "focus/exposure_search.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <random>
#include <vector>

#include "synthetic/seed.hpp"

namespace {

constexpr double kPi = 3.14159265358979323846;
constexpr int kSize = 64;
constexpr double kFullWell = 8500, kReadNoise = 8;
constexpr int kBlack = 42;
constexpr double kMainsHalfUs = 10000;
// Of the whole array of a sensor with 48 MHz.
constexpr exposure_limits kLimits = {53313, 6896, 46, 240000, 10000, 8, 64, 300, 850, 0, true};

// Light of each pixel in parts of a white surface, and its figures.
struct Scene {
    std::vector<double> light;
    double mean_green = 0;  // mean light of the green pixels
    double edge = 0;        // the light that 0.1 % of all pixels reach

    void finish() {
        int greens = 0;
        for (int y = 0; y < kSize; y++) {
            for (int x = 0; x < kSize; x++) {
                const bool green = (x + y) % 2 == 0;
                double &value = light[size_t(y * kSize + x)];
                value *= green ? 1 : y % 2 == 0 ? 0.62 : 0.55;
                mean_green += green ? value : 0;
                greens += green;
            }
        }
        mean_green /= greens;
        std::vector<double> sorted = light;
        std::sort(sorted.rbegin(), sorted.rend());
        edge = sorted[size_t(EXPOSURE_SATURATED_MAX * double(sorted.size()))];
    }
};

using Random = std::mt19937_64;

double uniform(Random &random, double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
}

double log_uniform(Random &random, double low, double high) {
    return std::exp(uniform(random, std::log(low), std::log(high)));
}

// Grey, textures, boards, ramps, highlights, windows.
Scene random_scene(Random &random, int kind) {
    Scene scene;
    scene.light.resize(size_t(kSize) * kSize);
    std::normal_distribution<double> normal(0, uniform(random, 0.05, 0.6));
    const double dark = uniform(random, 0.02, 0.3), part = uniform(random, 0.003, 0.05);
    const double bright = log_uniform(random, 3, 60), window = uniform(random, 0.1, 0.4);
    for (int y = 0; y < kSize; y++) {
        for (int x = 0; x < kSize; x++) {
            double value = 0.5;
            if (kind == 1 || kind >= 4) {
                value = 0.3 * std::exp(normal(random));
            } else if (kind == 2) {
                value = (x / 12 + y / 12) % 2 == 0 ? 0.9 : dark;
            } else if (kind == 3) {
                value = dark + double(x) / kSize;
            }
            const bool lit = kind == 4   ? uniform(random, 0, 1) < part
                             : kind == 5 ? x < window * kSize
                                         : false;
            scene.light[size_t(y * kSize + x)] = value * (lit ? bright : 1);
        }
    }
    scene.finish();
    return scene;
}

// A camera in front of a scene.
struct Camera {
    const Scene *scene = nullptr;
    double electrons_per_us = 0;  // signal of a white surface with the iris open
    double iris_range = 100, iris_bow = 0;
    double flicker = 0.06, phase = 0;
    bool exact_rows = true;  // false: the exposure is in rows of a small window
    std::vector<float> noise;
    Random random{1};

    Camera() : noise(1u << 16) {
        std::normal_distribution<float> normal(0, 1);
        for (float &value : noise) {
            value = normal(random);
        }
    }
    double transmission(int32_t iris) const {
        const double closed = (850 - iris) / 550.0;
        return std::pow(iris_range, -(closed + iris_bow * closed * (1 - closed)));
    }
    double real_us(const exposure_setting &setting) const {
        return exact_rows ? setting.exposure_us
                          : std::max(1.0, std::round(setting.exposure_us / 10.65)) * 10.65;
    }
    // Mean light during the exposures: frames are taken for two periods of the flicker if the
    // exposure is shorter than one.
    double lamp(double exposure_us) {
        phase = uniform(random, 0, 2 * kPi);
        const int frames = exposure_us < kMainsHalfUs * 0.9 ? 6 : 1;
        const double spacing_us = std::max(exposure_us, 2 * kMainsHalfUs / 6);
        double sum = 0;
        for (int i = 0; i < frames; i++) {
            const double begin = phase + 2 * kPi * i * spacing_us / kMainsHalfUs;
            const double end = begin + 2 * kPi * exposure_us / kMainsHalfUs;
            sum += 1 - flicker * (std::cos(begin) - std::cos(end)) / (end - begin);
        }
        return sum / frames;
    }
    // Electrons of a white surface.
    double collected(const exposure_setting &setting) const {
        return electrons_per_us * real_us(setting) * transmission(setting.iris);
    }
    exposure_measure measure(const exposure_setting &setting) {
        const double electrons = collected(setting) * lamp(real_us(setting));
        const double gain = setting.gain_q3 / 8.0;
        const double per_electron = (1023 - kBlack) / kFullWell;
        exposure_histogram histogram;
        exposure_histogram_begin(&histogram, RAW_BAYER_GRBG, 10, kBlack);
        std::array<uint16_t, kSize> row{};
        size_t at = random() % noise.size();
        for (int y = 0; y < kSize; y++) {
            for (int x = 0; x < kSize; x++, at += 7) {
                const double light = electrons * scene->light[size_t(y * kSize + x)];
                const double spread = std::sqrt(light + kReadNoise * kReadNoise);
                const double charge = light + spread * double(noise[at % noise.size()]);
                const double value = kBlack + std::min(charge, kFullWell) * gain * per_electron;
                row[size_t(x)] = uint16_t(std::clamp(std::floor(value + 0.5), 0.0, 1023.0));
            }
            exposure_histogram_row(&histogram, row.data(), kSize, y);
        }
        return exposure_histogram_end(&histogram);
    }
};

struct Run {
    exposure_verdict verdict = EXPOSURE_GOING;
    unsigned steps = 0;
    int turns = 0;       // changes of direction of the light collected
    bool again = false;  // a setting was measured twice
    exposure_setting setting{};
    exposure_bound bound = EXPOSURE_BY_MEAN;
    double seen = 0;
};

Run search(Camera &camera, const exposure_limits &limits, const exposure_target &target,
           const exposure_setting &start, bool trace = false) {
    exposure_search search;
    std::vector<exposure_setting> settings(1);
    exposure_search_begin(&search, &limits, &target, &start, &settings[0]);
    Run run;
    int direction = 0;
    while (run.verdict == EXPOSURE_GOING) {
        const exposure_setting now = settings.back();
        const exposure_measure measure = camera.measure(now);
        exposure_setting next{};
        run.verdict = exposure_search_next(&search, &measure, camera.real_us(now), &next);
        if (trace) {
            std::printf("  %u us gain %u iris %d: mean %.4f high %.3f saturated %.4f excess %.1f\n",
                        now.exposure_us, now.gain_q3, now.iris, measure.mean, measure.high,
                        measure.saturated, measure.excess);
        }
        if (run.verdict != EXPOSURE_GOING) {
            run.setting = next;
            break;
        }
        const double change =
            camera.collected(next) * next.gain_q3 - camera.collected(now) * now.gain_q3;
        const int sign = change > 0 ? 1 : -1;
        run.turns += direction != 0 && sign != direction;
        direction = sign;
        for (const exposure_setting &old : settings) {
            run.again = run.again || (old.exposure_us == next.exposure_us &&
                                      old.gain_q3 == next.gain_q3 && old.iris == next.iris);
        }
        settings.push_back(next);
    }
    run.steps = search.steps;
    run.bound = search.bound;
    run.seen = search.measure.mean;
    return run;
}

template <typename T>
T quantile(std::vector<T> values, double part) {
    std::sort(values.begin(), values.end());
    return values[std::min(values.size() - 1, size_t(part * double(values.size())))];
}

size_t draws(size_t usual) {
    const char *text = std::getenv("VERGENCE_DRAWS");
    return text != nullptr ? std::strtoul(text, nullptr, 0) : usual;
}

}  // namespace

TEST_CASE("from any start over six decades the light is right within 3 % after a few steps") {
    const uint64_t seed = synthetic::test_seed();
    Random random(seed);
    std::vector<Scene> scenes;
    for (int i = 0; i < 300; i++) {
        scenes.push_back(random_scene(random, i % 6));
    }
    const size_t count = draws(size_t(synthetic::rounds(20000, 2000)));
    const exposure_target target = {0.5, 0};
    const char *trace = std::getenv("VERGENCE_TRACE");
    Camera camera;
    std::vector<unsigned> steps;
    std::vector<double> errors, below;
    size_t coarse = 0, oscillating = 0, unsteady = 0, off = 0, wrong = 0, saturated = 0,
           limited = 0;
    for (size_t i = 0; i < count; i++) {
        camera.random.seed(seed + i);
        camera.scene = &scenes[random() % scenes.size()];
        camera.iris_range = log_uniform(random, 40, 160);
        camera.iris_bow = uniform(random, -0.4, 0.4);
        camera.exact_rows = random() % 2 == 0;
        // Exposure x gain that a mean of a half needs with the iris open: 1 us to 1 s.
        const double needed_us = log_uniform(random, 1, 1e6);
        camera.electrons_per_us = kFullWell / 2 / camera.scene->mean_green / needed_us;
        const exposure_setting start = {uint32_t(log_uniform(random, 46, 240000)),
                                        uint16_t(log_uniform(random, 8, 65)),
                                        int32_t(uniform(random, 300, 850))};
        const bool traced = trace != nullptr && std::strtoul(trace, nullptr, 0) == i;
        const Run run = search(camera, kLimits, target, start, traced);
        INFO("case " << i);
        // What is best, without noise: in exposure x gain at the final iris.
        const double per_us = camera.electrons_per_us * camera.transmission(run.setting.iris);
        const double by_mean_us = kFullWell * target.mean / camera.scene->mean_green / per_us;
        const double by_high_us = kFullWell * 0.985 / camera.scene->edge / per_us;
        const double real_us = run.setting.exposure_us * run.setting.gain_q3 / 8.0;
        const double best_us = std::min(by_mean_us, by_high_us);
        steps.push_back(run.steps);
        oscillating += run.again;
        unsteady += run.verdict == EXPOSURE_UNSTEADY;
        if (run.verdict != EXPOSURE_FOUND) {
            limited += run.verdict != EXPOSURE_UNSTEADY;
            wrong += run.verdict == EXPOSURE_TOO_DARK &&
                     (best_us < 1.9e6 || run.setting.iris != kLimits.iris_open);
            wrong += run.verdict == EXPOSURE_TOO_BRIGHT &&
                     (best_us > 52 || run.setting.iris != kLimits.iris_closed);
            continue;
        }
        if (run.bound == EXPOSURE_BY_HIGHLIGHTS) {
            saturated += real_us > by_high_us * 1.02;
            below.push_back(1 - real_us / best_us);
            continue;
        }
        exposure_setting nearest = run.setting;
        exposure_setting_for(&kLimits, by_mean_us, &nearest);
        const double nearest_us = nearest.exposure_us * nearest.gain_q3 / 8.0;
        if (std::abs(nearest_us / by_mean_us - 1) > 0.01) {
            coarse++;
            continue;
        }
        errors.push_back(std::abs(real_us / by_mean_us - 1));
        off += errors.back() > 0.03;
    }
    // Rows of the table of tools/campaign focus.
    std::printf("| %zu searches: measurements, p50 / p99 / max | %u / %u / %u | 3 / - / 8 |\n",
                count, quantile(steps, 0.5), quantile(steps, 0.99), quantile(steps, 1.0));
    std::printf("| a setting measured twice | %zu | 0 |\n", oscillating);
    std::printf("| wrong verdicts, and `unsteady` in steady light | %zu | 0 |\n", wrong + unsteady);
    std::printf(
        "| off by, of %zu that end by their mean, p50 / p99 / max | %.2f / %.2f / %.2f %% | "
        "- / - / 3 %% |\n",
        errors.size(), 100 * quantile(errors, 0.5), 100 * quantile(errors, 0.99),
        100 * quantile(errors, 1.0));
    std::printf(
        "| below the brightest possible, of %zu that end by their highlights, p50 / p99 | "
        "%.1f / %.1f %% | |\n",
        below.size(), 100 * quantile(below, 0.5), 100 * quantile(below, 0.99));
    std::printf("| ends at coarse steps; at a limit; saturated | %zu; %zu; %zu | |\n", coarse,
                limited, saturated);
    CHECK(quantile(steps, 0.5) <= 3);
    CHECK(quantile(steps, 1.0) <= 8);
    CHECK(oscillating == 0);
    CHECK(unsteady == 0);
    CHECK(off == 0);
    CHECK(wrong == 0);
    CHECK(saturated * 200 <= count);
    CHECK(quantile(below, 0.5) < 0.06);
}

TEST_CASE("exposures are multiples of half the mains period where they are long enough") {
    for (const uint32_t half_us : {10000u, 8333u}) {
        exposure_limits limits = kLimits;
        limits.mains_half_us = half_us;
        for (double product_us = 46.4; product_us < 1.9e6; product_us *= 1.013) {
            exposure_setting setting = {0, 0, 700};
            exposure_setting_for(&limits, product_us, &setting);
            INFO(product_us << " us: " << setting.exposure_us << " us, gain " << setting.gain_q3);
            CHECK(setting.iris == 700);
            const double real_us = setting.exposure_us * setting.gain_q3 / 8.0;
            // A row is 53 us.
            CHECK(real_us / product_us ==
                  doctest::Approx(1).epsilon(product_us > 2700 ? 0.0101 : 0.08));
            if (product_us < half_us * 0.95) {
                CHECK(setting.gain_q3 <= 16);
                continue;
            }
            const double periods = double(setting.exposure_us) / half_us;
            CHECK(std::abs(periods / std::round(periods) - 1) < 0.08);
            CHECK(setting.gain_q3 / 8.0 < std::max(2.01, product_us / 200000));
        }
    }
}

namespace {

// A uniform scene that needs this exposure x gain with the iris open.
struct Bench {
    Scene scene;
    Camera camera;
    explicit Bench(double needed_us, int kind = 1) {
        Random random(7);
        scene = random_scene(random, kind);
        camera.scene = &scene;
        camera.electrons_per_us = kFullWell / 2 / scene.mean_green / needed_us;
    }
};

constexpr exposure_target kHalf = {0.5, 0};
constexpr exposure_setting kStart = {10003, 8, 700};

}  // namespace

TEST_CASE("a cap on the lens is too dark, the sun too bright, with and without an iris motor") {
    for (const bool motor : {true, false}) {
        exposure_limits limits = kLimits;
        limits.iris_open = motor ? limits.iris_open : limits.iris_closed;
        Bench cap(1e12), sun(1e-4);
        const Run dark = search(cap.camera, limits, kHalf, kStart);
        CHECK(dark.verdict == EXPOSURE_TOO_DARK);
        CHECK(dark.setting.exposure_us > limits.max_us * 0.99);
        CHECK(dark.setting.gain_q3 == limits.gain_max_q3);
        CHECK(dark.setting.iris == limits.iris_open);
        const Run bright = search(sun.camera, limits, kHalf, kStart);
        CHECK(bright.verdict == EXPOSURE_TOO_BRIGHT);
        CHECK(bright.setting.exposure_us == limits.min_us);
        CHECK(bright.setting.gain_q3 == limits.gain_min_q3);
        CHECK(bright.setting.iris == limits.iris_closed);
    }
}

TEST_CASE("a second camera gets the gain of the first where its exposure can be as fine") {
    for (double product_us = 46; product_us < 1.9e6; product_us *= 1.07) {
        for (const double ratio : {0.8, 0.95, 1.03, 1.2}) {
            exposure_setting like = {0, 0, 700}, setting = {0, 0, 0};
            exposure_setting_for(&kLimits, product_us, &like);
            const double wanted_us =
                std::clamp(like.exposure_us * like.gain_q3 / 8.0 * ratio, 46.5, 1.9e6);
            exposure_setting_like(&kLimits, wanted_us, &like, &setting);
            INFO(wanted_us << " us: " << setting.exposure_us << " us, gain " << setting.gain_q3);
            CHECK(setting.iris == like.iris);
            const double real_us = setting.exposure_us * setting.gain_q3 / 8.0;
            const double step = like.exposure_us < 2000 ? 0.08 : 0.01;
            CHECK(std::abs(real_us / wanted_us - 1) <= step);
            CHECK((like.exposure_us < 8000 || setting.gain_q3 == like.gain_q3 ||
                   setting.exposure_us > 200000));
        }
    }
}

TEST_CASE("the iris stays as it is when exposure and gain suffice") {
    for (const double needed_us : {100.0, 5e3, 5e4, 5e5}) {
        Bench bench(needed_us);
        const Run run = search(bench.camera, kLimits, kHalf, kStart);
        CHECK(run.verdict == EXPOSURE_FOUND);
        CHECK(run.setting.iris == kStart.iris);
    }
}

TEST_CASE("the whites of a board stay at or below their limit") {
    for (const double needed_us : {500.0, 5e3, 5e4, 5e5}) {
        Bench bench(needed_us, 2);
        const Run run = search(bench.camera, kLimits, {0.6, 0.8}, kStart);
        REQUIRE(run.verdict == EXPOSURE_FOUND);
        CHECK(run.bound == EXPOSURE_BY_WHITES);
        const exposure_measure measure = bench.camera.measure(run.setting);
        CHECK(measure.white < 0.82);
        CHECK(measure.white > 0.76);
    }
}

TEST_CASE("a search in changing light ends") {
    Random random(synthetic::test_seed());
    int unsteady = 0;
    for (int i = 0; i < 1000; i++) {
        exposure_search search;
        exposure_setting setting;
        exposure_search_begin(&search, &kLimits, &kHalf, &kStart, &setting);
        exposure_verdict verdict = EXPOSURE_GOING;
        while (verdict == EXPOSURE_GOING) {
            const double mean = uniform(random, 0, 1);
            const exposure_measure measure = {mean, mean > 0.9 ? 0.1 : 0, mean, mean, 4};
            verdict = exposure_search_next(&search, &measure, setting.exposure_us, &setting);
        }
        CHECK(search.steps <= EXPOSURE_STEPS_MAX);
        unsteady += verdict == EXPOSURE_UNSTEADY;
    }
    CHECK(unsteady > 100);
}

TEST_CASE("a camera whose response is not linear is learned") {
    exposure_limits limits = kLimits;
    limits.linear = false;
    for (const double light : {1e-6, 1e-5, 1e-4, 1e-3}) {
        exposure_search search;
        exposure_setting setting;
        exposure_search_begin(&search, &limits, &kHalf, &kStart, &setting);
        exposure_verdict verdict = EXPOSURE_GOING;
        double mean = 0;
        while (verdict == EXPOSURE_GOING) {
            const double part = light * setting.exposure_us * setting.gain_q3 / 8;
            mean = std::pow(std::min(part, 1.0), 0.45);
            const bool full = part >= 1;
            const exposure_measure measure = {mean, full ? 1.0 : 0, mean, mean, full ? 256.0 : 1};
            verdict = exposure_search_next(&search, &measure, setting.exposure_us, &setting);
        }
        CHECK(verdict == EXPOSURE_FOUND);
        CHECK(mean == doctest::Approx(0.5).epsilon(0.03));
    }
}

TEST_CASE("a camera whose gain has a scale of its own") {
    const exposure_limits limits = {100000, 0, 100, 50000, 10000, 8, 1024, 0, 0, 0, false};
    for (double needed_us = 300; needed_us < 200000; needed_us *= 1.11) {
        exposure_search search;
        exposure_setting setting;
        const exposure_setting start = {1000, 8, 0};
        exposure_search_begin(&search, &limits, &kHalf, &start, &setting);
        exposure_verdict verdict = EXPOSURE_GOING;
        double mean = 0;
        while (verdict == EXPOSURE_GOING) {
            // 128 is 8 times as bright as 1, in steps of 1/2, and the picture has a gamma.
            const auto gain_q3 = uint16_t((setting.gain_q3 + 3) / 4 * 4);
            setting.exposure_us = setting.exposure_us * setting.gain_q3 / gain_q3;
            exposure_search_adapt_gain(&search, gain_q3);
            exposure_search_adapt(&search, setting.exposure_us, false);
            const double gain = 1 + 7 * (gain_q3 / 8.0 - 1) / 127;
            mean = std::min(1.0, 0.5 * std::sqrt(setting.exposure_us * gain / needed_us));
            const bool full = mean >= 1;
            const exposure_measure measure = {mean, full ? 1.0 : 0, mean, mean, full ? 256.0 : 1};
            verdict = exposure_search_next(&search, &measure, setting.exposure_us, &setting);
        }
        INFO(needed_us << " us: " << setting.exposure_us << " us, gain " << setting.gain_q3
                       << ", mean " << search.measure.mean << " after " << search.steps);
        CHECK(verdict == EXPOSURE_FOUND);
        // Exposures are known, gains are tried.
        const bool by_exposure = needed_us < limits.max_us;
        CHECK(search.measure.mean == doctest::Approx(0.5).epsilon(by_exposure ? 0.03 : 0.2));
        CHECK((setting.gain_q3 == 8 || !by_exposure));
    }
}
