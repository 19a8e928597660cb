// SPDX-License-Identifier: Apache-2.0
// The whole path from two raw images of verged, distorted cameras to a surface in millimetres,
// against the scene itself: every point is compared with where its own ray meets the truth.
#include "rig/reconstruct.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <memory>

#include "core/error.h"
#include "synthetic/matched.hpp"
#include "synthetic/scenes.hpp"
#include "synthetic/seed.hpp"
#include "synthetic/threads.hpp"

using namespace synthetic;

namespace {

constexpr int kWidth = 320;
constexpr int kHeight = 240;
constexpr int kBits = 10;
constexpr double kFocalPx = 500;
constexpr double kBaselineMm = 100;

// Two lenses that differ, four degrees of vergence, a little of every other rotation.
struct Setup {
    Rig rig;
    calibration calib;
    Scene scene;
    std::vector<uint16_t> left, right;
};

Camera lens_of(double focal_px, double cx_off, double cy_off, double k1) {
    Camera camera;
    camera.width = kWidth;
    camera.height = kHeight;
    camera.fx = focal_px;
    camera.fy = focal_px * 1.003;
    camera.cx = (kWidth - 1) / 2.0 + cx_off;
    camera.cy = (kHeight - 1) / 2.0 + cy_off;
    camera.k1 = k1;
    camera.k2 = 0.07;
    camera.p1 = 0.0008;
    camera.p2 = -0.0005;
    return camera;
}

// A slanted wall, a ball and a block before it, all between 0.8 m and 1.2 m.
Scene verged_scene(uint64_t seed) {
    const Rig guide = rectified_rig(kWidth, kHeight, kFocalPx, kBaselineMm);
    Builder builder(guide, seed);
    const auto noise = [&](double disparity) { return builder.noise(disparity, 3, 0.15); };
    Scene scene;
    scene.surfaces.push_back(builder.plane(44, 0.012, -0.02, noise(44)));
    scene.surfaces.push_back(builder.sphere(58, 205, 95, 50, noise(58)));
    scene.surfaces.push_back(builder.piece(61, 70, 120, 80, 70, noise(61)));
    return scene;
}

Setup make_setup(uint64_t seed, double noise_grey = 1) {
    const Vector rotation{0.006, -0.07, -0.008};
    const Vector centre{kBaselineMm, 1.5, -2};
    const Vector translation = -1.0 * (rotation_from_vector(rotation) * centre);
    Setup setup;
    setup.rig = posed_rig(lens_of(kFocalPx, 4, -3, -0.16), lens_of(kFocalPx * 1.01, -5, 2, -0.14),
                          rotation, translation);
    setup.calib = calibration_of(setup.rig, rotation, translation);
    setup.calib.depth_near_mm = 750;
    setup.calib.depth_far_mm = 1400;
    setup.scene = verged_scene(seed);
    Sensor sensor;
    sensor.bits = kBits;
    sensor.noise_grey = noise_grey;
    setup.left = render_view(setup.scene, setup.rig.left, sensor, 3, seed);
    sensor.gain = 1.06;
    setup.right = render_view(setup.scene, setup.rig.right, sensor, 3, seed + 1);
    return setup;
}

// A run with all that keeps it alive.
struct Run {
    std::unique_ptr<Memory> memory;
    reconstruct_result result{};
    int status = -99;
    size_t need_bytes = 0, peak_bytes = 0;
};

struct RunSetting {
    reconstruct_options options = reconstruct_default_options();
    reconstruct_environment environment{};
    pixel_layout layout = PIXEL_GREY;
    size_t memory_bytes = 0;
};

Run run(const Setup &setup, const RunSetting &setting = {}) {
    Run run;
    rectify_plan plan;
    run.status = rectify_plan_make(&setup.calib, &setting.options.rectify, &plan);
    if (run.status != ERROR_OK) {
        return run;
    }
    const parallel *workers = setting.environment.parallel;
    run.need_bytes = reconstruct_need_bytes(kWidth, kHeight, &plan, &setting.options,
                                            workers != nullptr ? workers->threads : 1);
    const int channels = setting.layout == PIXEL_RGB ? 3 : 1;
    std::vector<uint16_t> raw[2];
    reconstruct_image image[2];
    for (int side = 0; side < 2; side++) {
        for (const uint16_t value : side == 0 ? setup.left : setup.right) {
            raw[side].insert(raw[side].end(), static_cast<size_t>(channels), value);
        }
        image[side] = {raw[side].data(), kWidth, kHeight, kWidth * channels, kBits, setting.layout};
    }
    run.memory =
        std::make_unique<Memory>(setting.memory_bytes > 0 ? setting.memory_bytes : run.need_bytes);
    arena arena;
    arena_init(&arena, run.memory->data(), run.memory->size());
    run.status = reconstruct_run(&image[0], &image[1], &setup.calib, &plan, &setting.options,
                                 &setting.environment, &arena, &run.result);
    run.peak_bytes = arena.peak_bytes;
    return run;
}

Vector position(const triangulate_point &point) {
    return {point.x_um / 1000.0, point.y_um / 1000.0, point.z_um / 1000.0};
}

// Where the ray of a point meets the scene: its surface, and the error along the ray.
struct Truth {
    int surface;
    double error_mm;  // beyond the surface: positive
    bool near_edge;   // another surface within four pixels
};

Truth truth_of_point(const Setup &setup, const Vector &point) {
    const auto hit = setup.scene.cast({0, 0, 0}, point);
    if (!hit) {
        return {-1, 0, true};
    }
    Truth truth{hit->surface, (1 - hit->t) * norm(point), false};
    const double step = 4 / kFocalPx * point.z;
    for (const Vector &aside :
         {Vector{step, 0, 0}, Vector{-step, 0, 0}, Vector{0, step, 0}, Vector{0, -step, 0},
          Vector{step, step, 0}, Vector{-step, -step, 0}}) {
        const auto beside = setup.scene.cast({0, 0, 0}, point + aside);
        truth.near_edge = truth.near_edge || !beside || beside->surface != hit->surface;
    }
    return truth;
}

double quantile(std::vector<double> values, double share) {
    std::sort(values.begin(), values.end());
    return values[static_cast<size_t>(share * static_cast<double>(values.size() - 1))];
}

bool same_surface(const Run &a, const Run &b) {
    const reconstruct_result &p = a.result;
    const reconstruct_result &q = b.result;
    return a.status == b.status && p.vertex_count == q.vertex_count &&
           p.triangle_count == q.triangle_count &&
           std::equal(&p.points[0].x_um, &p.points[p.vertex_count].x_um, &q.points[0].x_um) &&
           std::equal(p.vertex_pixel, p.vertex_pixel + p.vertex_count, q.vertex_pixel) &&
           std::equal(&p.triangles[0][0], &p.triangles[p.triangle_count][0], &q.triangles[0][0]) &&
           std::equal(&p.normals_q14[0][0], &p.normals_q14[p.vertex_count][0],
                      &q.normals_q14[0][0]);
}

}  // namespace

TEST_CASE("the points of a verged, distorted pair lie on the scene, within their sigma") {
    const uint64_t seed = test_seed();
    INFO("VERGENCE_SEED=", seed);
    const Setup setup = make_setup(seed);
    const Run done = run(setup);
    REQUIRE(done.status == ERROR_OK);
    CHECK(done.peak_bytes <= done.need_bytes);
    CHECK(done.result.arena_peak_bytes <= done.need_bytes);
    const reconstruct_result &result = done.result;
    const double pixels = static_cast<double>(result.plan.width_px) * result.plan.height_px;
    CHECK(result.vertex_count > 0.6 * pixels);

    std::vector<double> errors_mm, misses_mm;
    double squares = 0;
    int inner = 0, beyond = 0, gross = 0;
    std::vector<int> on_surface(setup.scene.surfaces.size());
    for (uint32_t i = 0; i < result.vertex_count; i++) {
        const Vector point = position(result.points[i]);
        const Truth truth = truth_of_point(setup, point);
        if (truth.near_edge) {
            continue;
        }
        inner++;
        on_surface[static_cast<size_t>(truth.surface)]++;
        // One pixel of disparity is z^2 / (f B) of depth, 20 mm at 1 m.
        const double pixel_mm = point.z * point.z / (kFocalPx * kBaselineMm);
        if (std::abs(truth.error_mm) > pixel_mm) {
            gross++;
            continue;
        }
        const double z = truth.error_mm / (result.points[i].sigma_um / 1000.0);
        errors_mm.push_back(truth.error_mm);
        misses_mm.push_back(result.points[i].miss_um / 1000.0);
        squares += z * z;
        beyond += std::abs(z) > 3;
    }
    const double count = static_cast<double>(errors_mm.size());
    std::vector<double> sizes_mm = errors_mm;
    for (double &size : sizes_mm) {
        size = std::abs(size);
    }
    CAPTURE(inner);
    CAPTURE(gross);
    CAPTURE(quantile(errors_mm, 0.5));
    CAPTURE(quantile(sizes_mm, 0.68));
    CAPTURE(quantile(misses_mm, 0.5));
    CAPTURE(std::sqrt(squares / count));
    CHECK(gross < 0.01 * inner);
    for (const int seen : on_surface) {
        CHECK(seen > 1000);
    }
    // A tenth of a pixel; the median tells of a wrong frame or scale, a hundredth of a pixel.
    CHECK(quantile(sizes_mm, 0.68) < 2);
    CHECK(std::abs(quantile(errors_mm, 0.5)) < 0.4);
    // The rays miss each other by what the vertical residue leaves: hundredths of a pixel of 2 mm.
    CHECK(quantile(misses_mm, 0.5) < 0.1);
    CHECK(std::sqrt(squares / count) > 0.7);
    CHECK(std::sqrt(squares / count) < 1.35);
    CHECK(beyond < 0.03 * count);
    CHECK(std::abs(result.vertical.offset_px) < 0.05);
    CHECK(result.vertical.samples > 200);
}

TEST_CASE("no triangle bridges a step") {
    const uint64_t seed = test_seed();
    INFO("VERGENCE_SEED=", seed);
    const Setup setup = make_setup(seed);
    const Run done = run(setup);
    REQUIRE(done.status == ERROR_OK);
    const reconstruct_result &result = done.result;
    REQUIRE(result.triangle_count > result.vertex_count);
    int bridges = 0, wrong_index = 0;
    double widest_px = 0;
    for (uint32_t t = 0; t < result.triangle_count; t++) {
        double least = 1e9, most = 0;
        int surface_of_least = -1, surface_of_most = -1;
        bool edge = false;
        for (const uint32_t vertex : result.triangles[t]) {
            if (vertex >= result.vertex_count) {
                wrong_index++;
                continue;
            }
            const Vector point = position(result.points[vertex]);
            const Truth truth = truth_of_point(setup, point);
            edge = edge || truth.near_edge;
            if (point.z < least) {
                least = point.z;
                surface_of_least = truth.surface;
            }
            if (point.z > most) {
                most = point.z;
                surface_of_most = truth.surface;
            }
        }
        // What the span in depth is in pixels of disparity: steps of the scene have ten and more.
        const double span_px = kFocalPx * kBaselineMm * (1 / least - 1 / most);
        widest_px = std::max(widest_px, span_px);
        bridges += span_px > 3 || (surface_of_least != surface_of_most && !edge);
    }
    CAPTURE(widest_px);
    CHECK(wrong_index == 0);
    CHECK(bridges == 0);
}

TEST_CASE("normals have unit length, look at the camera and follow the surfaces") {
    const uint64_t seed = test_seed();
    INFO("VERGENCE_SEED=", seed);
    const Setup setup = make_setup(seed, 0.5);
    const Run done = run(setup);
    REQUIRE(done.status == ERROR_OK);
    const Vector wall = setup.scene.surfaces[0].normal;
    Vector mean;
    int wrong = 0;
    double ball_cosine = 0;
    int ball_points = 0;
    for (uint32_t i = 0; i < done.result.vertex_count; i++) {
        const int16_t *q14 = done.result.normals_q14[i];
        const Vector normal{q14[0] / 16384.0, q14[1] / 16384.0, q14[2] / 16384.0};
        const Vector point = position(done.result.points[i]);
        wrong += std::abs(norm(normal) - 1) > 0.001;
        const Truth truth = truth_of_point(setup, point);
        if (truth.near_edge) {
            continue;
        }
        if (truth.surface == 0) {
            mean = mean + normal;
        }
        if (truth.surface == 1) {
            const Vector out = point - setup.scene.surfaces[1].centre;
            ball_cosine += dot(out, normal) / norm(out);
            ball_points++;
        }
    }
    CHECK(wrong == 0);
    // The plane is normal . p = 1: its normal points away from the camera.
    CHECK(-dot(mean, wall) / (norm(mean) * norm(wall)) > std::cos(0.03));
    // One cell is 2 mm wide and its depth known to about as much, so single normals tumble.
    CHECK(ball_cosine / ball_points > 0.5);
}

TEST_CASE("counts add up") {
    const Setup setup = make_setup(5);
    const Run done = run(setup);
    REQUIRE(done.status == ERROR_OK);
    const reconstruct_result &result = done.result;
    const size_t pixels =
        static_cast<size_t>(result.plan.width_px) * static_cast<size_t>(result.plan.height_px);
    size_t sum = 0;
    std::vector<uint32_t> counted(REASON_COUNT);
    for (int reason = 0; reason < REASON_COUNT; reason++) {
        sum += result.reason_count[reason];
    }
    for (size_t i = 0; i < pixels; i++) {
        counted[result.match.reason.data[i]]++;
    }
    CHECK(sum == pixels);
    CHECK(std::equal(counted.begin(), counted.end(), result.reason_count));
    CHECK(result.reason_count[REASON_VALID] == result.vertex_count);
    int wrong = 0;
    for (uint32_t i = 0; i < result.vertex_count; i++) {
        wrong += result.match.reason.data[result.vertex_pixel[i]] != REASON_VALID;
        wrong += i > 0 && result.vertex_pixel[i] <= result.vertex_pixel[i - 1];
    }
    CHECK(wrong == 0);
}

TEST_CASE("the surface is the same for any number of threads, and again") {
    const Setup setup = make_setup(6);
    const Run serial = run(setup);
    REQUIRE(serial.status == ERROR_OK);
    CHECK(same_surface(run(setup), serial));
    for (const int threads : {2, 3, 8}) {
        const Threads pool(threads, 7);
        RunSetting setting;
        setting.environment.parallel = pool.parallel();
        const Run done = run(setup, setting);
        CAPTURE(threads);
        CHECK(same_surface(done, serial));
        CHECK(done.peak_bytes <= done.need_bytes);
    }
}

TEST_CASE("colour and mosaic of a grey scene give the grey scene's surface") {
    const uint64_t seed = test_seed();
    INFO("VERGENCE_SEED=", seed);
    const Setup setup = make_setup(seed, 0.5);
    for (const pixel_layout layout : {PIXEL_RGB, PIXEL_BAYER_GRBG}) {
        RunSetting setting;
        setting.layout = layout;
        const Run done = run(setup, setting);
        REQUIRE(done.status == ERROR_OK);
        CHECK(done.peak_bytes <= done.need_bytes);
        std::vector<double> errors_mm;
        for (uint32_t i = 0; i < done.result.vertex_count; i++) {
            const Truth truth = truth_of_point(setup, position(done.result.points[i]));
            if (!truth.near_edge) {
                errors_mm.push_back(std::abs(truth.error_mm));
            }
        }
        CAPTURE(layout);
        REQUIRE(errors_mm.size() > 20000);
        CHECK(quantile(errors_mm, 0.5) < 2);
    }
}

TEST_CASE("without refinement and with keep_all there is a surface as well") {
    const Setup setup = make_setup(8);
    RunSetting setting;
    setting.options.refine = false;
    const Run coarse = run(setup, setting);
    CHECK(coarse.status == ERROR_OK);
    CHECK(coarse.result.vertex_count > 10000);
    CHECK(coarse.result.points[0].sigma_um > 0);
    setting.options.keep_all = true;
    const Run all = run(setup, setting);
    CHECK(all.status == ERROR_OK);
    CHECK(all.result.vertex_count > coarse.result.vertex_count);
}

TEST_CASE("smaller scale and a region give smaller results that still fit the scene") {
    const Setup setup = make_setup(9);
    RunSetting setting;
    const Run whole = run(setup);
    REQUIRE(whole.status == ERROR_OK);
    setting.options.rectify.scale = 0.5;
    const Run half = run(setup, setting);
    REQUIRE(half.status == ERROR_OK);
    CHECK(half.result.plan.width_px < 0.6 * whole.result.plan.width_px);
    setting.options.rectify.scale = 1;
    setting.options.rectify.region_x_px = whole.result.plan.width_px / 4;
    setting.options.rectify.region_y_px = whole.result.plan.height_px / 4;
    setting.options.rectify.region_width_px = whole.result.plan.width_px / 2;
    setting.options.rectify.region_height_px = whole.result.plan.height_px / 2;
    const Run part = run(setup, setting);
    REQUIRE(part.status == ERROR_OK);
    CHECK(part.result.plan.width_px == whole.result.plan.width_px / 2);
    for (const Run *one : {&half, &part}) {
        std::vector<double> errors_mm;
        for (uint32_t i = 0; i < one->result.vertex_count; i++) {
            const Truth truth = truth_of_point(setup, position(one->result.points[i]));
            if (!truth.near_edge) {
                errors_mm.push_back(std::abs(truth.error_mm));
            }
        }
        REQUIRE(errors_mm.size() > 3000);
        CHECK(quantile(errors_mm, 0.5) < 4);
    }
}

TEST_CASE("vertical misalignment that the calibration does not know is measured") {
    const uint64_t seed = test_seed();
    INFO("VERGENCE_SEED=", seed);
    Setup setup = make_setup(seed);
    Rig bumped = setup.rig;
    bumped.right.vertical.offset_px = 0.7;
    Sensor sensor;
    sensor.bits = kBits;
    sensor.noise_grey = 1;
    setup.right = render_view(setup.scene, bumped.right, sensor, 3, seed + 1);
    const Run done = run(setup);
    REQUIRE(done.status == ERROR_OK);
    // The rectified image is about as fine as the raw one.
    CHECK(done.result.vertical.offset_px == doctest::Approx(0.7).epsilon(0.1));
    CHECK(done.result.vertical.median_px == doctest::Approx(0.7).epsilon(0.15));
}

TEST_CASE("no surface, cancelled, too little memory, sizes that differ") {
    const uint64_t seed = test_seed();
    INFO("VERGENCE_SEED=", seed);
    const Setup setup = make_setup(seed);

    Setup blank = setup;
    std::fill(blank.left.begin(), blank.left.end(), uint16_t{300});
    std::fill(blank.right.begin(), blank.right.end(), uint16_t{300});
    const Run empty = run(blank);
    CHECK(empty.status == ERROR_NO_SURFACE);
    CHECK(empty.result.vertex_count == 0);
    CHECK(empty.result.triangle_count == 0);

    struct Stop {
        int calls, limit;
    };
    const auto stop_after = [](void *self, reconstruct_stage, int, int) {
        auto *stop = static_cast<Stop *>(self);
        return ++stop->calls < stop->limit;
    };
    RunSetting setting;
    Stop count{0, 1000000};
    setting.environment.progress = stop_after;
    setting.environment.self = &count;
    CHECK(run(setup, setting).status == ERROR_OK);
    REQUIRE(count.calls > 10);
    for (int limit = 1; limit <= count.calls; limit += 3) {
        Stop stop{0, limit};
        setting.environment.self = &stop;
        CAPTURE(limit);
        CHECK(run(setup, setting).status == ERROR_CANCELLED);
        CHECK(stop.calls == limit);
    }

    const Run whole = run(setup);
    for (const double share : {0.001, 0.1, 0.5, 0.9, 0.99}) {
        RunSetting tight;
        tight.memory_bytes = static_cast<size_t>(share * static_cast<double>(whole.peak_bytes));
        CHECK(run(setup, tight).status == ERROR_MEMORY);
    }
}
