// SPDX-License-Identifier: Apache-2.0
// Noise, flicker, rolling shutter, gain, saturation, colours: from the numbers of frames alone.
#include <doctest/doctest.h>

#include <cmath>

#include "tests/simrig/world_harness.hpp"

using namespace world_harness;

namespace {

world::Scene even_sheet(const std::string &colour) {
    return scene_of(even_light() + "materials:\n  - m: {kind: paper, contrast: 0, colours: [" +
                    colour +
                    "]}\nobjects:\n  - sheet: {name: s, material: m, position_mm: [0, 0, 0], "
                    "size_mm: [4000, 4000]}\n");
}

world::Rig noisy_rig() {
    world::Rig rig = world::load_rig(file("rigs/default.yaml"));
    rig.mains.modulation = 0;
    rig.camera[0].sensor.prnu = 0;
    rig.camera[0].sensor.row_noise_e = 0;
    return rig;
}

struct Point {
    double mean, variance;
};

// Mean and variance of green pixels from the difference of two frames.
Point transfer_point(const world::Scene &scene, const world::Rig &rig,
                     world::FrameRequest request) {
    request.window = {960, 704, 160, 160, 1, 1, 1, 1};
    request.frame = 0;
    const world::Frame a = world::render(scene, rig, world::Side::kLeft, request);
    request.frame = 1;
    const world::Frame b = world::render(scene, rig, world::Side::kLeft, request);
    double sum = 0;
    double square = 0;
    int n = 0;
    for (int y = 0; y < a.rows; y++) {
        for (int x = y % 2; x < a.columns; x += 2) {
            const auto i = static_cast<std::size_t>(y * a.columns + x);
            const double d = a.pixels[i] - b.pixels[i];
            sum += 0.5 * (a.pixels[i] + b.pixels[i]);
            square += d * d;
            n++;
        }
    }
    return {sum / n - rig.camera[0].sensor.black_level_dn, 0.5 * square / n};
}

double row_mean(const world::Frame &frame, int row) {
    double sum = 0;
    for (int x = row % 2; x < frame.columns; x += 2) {
        sum += frame.pixels[static_cast<std::size_t>(row * frame.columns + x)];
    }
    return sum / (frame.columns / 2);
}

}  // namespace

TEST_CASE("photon transfer: variance grows with the signal as electrons do") {
    const world::Scene scene = even_sheet("[0.8, 0.8, 0.8]");
    const world::Rig rig = noisy_rig();
    const world::Mechanics m = straight(rig, 400, 1800, 600);
    const double dn_per_e = (1023 - 42.0) / 8500;
    for (const double gain : {1.0, 4.0}) {
        double sx = 0;
        double sxx = 0;
        double sxy = 0;
        int n = 0;
        for (int i = 1; i <= 12; i++) {
            world::FrameRequest request = steady(m);
            request.seed = static_cast<std::uint64_t>(i);
            request.exposure_us = 3500.0 * i / gain;
            for (double &g : request.gains.analog) {
                g = gain;
            }
            const Point p = transfer_point(scene, rig, request);
            REQUIRE(p.mean < 900);
            // Rounding adds 1/12.
            const double v = p.variance - 1.0 / 12;
            CHECK(v ==
                  doctest::Approx(p.mean * dn_per_e * gain + 64 * dn_per_e * dn_per_e * gain * gain)
                      .epsilon(0.05));
            // Weighted: the variance's own error is in proportion to it.
            const double w = 1 / (v * v);
            sx += w * p.mean;
            sxx += w * p.mean * p.mean;
            sxy += w * p.mean * v;
            n++;
            if (i == 12) {
                double sw = 0;
                // Slope through the known read noise, which is measured in the dark below.
                sw = sxx;
                const double read = 64 * dn_per_e * dn_per_e * gain * gain;
                const double slope = (sxy - read * sx) / sw;
                MESSAGE("gain " << gain << ": slope " << slope << " DN, expected "
                                << dn_per_e * gain);
                CHECK(slope == doctest::Approx(dn_per_e * gain).epsilon(0.03));
            }
        }
    }
}

TEST_CASE("read noise and black level in the dark") {
    const world::Scene scene = even_sheet("[0.8, 0.8, 0.8]");
    const world::Rig rig = noisy_rig();
    world::FrameRequest request = steady(straight(rig, 400, 1800, 300));
    request.exposure_us = 0.001;
    // At gain 8 the rounding to integers is negligible.
    for (double &g : request.gains.analog) {
        g = 4;
    }
    const Point p = transfer_point(scene, rig, request);
    const double read_e = std::sqrt(p.variance - 1.0 / 12) / (981.0 / 8500 * 4);
    MESSAGE("read noise " << read_e << " e, black " << p.mean + 42);
    CHECK(read_e == doctest::Approx(8).epsilon(0.03));
    CHECK(p.mean == doctest::Approx(0).epsilon(0.1));
}

TEST_CASE("pixels differ in response, the same way in every frame") {
    const world::Scene scene = even_sheet("[0.8, 0.8, 0.8]");
    world::Rig rig = perfect_rig();
    rig.camera[0].sensor.prnu = 0.02;
    world::FrameRequest request = steady(straight(rig, 400, 1800, 600));
    request.window = {960, 704, 160, 160, 1, 1, 1, 1};
    request.exposure_us = 40000;
    const world::Frame a = world::render(scene, rig, world::Side::kLeft, request);
    request.frame = 9;
    const world::Frame b = world::render(scene, rig, world::Side::kLeft, request);
    CHECK(a.pixels == b.pixels);
    double sum = 0;
    double square = 0;
    int n = 0;
    for (int y = 0; y < a.rows; y++) {
        for (int x = y % 2; x < a.columns; x += 2) {
            const double v = a.pixels[static_cast<std::size_t>(y * a.columns + x)] - 42.0;
            sum += v;
            square += v * v;
            n++;
        }
    }
    const double mean = sum / n;
    CHECK(std::sqrt(square / n - mean * mean) / mean == doctest::Approx(0.02).epsilon(0.03));
}

TEST_CASE("signal follows exposure and saturates at 1023; digital gain multiplies numbers") {
    const world::Scene scene = even_sheet("[0.8, 0.8, 0.8]");
    const world::Rig rig = perfect_rig();
    world::FrameRequest request = steady(straight(rig, 400, 1800, 600));
    request.window = {1000, 760, 8, 8, 1, 1, 1, 1};
    const auto green = [&](double exposure_us, double analog, double digital) {
        request.exposure_us = exposure_us;
        for (int i = 0; i < 4; i++) {
            request.gains.analog[i] = analog;
            request.gains.digital[i] = digital;
        }
        return world::render(scene, rig, world::Side::kLeft, request).pixels[0];
    };
    const double one = green(8000, 1, 1) - 42.0;
    CHECK(green(16000, 1, 1) - 42.0 == doctest::Approx(2 * one).epsilon(0.01));
    CHECK(green(8000, 3, 1) - 42.0 == doctest::Approx(3 * one).epsilon(0.01));
    CHECK(green(8000, 1, 2) - 42.0 == doctest::Approx(2 * one).epsilon(0.01));
    CHECK(green(8e6, 1, 1) == 1023);
    // Illuminance of the sensor by the f-number: pi T L / (4 N^2), L = 0.8 * 300.
    const double n = world::camera_at(rig.camera[0], request.mechanics(0)).optics.f_number;
    const double lux = world::kPi * 0.88 * 0.8 * 300 / (4 * n * n);
    CHECK(one == doctest::Approx(lux * 17000 * 0.008 * 981 / 8500).epsilon(0.01));
}

TEST_CASE("colours follow GRBG, in windows and when skipping and binning") {
    const world::Scene scene = even_sheet("[0.9, 0.3, 0.6]");
    const world::Rig rig = perfect_rig();
    world::FrameRequest request = steady(straight(rig, 400, 1800, 600));
    request.exposure_us = 16000;
    for (const world::Window &w : {world::Window{1000, 760, 16, 16, 1, 1, 1, 1},
                                   world::Window{1002, 762, 64, 64, 2, 3, 2, 2},
                                   world::Window{900, 700, 64, 64, 4, 2, 1, 2}}) {
        request.window = w;
        const world::Frame f = world::render(scene, rig, world::Side::kLeft, request);
        CHECK(f.columns == w.columns / (2 * w.skip_x) * 2);
        const auto at = [&](int x, int y) {
            return f.pixels[static_cast<std::size_t>(y * f.columns + x)] - 42.0;
        };
        const double green = at(0, 0);
        CHECK(at(1, 1) == doctest::Approx(green).epsilon(0.01));
        CHECK(at(1, 0) / green == doctest::Approx(0.9 * 0.62 / 0.3).epsilon(0.01));
        CHECK(at(0, 1) / green == doctest::Approx(0.6 * 0.55 / 0.3).epsilon(0.01));
    }
}

TEST_CASE("binning averages noise away") {
    const world::Scene scene = even_sheet("[0.8, 0.8, 0.8]");
    const world::Rig rig = noisy_rig();
    world::FrameRequest request = steady(straight(rig, 400, 1800, 600));
    request.exposure_us = 30000;
    const auto variance = [&](int bin) {
        request.window = {960, 704, 200, 200, 2, 2, bin, bin};
        request.frame = 0;
        const world::Frame a = world::render(scene, rig, world::Side::kLeft, request);
        request.frame = 1;
        const world::Frame b = world::render(scene, rig, world::Side::kLeft, request);
        double square = 0;
        int n = 0;
        for (std::size_t i = 0; i < a.pixels.size(); i++) {
            const double d = a.pixels[i] - b.pixels[i];
            square += 0.5 * d * d;
            n++;
        }
        return square / n - 1.0 / 12;
    };
    CHECK(variance(1) / variance(2) == doctest::Approx(4).epsilon(0.06));
}

TEST_CASE("flicker: rows are as bright as the light during their own exposure") {
    const world::Scene scene = even_sheet("[0.8, 0.8, 0.8]");
    world::Rig rig = perfect_rig();
    world::FrameRequest request = steady(straight(rig, 400, 1800, 600));
    request.window = {1000, 400, 64, 600, 1, 1, 1, 1};
    request.start_time_us = 123456;
    for (const double exposure : {700.0, 4000.0, 10000.0, 12345.0}) {
        request.exposure_us = exposure;
        for (double &g : request.gains.analog) {
            g = 20000 / exposure;
        }
        rig.mains = {100, 0.4, 0.7};
        const world::Frame lit = world::render(scene, rig, world::Side::kLeft, request);
        rig.mains.modulation = 0;
        const world::Frame even = world::render(scene, rig, world::Side::kLeft, request);
        for (int row = 0; row < lit.rows; row += 37) {
            double sum = 0;
            constexpr int kSteps = 2000;
            for (int i = 0; i < kSteps; i++) {
                const double t = (request.start_time_us + row * request.row_time_us +
                                  exposure * (i + 0.5) / kSteps) *
                                 1e-6;
                sum += 1 - 0.4 * std::cos(2 * world::kPi * 100 * t + 0.7);
            }
            const double ratio = (row_mean(lit, row) - 42) / (row_mean(even, row) - 42);
            CHECK(ratio == doctest::Approx(sum / kSteps).epsilon(0.006));
        }
    }
}

TEST_CASE("rolling shutter: each row sees the camera at its own time") {
    // The left half is bright, the right half dark; the camera turns from one to the other.
    const world::Scene scene = scene_of(
        even_light() +
        "materials:\n  - b: {kind: paper, contrast: 0, colours: [[0.8, 0.8, 0.8]]}\n"
        "  - d: {kind: paper, contrast: 0, colours: [[0.1, 0.1, 0.1]]}\nobjects:\n"
        "  - sheet: {name: l, material: b, position_mm: [-2000, 0, 0], size_mm: [4000, 4000]}\n"
        "  - sheet: {name: r, material: d, position_mm: [2000, 0, 0], size_mm: [4000, 4000]}\n");
    const world::Rig rig = perfect_rig();
    world::Mechanics m = straight(rig, 400, 1800, 600);
    world::FrameRequest request = steady(m);
    request.window = {1008, 400, 32, 600, 1, 1, 1, 1};
    request.exposure_us = 2000;
    request.row_time_us = 53.3125;
    request.start_time_us = 5000;
    for (double &g : request.gains.analog) {
        g = 20;
    }
    const double jump_us = 5000 + 300 * 53.3125 + 1000;
    request.mechanics = [&](double t) {
        world::Mechanics now = m;
        now.pan_rad = t < jump_us ? -0.2 : 0.2;
        return now;
    };
    const world::Frame frame = world::render(scene, rig, world::Side::kLeft, request);
    const double bright = row_mean(frame, 0) - 42;
    const double dark = row_mean(frame, 599) - 42;
    CHECK(bright / dark == doctest::Approx(8).epsilon(0.05));
    for (int row = 0; row < 600; row++) {
        const double start = 5000 + row * 53.3125;
        const double part = std::clamp((jump_us - start) / 2000, 0.0, 1.0);
        const double expected = dark + part * (bright - dark);
        // Sixteen moments represent the exposure.
        CHECK(std::fabs(row_mean(frame, row) - 42 - expected) < 0.05 * bright);
    }
}
