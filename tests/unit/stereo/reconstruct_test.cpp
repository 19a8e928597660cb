// SPDX-License-Identifier: Apache-2.0
// The whole path from two raw images of verged, distorted cameras to a surface in millimetres,
// compared with the scene itself: every point is compared with the intersection of its ray and the
// scene.
#include "stereo/reconstruct.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "core/error.h"
#include "daemon/surface/result/result_figures.h"
#include "stereo/surface.h"
#include "synthetic/scenes.hpp"
#include "synthetic/seed.hpp"
#include "synthetic/threads.hpp"
#include "synthetic/verged.hpp"

using namespace synthetic;

namespace {

Vector position(const triangulate_point &point) {
    return {point.x_um / 1000.0, point.y_um / 1000.0, point.z_um / 1000.0};
}

// Where the ray of a point meets the scene: its surface, and the error along the ray.
struct Truth {
    int surface;
    double error_mm;  // positive if the point is beyond the surface
    bool near_edge;   // another surface within four pixels
};

Truth truth_of_point(const Verged &setup, const Vector &point) {
    const auto hit = setup.scene.cast({0, 0, 0}, point);
    if (!hit) {
        return {-1, 0, true};
    }
    Truth truth{hit->surface, (1 - hit->t) * norm(point), false};
    const double step = 4 / kVergedFocalPx * point.z;
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

bool same_surface(const VergedRun &a, const VergedRun &b) {
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

bool same_maps(const reconstruct_result &p, const reconstruct_result &q) {
    const ptrdiff_t pixels = ptrdiff_t{q.plan.width_px} * q.plan.height_px;
    const match_output &m = p.match;
    const match_output &n = q.match;
    return p.vertex_count == q.vertex_count && p.repeating_count == q.repeating_count &&
           p.vertical.samples == q.vertical.samples &&
           std::equal(m.reason.data, m.reason.data + pixels, n.reason.data) &&
           std::equal(m.disparity_q8.data, m.disparity_q8.data + pixels, n.disparity_q8.data) &&
           std::equal(m.confidence.data, m.confidence.data + pixels, n.confidence.data) &&
           std::equal(p.sigma.data, p.sigma.data + pixels, q.sigma.data);
}

}  // namespace

TEST_CASE("the points of a verged, distorted pair lie on the scene, within their sigma") {
    const Verged setup = make_verged(test_seed());
    const VergedRun done = run_verged(setup);
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
        const double pixel_mm = point.z * point.z / (kVergedFocalPx * kVergedBaselineMm);
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
    // A tenth of a pixel; the median reveals a wrong frame or scale of a hundredth of a pixel.
    CHECK(quantile(sizes_mm, 0.68) < 2);
    CHECK(std::abs(quantile(errors_mm, 0.5)) < 0.4);
    // The rays miss each other by the vertical residual: hundredths of a pixel of 2 mm.
    CHECK(quantile(misses_mm, 0.5) < 0.1);
    CHECK(std::sqrt(squares / count) > 0.7);
    CHECK(std::sqrt(squares / count) < 1.35);
    CHECK(beyond < 0.03 * count);
    CHECK(std::abs(result.vertical.offset_px) < 0.05);
    CHECK(result.vertical.samples > 200);
}

TEST_CASE("no triangle bridges a step") {
    const Verged setup = make_verged(test_seed());
    const VergedRun done = run_verged(setup);
    REQUIRE(done.status == ERROR_OK);
    const reconstruct_result &result = done.result;
    REQUIRE(result.triangle_count > result.vertex_count);
    int bridges = 0, wrong_index = 0;
    double widest_px = 0;
    for (uint32_t t = 0; t < result.triangle_count; t++) {
        double min = 1e9, max = 0;
        int surface_of_min = -1, surface_of_max = -1;
        bool edge = false;
        for (const uint32_t vertex : result.triangles[t]) {
            if (vertex >= result.vertex_count) {
                wrong_index++;
                continue;
            }
            const Vector point = position(result.points[vertex]);
            const Truth truth = truth_of_point(setup, point);
            edge = edge || truth.near_edge;
            if (point.z < min) {
                min = point.z;
                surface_of_min = truth.surface;
            }
            if (point.z > max) {
                max = point.z;
                surface_of_max = truth.surface;
            }
        }
        // The depth range of a span in pixels of disparity: steps of the scene have ten and more.
        const double span_px = kVergedFocalPx * kVergedBaselineMm * (1 / min - 1 / max);
        widest_px = std::max(widest_px, span_px);
        bridges += span_px > 3 || (surface_of_min != surface_of_max && !edge);
    }
    CAPTURE(widest_px);
    CHECK(wrong_index == 0);
    CHECK(bridges == 0);
}

TEST_CASE("counts add up") {
    const Verged setup = make_verged(5);
    const VergedRun done = run_verged(setup);
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
    const Verged setup = make_verged(6);
    const VergedRun serial = run_verged(setup);
    REQUIRE(serial.status == ERROR_OK);
    CHECK(same_surface(run_verged(setup), serial));
    for (const int threads : {2, 3, 8}) {
        const Threads pool(threads, 7);
        VergedSetting setting;
        setting.environment.parallel = pool.parallel();
        const VergedRun done = run_verged(setup, setting);
        CAPTURE(threads);
        CHECK(same_surface(done, serial));
        CHECK(done.peak_bytes <= done.need_bytes);
    }
}

TEST_CASE("colour and mosaic of a grey scene give the grey scene's surface") {
    const Verged setup = make_verged(test_seed(), 0.5);
    for (const raw_layout layout : {RAW_RGB, RAW_BAYER_GRBG}) {
        VergedSetting setting;
        setting.layout = layout;
        const VergedRun done = run_verged(setup, setting);
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

TEST_CASE("smaller scale and a region give smaller results that still fit the scene") {
    const Verged setup = make_verged(9);
    VergedSetting setting;
    const VergedRun whole = run_verged(setup);
    REQUIRE(whole.status == ERROR_OK);
    setting.options.rectify.scale = 0.5;
    const VergedRun half = run_verged(setup, setting);
    REQUIRE(half.status == ERROR_OK);
    CHECK(half.result.plan.width_px < 0.6 * whole.result.plan.width_px);
    setting.options.rectify.scale = 1;
    setting.options.rectify.region_x_px = whole.result.plan.width_px / 4;
    setting.options.rectify.region_y_px = whole.result.plan.height_px / 4;
    setting.options.rectify.region_width_px = whole.result.plan.width_px / 2;
    setting.options.rectify.region_height_px = whole.result.plan.height_px / 2;
    const VergedRun part = run_verged(setup, setting);
    REQUIRE(part.status == ERROR_OK);
    CHECK(part.result.plan.width_px == whole.result.plan.width_px / 2);
    for (const VergedRun *one : {&half, &part}) {
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

TEST_CASE("a surface that is made again row by row is the one that is kept") {
    const Verged setup = make_verged(test_seed());
    VergedSetting setting;
    SUBCASE("of grey images") {}
    SUBCASE("of mosaics, which are compared in colour") {
        setting.layout = RAW_BAYER_GRBG;
    }
    SUBCASE("in half the rows") {
        setting.options.preset = MATCH_PRESET_FAST;
    }
    SUBCASE("for little memory") {
        setting.options.preset = MATCH_PRESET_BOARD;
        setting.layout = RAW_RGB;
    }
    SUBCASE("by the greedy path") {
        setting.options.preset = MATCH_PRESET_PAPER;
    }
    SUBCASE("of a region") {
        setting.options.rectify.region_x_px = 31;
        setting.options.rectify.region_y_px = 17;
        setting.options.rectify.region_width_px = 211;
        setting.options.rectify.region_height_px = 173;
    }
    const VergedRun kept = run_verged(setup, setting);
    setting.options.recompute_surface = true;
    setting.options.remake_pictures = true;
    for (const int threads : {2, 3, 8}) {
        const Threads pool(threads, 7);
        setting.environment.parallel = pool.parallel();
        const VergedRun shared = run_verged(setup, setting);
        CAPTURE(threads);
        REQUIRE(shared.status == ERROR_OK);
        CHECK(same_maps(shared.result, kept.result));
        CHECK(shared.peak_bytes <= shared.need_bytes);
        setting.environment.parallel = nullptr;
    }
    const VergedRun again = run_verged(setup, setting);
    REQUIRE(kept.status == ERROR_OK);
    REQUIRE(again.status == ERROR_OK);
    CHECK(again.peak_bytes < 0.52 * static_cast<double>(kept.peak_bytes));
    CHECK(again.peak_bytes <= again.need_bytes);
    CHECK(again.peak_bytes >= 0.98 * static_cast<double>(again.need_bytes));
    CHECK(again.result_bytes <= again.result_need_bytes);
    CHECK(again.result_bytes >= 0.98 * static_cast<double>(again.result_need_bytes));
    const reconstruct_result &result = again.result;
    CHECK(result.points == nullptr);
    CHECK(result.right_colour.data == nullptr);
    REQUIRE(result.left_colour.ring_rows > 0);
    for (const int y : {0, 100, 7, result.plan.height_px - 1}) {
        const uint8_t *row = image_rgb8_row(&kept.result.left_colour, y);
        CHECK(std::equal(row, row + 3 * result.plan.width_px, reconstruct_colour_row(&result, y)));
    }
    CHECK(std::equal(std::begin(result.reason_count), std::end(result.reason_count),
                     std::begin(kept.result.reason_count)));
    struct Collected {
        std::vector<triangulate_point> points;
        std::vector<uint32_t> pixels, corners;
        std::vector<int16_t> normals;
    } all;
    const auto collect = [](void *self, const surface_part *part) {
        auto &to = *static_cast<Collected *>(self);
        if (part->points != nullptr) {
            to.points.insert(to.points.end(), part->points, part->points + part->vertex_count);
            to.pixels.insert(to.pixels.end(), part->vertex_pixel,
                             part->vertex_pixel + part->vertex_count);
        }
        if (part->normals_q14 != nullptr) {
            const int16_t *first = part->normals_q14[0];
            to.normals.insert(to.normals.end(), first, first + 3 * size_t{part->vertex_count});
        }
        if (part->triangles != nullptr) {
            const uint32_t *first = part->triangles[0];
            to.corners.insert(to.corners.end(), first, first + 3 * size_t{part->triangle_count});
        }
    };
    surface_walk(&result, SURFACE_NORMALS, collect, &all);
    surface_walk(&result, SURFACE_TRIANGLES, collect, &all);
    VergedRun made;
    made.status = kept.status;
    made.result = kept.result;
    made.result.vertex_count = result.vertex_count;
    made.result.triangle_count = result.triangle_count;
    REQUIRE(all.points.size() == kept.result.vertex_count);
    REQUIRE(all.corners.size() == 3 * size_t{kept.result.triangle_count});
    made.result.points = all.points.data();
    made.result.vertex_pixel = all.pixels.data();
    made.result.normals_q14 = reinterpret_cast<int16_t(*)[3]>(all.normals.data());
    made.result.triangles = reinterpret_cast<uint32_t(*)[3]>(all.corners.data());
    CHECK(same_surface(kept, made));
    Collected points;
    surface_walk(&result, SURFACE_POINTS, collect, &points);
    CHECK(points.pixels == all.pixels);
    CHECK(points.normals.empty());
}

TEST_CASE("vertical misalignment that the calibration does not know is measured") {
    const uint64_t seed = test_seed();
    Verged setup = make_verged(seed);
    Rig bumped = setup.rig;
    bumped.right.vertical.offset_px = 0.7;
    Sensor sensor;
    sensor.bits = kVergedBits;
    sensor.noise_grey = 1;
    setup.right = render_view(setup.scene, bumped.right, sensor, 3, seed + 1);
    const VergedRun done = run_verged(setup);
    REQUIRE(done.status == ERROR_OK);
    // The rectified image has about the resolution of the raw one.
    CHECK(done.result.vertical.offset_px == doctest::Approx(0.7).epsilon(0.1));
    CHECK(done.result.vertical.median_px == doctest::Approx(0.7).epsilon(0.15));
}

TEST_CASE("a calibration that fits in the middle only is seen by the trend of its rows") {
    const Verged good = make_verged(test_seed());
    const VergedRun right = run_verged(good);
    REQUIRE(right.status == ERROR_OK);
    CHECK(right.result.vertical.trend_px < 0.1);
    CHECK(right.result.vertical.curve_px < 0.1);
    CHECK(result_figures_rows_fault(&right.result.vertical, &right.result.plan, 1) == nullptr);

    Verged zoomed = good;
    zoomed.calib.right.fx_px *= 1.006;  // the same error in pixels as 0.3 % at VGA
    zoomed.calib.right.fy_px *= 1.006;
    Verged straight = good;
    for (lens *lens : {&straight.calib.left, &straight.calib.right}) {
        lens->k1 = lens->k2 = lens->k3 = lens->p1 = lens->p2 = 0;
    }
    const struct {
        const Verged &setup;
        const char *word;
    } wrong[] = {{zoomed, "focal length"}, {straight, "distortion"}};
    for (const auto &one : wrong) {
        const VergedRun done = run_verged(one.setup);
        REQUIRE(done.status == ERROR_OK);
        const triangulate_vertical &vertical = done.result.vertical;
        CAPTURE(std::string(one.word));
        MESSAGE(std::string(one.word)
                << ": median " << vertical.median_px << ", p95 " << vertical.p95_px << " trend "
                << vertical.trend_px << " curve " << vertical.curve_px);
        CHECK(vertical.median_px < 0.5);
        const char *fault = result_figures_rows_fault(&vertical, &done.result.plan, 1);
        REQUIRE(fault != nullptr);
        CHECK(std::string(fault).find(one.word) != std::string::npos);
    }
}

TEST_CASE("no surface, cancelled, too little memory, sizes that differ") {
    const Verged setup = make_verged(test_seed());

    Verged blank = setup;
    std::fill(blank.left.begin(), blank.left.end(), uint16_t{300});
    std::fill(blank.right.begin(), blank.right.end(), uint16_t{300});
    const VergedRun empty = run_verged(blank);
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
    VergedSetting setting;
    Stop count{0, 1000000};
    setting.environment.progress = stop_after;
    setting.environment.self = &count;
    CHECK(run_verged(setup, setting).status == ERROR_OK);
    REQUIRE(count.calls > 10);
    for (int limit = 1; limit <= count.calls; limit += 3) {
        Stop stop{0, limit};
        setting.environment.self = &stop;
        CAPTURE(limit);
        CHECK(run_verged(setup, setting).status == ERROR_CANCELLED);
        CHECK(stop.calls == limit);
    }

    const VergedRun whole = run_verged(setup);
    for (const double share : {0.001, 0.1, 0.5, 0.9, 0.99}) {
        VergedSetting tight;
        tight.memory_bytes = static_cast<size_t>(share * static_cast<double>(whole.peak_bytes));
        CHECK(run_verged(setup, tight).status == ERROR_MEMORY);
    }
}
