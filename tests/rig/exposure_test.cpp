// SPDX-License-Identifier: Apache-2.0
// Autoexposure on the simulated rig: from dark and bright starts, at several levels of light, with
// both cameras equally bright on pairs afterwards; and failures, which leave everything as it was.
// VERGENCE_RUNS sets the number of levels.
#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <random>
#include <string>
#include <vector>

#include "bench/rig_bench.hpp"
#include "rig/auto/autoexposure.h"
#include "rig/pair_frame.h"
#include "synthetic/seed.hpp"

using rig_bench::RigBench;
using rig_bench::small_profile;

namespace {

constexpr unsigned kBoth = 1u << RIG_LEFT | 1u << RIG_RIGHT;
constexpr double kBlack = 42, kFull = 1023;
const std::array<std::string, 3> kMaterials = {
    "{kind: board, colours: [[0.8, 0.8, 0.8], [0.05, 0.05, 0.05]],"
    " board: {columns: 9, rows: 7, square_mm: 40}}",
    "{kind: wood, colours: [[0.40, 0.235, 0.125]], plank_mm: 118, gloss: 0.02, gloss_blur_deg: 14}",
    "{kind: plaster, colours: [[0.56, 0.50, 0.42]]}",
};

// The bench's board, or another sheet, in so many times its light.
std::string scene(double light, size_t material = 0) {
    const std::string lamp = std::to_string(600 * light), ambient = std::to_string(300 * light);
    return "room: {origin_mm: [125, 0, 1800], tilt_deg: 0}\n"
           "lights:\n"
           "  - {centre_mm: [-900, -900, -900], half_u_mm: [300, 0, 0], half_v_mm: [0, 300, 0],\n"
           "     luminance: [" +
           lamp + ", " + lamp + ", " + lamp +
           "]}\n"
           "ambient: [" +
           ambient + ", " + ambient + ", " + ambient +
           "]\n"
           "floor_ambient: [" +
           ambient + ", " + ambient + ", " + ambient +
           "]\n"
           "bounce_lux: 0\n"
           "materials:\n"
           "  - print: " +
           kMaterials[material] +
           "\n"
           "objects:\n"
           "  - sheet: {name: board, material: print, position_mm: [0, 0, 0],"
           " size_mm: [3600, 2400]}\n";
}

struct Bench : RigBench {
    scratch folder;

    // Searches thin whole fields; only pairs are rendered at full size.
    explicit Bench(double light = 1, const rig_profile &profile = small_profile(2048, 1536))
        : RigBench(profile) {
        show(scene(light));
        REQUIRE_MESSAGE(rig_bringup(&rig) == ERROR_OK, rig.last_error.text);
    }
    void show(const std::string &text) { control("scene " + folder.write("scene.yaml", text)); }
    void set(uint32_t exposure_us, uint16_t gain_q3) {
        uint32_t applied_us = 0;
        uint16_t applied_q3 = 0;
        REQUIRE(rig_exposure(&rig, kBoth, exposure_us, &applied_us) == ERROR_OK);
        REQUIRE(rig_gain(&rig, kBoth, gain_q3, &applied_q3) == ERROR_OK);
    }
};

// Mean of green above black in the middle half of a frame, part of the range.
double middle(const pair_frame &frame) {
    const raw_image &image = frame.image;
    double sum = 0;
    int count = 0;
    for (int y = image.height_px / 4; y < image.height_px * 3 / 4; y++) {
        for (int x = image.width_px / 4; x < image.width_px * 3 / 4; x++) {
            if ((x + y) % 2 == 0) {
                sum += raw_image_row(&image, y)[x];
                count++;
            }
        }
    }
    return (sum / count - kBlack) / (kFull - kBlack);
}

double saturated(const pair_frame &frame) {
    const raw_image &image = frame.image;
    int count = 0;
    for (int y = 0; y < image.height_px; y++) {
        const uint16_t *row = raw_image_row(&image, y);
        count += int(std::count_if(row, row + image.width_px, [](int v) { return v >= 1008; }));
    }
    return double(count) / (image.width_px * image.height_px);
}

// How much brighter the right camera is on a pair.
double difference(Bench &bench) {
    ::pair pair{};
    REQUIRE_MESSAGE(bench.capture(pair) == ERROR_OK, bench.rig.last_error.text);
    for (const pair_frame &frame : pair.frame) {
        CHECK(saturated(frame) <= 0.002);
    }
    return middle(pair.frame[RIG_RIGHT]) / middle(pair.frame[RIG_LEFT]) - 1;
}

constexpr rig_autoexposure_request kRequest = {kBoth, {0, 0, 0, 0}, 0.5, false, false};

// What must be as before after a failure.
struct State {
    std::vector<uint32_t> values;
    explicit State(const ::rig &rig) {
        for (const rig_camera &camera : rig.camera) {
            const mt9t001_window &window = camera.sensor.window;
            values.insert(values.end(),
                          {camera.sensor.shutter_rows, camera.gain_q3, window.column_px,
                           window.row_px, window.width_px, window.height_px, window.skip});
        }
        values.insert(values.end(), {rig.format.width_px, rig.format.height_px});
    }
    bool operator==(const State &other) const { return values == other.values; }
};

}  // namespace

TEST_CASE("both cameras end equally bright, whatever the light and the start") {
    const char *runs_text = std::getenv("VERGENCE_RUNS");
    const int runs = runs_text != nullptr ? std::atoi(runs_text) : 3;
    const uint64_t seed = synthetic::test_seed();
    INFO("seed " << seed);
    std::mt19937_64 random(seed);
    std::uniform_real_distribution<double> part(0, 1);
    Bench bench;
    std::vector<double> differences, seconds;
    std::vector<unsigned> steps;
    for (int i = 0; i < runs; i++) {
        const double light = std::pow(10, -2 + 4 * part(random));
        bench.show(scene(light, size_t(i) % kMaterials.size()));
        const auto exposure_us = uint32_t(50 * std::pow(2e4, part(random)));
        bench.set(exposure_us, uint16_t(8 * std::pow(8, part(random))));
        rig_autoexposure_result result{};
        const uint64_t begin_us = bench.now_us();
        const int error = rig_autoexposure(&bench.rig, &kRequest, &result);
        INFO("light " << light << " exposure " << exposure_us << ": " << bench.rig.rejected.text
                      << bench.rig.last_error.text);
        REQUIRE(error == ERROR_OK);
        seconds.push_back(double(bench.now_us() - begin_us) * 1e-6);
        differences.push_back(std::abs(difference(bench)));
        for (unsigned side = 0; side < RIG_SIDES; side++) {
            const rig_autoexposure_side &found = result.side[side];
            steps.push_back(found.steps);
            CHECK(found.steps <= 8);
            CHECK(found.mean < 0.53);
            CHECK(bench.rig.camera[side].exposure_us ==
                  doctest::Approx(found.exposure_us).epsilon(0.001));
            CHECK(bench.rig.camera[side].gain_q3 == found.gain_q3);
            if (std::getenv("VERGENCE_TRACE") != nullptr) {
                std::printf(
                    "light %.4f from %u us: side %u %u us gain %u iris %d mean %.3f "
                    "saturated %.4f steps %u bound %d verdict %d; difference %.4f, on the pair "
                    "%.4f\n",
                    light, exposure_us, side, found.exposure_us, found.gain_q3, found.iris,
                    found.mean, found.saturated, found.steps, found.bound, found.verdict,
                    result.difference, differences.back());
            }
        }
        CHECK(differences.back() <= 0.02);
    }
    std::sort(differences.begin(), differences.end());
    std::sort(steps.begin(), steps.end());
    std::sort(seconds.begin(), seconds.end());
    // Rows of the table of tools/campaign focus.
    std::printf(
        "| %d levels of light on the simulated rig: measurements a camera, p50 / max | %u / %u | "
        "3 / 8 |\n",
        runs, steps[steps.size() / 2], steps.back());
    std::printf("| seconds for both cameras, p50 / max | %.1f / %.1f | |\n",
                seconds[seconds.size() / 2], seconds.back());
    std::printf(
        "| brightness difference of the cameras on pairs, p50 / max | %.2f / %.2f %% | - / 2 %% "
        "|\n",
        100 * differences[differences.size() / 2], 100 * differences.back());
}

// A sensor that sends its present frame first, and two more until a setting is in force, takes up
// to four exposures.
TEST_CASE("a long exposure begins at once, and the next frame has it") {
    Bench bench(0.005, small_profile(256, 192));
    double light = 0;
    // The first one chooses the camera.
    for (const uint32_t exposure_us : {10000U, 400000U, 1200000U, 200000U}) {
        CAPTURE(exposure_us);
        bench.set(exposure_us, 8);
        const uint64_t begin_us = bench.now_us();
        pair_frame frame{};
        REQUIRE_MESSAGE(pair_take_frame(&bench.rig, RIG_LEFT, begin_us, &frame) == ERROR_OK,
                        bench.rig.last_error.text);
        const double seen = middle(frame) / frame.exposure_us;
        raw_image_release(&frame.image);
        if (exposure_us < 100000) {
            continue;
        }
        CHECK(frame.begin_us - begin_us < exposure_us + exposure_us / 20);
        light = light == 0 ? seen : light;
        CHECK(seen == doctest::Approx(light).epsilon(0.05));
    }
}

TEST_CASE("the iris closes for light that is too strong, and opens for too little") {
    Bench bench(300);
    rig_autoexposure_result result{};
    REQUIRE_MESSAGE(rig_autoexposure(&bench.rig, &kRequest, &result) == ERROR_OK,
                    bench.rig.rejected.text);
    CHECK(result.side[RIG_LEFT].iris < 800);
    CHECK(std::abs(difference(bench)) <= 0.02);
    bench.show(scene(0.02));
    REQUIRE_MESSAGE(rig_autoexposure(&bench.rig, &kRequest, &result) == ERROR_OK,
                    bench.rig.rejected.text);
    CHECK(result.side[RIG_LEFT].mean > 0.2);
    CHECK(std::abs(difference(bench)) <= 0.02);
}

TEST_CASE("a region outside the window is measured, for one camera") {
    Bench bench;
    rig_autoexposure_request request = kRequest;
    request.sides = 1u << RIG_RIGHT;
    request.region_px = {900, 700, 200, 150};
    rig_autoexposure_result result{};
    const uint32_t left_us = bench.rig.camera[RIG_LEFT].exposure_us;
    REQUIRE_MESSAGE(rig_autoexposure(&bench.rig, &request, &result) == ERROR_OK,
                    bench.rig.rejected.text);
    CHECK(result.side[RIG_RIGHT].steps > 0);
    CHECK(result.side[RIG_LEFT].steps == 0);
    CHECK(bench.rig.camera[RIG_LEFT].exposure_us == left_us);
    request.region_px = {2000, 700, 200, 150};
    const State before(bench.rig);
    CHECK(rig_autoexposure(&bench.rig, &request, &result) == ERROR_RANGE);
    CHECK(std::string(bench.rig.rejected.text).find("region") != std::string::npos);
    CHECK(State(bench.rig) == before);
}

TEST_CASE("without light or with too much, everything stays as it was") {
    Bench bench(1e-5);
    bench.set(5000, 12);
    const State before(bench.rig);
    rig_autoexposure_request request = kRequest;
    for (const double light : {1e-5, 1000.0}) {
        bench.show(scene(light));
        request.keep_iris = light > 1;
        rig_autoexposure_result result{};
        CHECK(rig_autoexposure(&bench.rig, &request, &result) == ERROR_RANGE);
        const std::string text = bench.rig.rejected.text;
        CHECK(text.find(light < 1 ? "too dark" : "too bright") != std::string::npos);
        CHECK(State(bench.rig) == before);
        int32_t positions[LENS_AXES];
        REQUIRE(rig_lens_read(&bench.rig, RIG_LEFT, positions) == ERROR_OK);
        CHECK(std::abs(positions[LENS_IRIS] - 850) <= 6);
        CHECK(bench.rig.state == RIG_READY);
    }
}

TEST_CASE("a cancelled search leaves exposure, gain and window as they were") {
    Bench bench(0.01);
    bench.set(100, 12);
    const State before(bench.rig);
    for (const int calls : {3, 20, 60}) {
        int left = calls;
        bench.keep_going = [&left] { return left-- > 0; };
        rig_autoexposure_result result{};
        CHECK(rig_autoexposure(&bench.rig, &kRequest, &result) == ERROR_CANCELLED);
        bench.keep_going = [] { return true; };
        CHECK(State(bench.rig) == before);
        REQUIRE(bench.rig.state == RIG_READY);
    }
    rig_autoexposure_result result{};
    CHECK(rig_autoexposure(&bench.rig, &kRequest, &result) == ERROR_OK);
}
