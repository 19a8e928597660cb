// SPDX-License-Identifier: Apache-2.0
#include "stereo/geometry/rectify.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <vector>

#include "core/error.h"
#include "lent_table.hpp"
#include "random_rig.hpp"
#include "stereo/match/match.h"
#include "synthetic/camera.hpp"
#include "synthetic/seed.hpp"

namespace {

using random_rig::plain_rig;
using random_rig::Random;
using random_rig::uniform;

const rectify_options as_it_is = {0, 0, 1.0, 0, 0, 0, 0, 0, 0, false};

using Table = lent_table;

const double *rotation(const rectify_plan &plan, rectify_side side) {
    return side == RECTIFY_LEFT ? plan.R_rect_left : plan.R_rect_right;
}

// Where a rectified pixel comes from, in double arithmetic.
bool exact_raw(const rectify_plan &plan, const calibration &rig, rectify_side side, double x,
               double y, double raw_px[2]) {
    const double cx_px = side == RECTIFY_LEFT ? plan.cx_left_px : plan.cx_right_px;
    const double ray_rect[3] = {(x - cx_px) / plan.f_px, (y - plan.cy_px) / plan.fy_px, 1};
    double ray[3];
    geometry_rotate_back(rotation(plan, side), ray_rect, ray);
    return lens_project(side == RECTIFY_LEFT ? &rig.left : &rig.right, ray, raw_px);
}

// Rectified pixel of a point of the left camera's frame.
void project_rect(const rectify_plan &plan, const double point_left_mm[3], double left_px[2],
                  double right_px[2]) {
    double p[3];
    geometry_rotate(plan.R_rect_left, point_left_mm, p);
    left_px[0] = plan.cx_left_px + plan.f_px * p[0] / p[2];
    right_px[0] = plan.cx_right_px + plan.f_px * (p[0] - plan.baseline_mm) / p[2];
    left_px[1] = right_px[1] = plan.cy_px + plan.fy_px * p[1] / p[2];
}

calibration rectified_rig() {
    calibration rig = plain_rig();
    rig.rectified = true;
    rig.right.cx_px = 350.75;
    return rig;
}

int make(const calibration &rig, const rectify_options &options, rectify_plan *plan) {
    return rectify_plan_make(&rig, &options, plan);
}

template <typename Pixel>
std::vector<Pixel> noise(Random &random, size_t count, int bits) {
    std::vector<Pixel> pixels(count);
    for (Pixel &pixel : pixels) {
        pixel = static_cast<Pixel>(random() >> (64 - bits));
    }
    return pixels;
}

}  // namespace

TEST_CASE("points lie on equal rows and at the promised disparity") {
    Random random(synthetic::test_seed());
    for (int i = 0; i < 200; i++) {
        const calibration rig = random_rig::make(random);
        rectify_plan plan;
        REQUIRE(make(rig, as_it_is, &plan) == ERROR_OK);
        double R_right_left[9], chained[9];
        geometry_rotation_from_vector(rig.rotation_right_left_rad, R_right_left);
        geometry_multiply(plan.R_rect_right, R_right_left, chained);
        for (int k = 0; k < 9; k++) {
            REQUIRE(std::fabs(chained[k] - plan.R_rect_left[k]) < 1e-14);
        }
        REQUIRE(plan.f_px == plan.fy_px);
        for (int k = 0; k < 50; k++) {
            const double pixel_px[2] = {uniform(random, 0, rig.left.width_px - 1),
                                        uniform(random, 0, rig.left.height_px - 1)};
            double point_mm[3], right_mm[3], left_px[2], right_px[2];
            REQUIRE(lens_ray(&rig.left, pixel_px, point_mm));
            const double depth_mm = uniform(random, rig.depth_near_mm, rig.depth_far_mm);
            for (double &c : point_mm) {
                c *= depth_mm;
            }
            geometry_rotate(R_right_left, point_mm, right_mm);
            for (int c = 0; c < 3; c++) {
                right_mm[c] += rig.translation_right_left_mm[c];
            }
            project_rect(plan, point_mm, left_px, right_px);
            // The working range, stated along the left axis, is searched.
            const double disparity_px = left_px[0] - right_px[0];
            REQUIRE(disparity_px >= plan.disparity_min);
            REQUIRE(disparity_px <= plan.disparity_min + plan.disparity_count - 1);
            // Both rectified pixels come from where the raw cameras see the point.
            double raw_px[2], seen_px[2];
            REQUIRE(exact_raw(plan, rig, RECTIFY_LEFT, left_px[0], left_px[1], raw_px));
            REQUIRE(std::hypot(raw_px[0] - pixel_px[0], raw_px[1] - pixel_px[1]) < 1e-6);
            REQUIRE(lens_project(&rig.right, right_mm, seen_px));
            REQUIRE(exact_raw(plan, rig, RECTIFY_RIGHT, right_px[0], right_px[1], raw_px));
            REQUIRE(std::hypot(raw_px[0] - seen_px[0], raw_px[1] - seen_px[1]) < 1e-6);
        }
    }
}

TEST_CASE("the shared field of view fills the image at the raw resolution") {
    Random random(synthetic::test_seed());
    double min_filled = 1;
    for (int i = 0; i < 100; i++) {
        const calibration rig = random_rig::make(random);
        rectify_plan plan;
        REQUIRE(make(rig, as_it_is, &plan) == ERROR_OK);
        const Table left(plan, rig, RECTIFY_LEFT), right(plan, rig, RECTIFY_RIGHT);
        // The shared view touches every side of the left window.
        std::vector<int32_t> x(static_cast<size_t>(plan.width_px)), y(x);
        int inside = 0, low = plan.width_px, high = -1, top = plan.height_px, bottom = -1;
        const auto shared = [&](int column, int row) {
            double raw_px[2];
            for (int d : {plan.disparity_min + 2, plan.disparity_min + plan.disparity_count / 2,
                          plan.disparity_min + plan.disparity_count - 3}) {
                if (exact_raw(plan, rig, RECTIFY_RIGHT, column - d, row, raw_px) &&
                    raw_px[0] >= 0 && raw_px[0] <= rig.right.width_px - 1 && raw_px[1] >= 0 &&
                    raw_px[1] <= rig.right.height_px - 1) {
                    return true;
                }
            }
            return false;
        };
        const int step_px = 2;
        for (int row = 0; row < plan.height_px; row += step_px) {
            rectify_row_coordinates(&left.table, row, x.data(), y.data());
            for (int column = 0; column < plan.width_px; column += step_px) {
                const double px = x[static_cast<size_t>(column)] / 65536.0;
                const double py = y[static_cast<size_t>(column)] / 65536.0;
                if (px < 0 || py < 0 || px > rig.left.width_px - 1 || py > rig.left.height_px - 1 ||
                    !shared(column, row)) {
                    continue;
                }
                inside += step_px * step_px;
                low = std::min(low, column);
                high = std::max(high, column);
                top = std::min(top, row);
                bottom = std::max(bottom, row);
            }
        }
        CAPTURE(i);
        const int margin_px = 12;  // tolerance for the tips of rolled images
        CHECK(low <= margin_px);
        CHECK(high >= plan.width_px - 1 - margin_px);
        CHECK(top <= margin_px);
        CHECK(bottom >= plan.height_px - 1 - margin_px);
        min_filled =
            std::min(min_filled, static_cast<double>(inside) / plan.width_px / plan.height_px);
        // A pixel at the centre has the size of a raw pixel (mean of both cameras, 5 %).
        const double cx = plan.width_px / 2, cy = plan.height_px / 2;
        double area = 0;
        for (rectify_side side : {RECTIFY_LEFT, RECTIFY_RIGHT}) {
            double a[2], b[2], c[2];
            exact_raw(plan, rig, side, cx, cy, a);
            exact_raw(plan, rig, side, cx + 1, cy, b);
            exact_raw(plan, rig, side, cx, cy + 1, c);
            area += 0.5 * std::fabs((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]));
        }
        CHECK(area == doctest::Approx(1).epsilon(0.05));
    }
    MESSAGE("least share of a window that both see: " << min_filled);
    CHECK(min_filled > 0.6);
}

namespace {

// Double-precision bilinear interpolation at the table's own coordinates.
template <typename Pixel>
double bilinear(const std::vector<Pixel> &raw, int width, int channels, int channel, int32_t x_q16,
                int32_t y_q16) {
    const double x = x_q16 / 65536.0, y = y_q16 / 65536.0;
    const double fx = x - std::floor(x), fy = y - std::floor(y);
    const auto at = [&](int dx, int dy) {
        const size_t column = static_cast<size_t>(std::floor(x)) + static_cast<size_t>(dx);
        const size_t row = static_cast<size_t>(std::floor(y)) + static_cast<size_t>(dy);
        return static_cast<double>(
            raw[(row * static_cast<size_t>(width) + column) * static_cast<size_t>(channels) +
                static_cast<size_t>(channel)]);
    };
    return (at(0, 0) * (1 - fx) + at(1, 0) * fx) * (1 - fy) +
           (at(0, 1) * (1 - fx) + at(1, 1) * fx) * fy;
}

// Longest run of columns whose four pixels are inside, column by column.
rectify_span slow_span(const rectify_table &table, int row, const std::vector<int32_t> &x,
                       const std::vector<int32_t> &y) {
    int best_begin = 0, best_end = 0, begin = 0;
    for (int column = 0; column <= table.width_px; column++) {
        const size_t i = static_cast<size_t>(column);
        const bool seen = table.view == nullptr ||
                          (column >= table.view[row].begin && column < table.view[row].end);
        const bool inside = column < table.width_px && seen && x[i] >= 0 && y[i] >= 0 &&
                            (x[i] >> 16) + 1 < table.raw_width_px &&
                            (y[i] >> 16) + 1 < table.raw_height_px;
        if (!inside) {
            if (column - begin > best_end - best_begin) {
                best_begin = begin;
                best_end = column;
            }
            begin = column + 1;
        }
    }
    return {static_cast<int16_t>(best_begin), static_cast<int16_t>(best_end)};
}

template <typename Pixel>
void check_row(const std::vector<Pixel> &raw, const rectify_table &table, int y_px, int channels,
               const std::vector<Pixel> &row, rectify_span span, const std::vector<int32_t> &x,
               const std::vector<int32_t> &y) {
    const rectify_span expected = slow_span(table, y_px, x, y);
    REQUIRE(span.begin == expected.begin);
    REQUIRE(span.end == expected.end);
    for (int column = 0; column < table.width_px; column++) {
        const size_t i = static_cast<size_t>(column);
        for (int channel = 0; channel < channels; channel++) {
            const double pixel =
                row[i * static_cast<size_t>(channels) + static_cast<size_t>(channel)];
            if (column < span.begin || column >= span.end) {
                REQUIRE(pixel == 0);
                continue;
            }
            const double truth = bilinear(raw, table.raw_width_px, channels, channel, x[i], y[i]);
            REQUIRE(std::fabs(pixel - truth) < 1.0);
        }
    }
}

}  // namespace

TEST_CASE("a row that leaves the image and comes back keeps its longest run") {
    // Columns 0..9 inside, 10..12 above the image, 13..39 inside: made by hand.
    rectify_table table = {};
    std::vector<int32_t> x_nodes, y_nodes;
    table.columns = 6;
    table.rows = 4;
    table.step_log2 = 4;
    table.width_px = 40;
    table.height_px = 1;
    table.raw_width_px = 100;
    table.raw_height_px = 50;
    const double heights[6] = {60, 8, -2.2, 8, 40, 90};
    for (int j = 0; j < 4; j++) {
        for (int i = 0; i < 6; i++) {
            x_nodes.push_back((16 * (i - 1) + 20) * 65536);
            y_nodes.push_back(static_cast<int32_t>(heights[i] * 65536));
        }
    }
    table.x_q16 = x_nodes.data();
    table.y_q16 = y_nodes.data();
    std::vector<uint8_t> raw(100 * 50, 200), row(40);
    std::vector<int32_t> x(40), y(40);
    const image_u8 image = {raw.data(), 100, 50, 100};
    rectify_row_coordinates(&table, 0, x.data(), y.data());
    const rectify_span expected = slow_span(table, 0, x, y);
    const rectify_span span = rectified_row(table, image, {}, 0, row.data(), nullptr);
    CHECK(y[0] > 0);
    CHECK(y[16] < 0);
    CHECK(span.begin > 16);
    CHECK(span.begin == expected.begin);
    CHECK(span.end == expected.end);
    CHECK(row[0] == 0);
    CHECK(row[static_cast<size_t>(span.begin)] == 200);
}

TEST_CASE("a rectified pair passes through pixel for pixel") {
    Random random(synthetic::test_seed());
    const calibration rig = rectified_rig();
    auto raw = noise<uint8_t>(random, 640 * 480, 8), rgb = noise<uint8_t>(random, 3 * 640 * 480, 8);
    rectify_options region = as_it_is;
    region.region_x_px = 100;
    region.region_y_px = 50;
    region.region_width_px = 300;
    region.region_height_px = 200;
    for (const rectify_options &options : {as_it_is, region}) {
        rectify_plan plan;
        REQUIRE(make(rig, options, &plan) == ERROR_OK);
        CHECK(plan.identity);
        CHECK(rectify_table_need_bytes(&plan) == 0);
        CHECK(plan.f_px == 600);
        CHECK(plan.baseline_mm == doctest::Approx(100));
        for (rectify_side side : {RECTIFY_LEFT, RECTIFY_RIGHT}) {
            const Table table(plan, rig, side);
            const bool is_left = side == RECTIFY_LEFT;
            const int dx = static_cast<int>(std::lround(
                is_left ? rig.left.cx_px - plan.cx_left_px : rig.right.cx_px - plan.cx_right_px));
            const int dy = static_cast<int>(std::lround(rig.left.cy_px - plan.cy_px));
            CHECK((is_left ? dx == options.region_x_px : dx >= 0));
            CHECK(dy == options.region_y_px);
            const size_t columns = static_cast<size_t>(plan.width_px);
            std::vector<uint8_t> row(columns), row_rgb(3 * columns);
            std::vector<int32_t> x(columns), y(columns);
            const image_u8 grey = {raw.data(), 640, 480, 640};
            const image_rgb8 colour = {rgb.data(), 640, 480, 3 * 640};
            for (int r = 0; r < plan.height_px; r++) {
                const rectify_span span =
                    rectified_row(table.table, grey, colour, r, row.data(), row_rgb.data());
                REQUIRE(span.begin == 0);
                REQUIRE(span.end == plan.width_px);
                const size_t from = static_cast<size_t>((r + dy) * 640 + dx);
                REQUIRE(std::memcmp(row.data(), &raw[from], columns) == 0);
                REQUIRE(std::memcmp(row_rgb.data(), &rgb[3 * from], 3 * columns) == 0);
                rectify_row_coordinates(&table.table, r, x.data(), y.data());
                REQUIRE(x[7] == (7 + dx) * 65536);
                REQUIRE(y[7] == (r + dy) * 65536);
            }
        }
    }
}

TEST_CASE("strips of a raw image give the bytes of the whole") {
    Random random(synthetic::test_seed());
    calibration turned = plain_rig();
    const double above_mm[3] = {0, 100, 0};
    random_rig::set_right_centre(&turned, above_mm);
    auto raw = noise<uint8_t>(random, 640 * 480, 8), rgb = noise<uint8_t>(random, 3 * 640 * 480, 8);
    for (const calibration &rig :
         {rectified_rig(), plain_rig(0.1), turned, random_rig::make(random, 640, 480),
          random_rig::make(random, 640, 480)}) {
        rectify_plan plan;
        REQUIRE(make(rig, as_it_is, &plan) == ERROR_OK);
        const Table table(plan, rig, RECTIFY_RIGHT);
        const size_t columns = static_cast<size_t>(plan.width_px);
        std::vector<int32_t> work(2 * columns);
        for (const int rows : {2, 37}) {
            for (int y = 0; y < plan.height_px; y += 7) {
                std::vector<uint8_t> whole(columns), whole_rgb(3 * columns);
                const image_u8 grey = {raw.data(), 640, 480, 640};
                const image_rgb8 colour = {rgb.data(), 640, 480, 3 * 640};
                const rectify_span span =
                    rectified_row(table.table, grey, colour, y, whole.data(), whole_rgb.data());
                const rectify_extent extent = rectify_row_extent(&table.table, y, work.data());
                REQUIRE(extent.span.begin == span.begin);
                REQUIRE(extent.span.end == span.end);
                std::vector<uint8_t> made(columns), made_rgb(3 * columns);
                for (int begin = 0; begin < 479; begin += rows - 1) {
                    const int end = std::min(begin + rows, 480);
                    const auto at = static_cast<size_t>(begin) * 640;
                    const rectify_strip strip = {begin,
                                                 end,
                                                 {&raw[at], 640, end - begin, 640},
                                                 {&rgb[3 * at], 640, end - begin, 3 * 640}};
                    rectify_row_strip(&table.table, &strip, &extent, y, made.data(),
                                      made_rgb.data(), work.data());
                }
                REQUIRE(made == whole);
                REQUIRE(made_rgb == whole_rgb);
            }
        }
    }
}

TEST_CASE("half the scale of a rectified pair averages four pixels") {
    calibration rig = rectified_rig();
    rectify_options options = as_it_is;
    options.scale = 0.5;
    rectify_plan plan;
    REQUIRE(make(rig, options, &plan) == ERROR_OK);
    CHECK_FALSE(plan.identity);
    CHECK(plan.width_px == 320);
    CHECK(plan.height_px == 240);
    CHECK(plan.f_px == 300);
    CHECK(plan.cx_left_px == doctest::Approx((319.5 + 0.5) * 0.5 - 0.5));
    const Table table(plan, rig, RECTIFY_LEFT);
    std::vector<int32_t> x(320), y(320);
    for (int row : {0, 1, 100, 239}) {
        rectify_row_coordinates(&table.table, row, x.data(), y.data());
        for (int column = 0; column < 320; column++) {
            REQUIRE(x[static_cast<size_t>(column)] == column * 131072 + 32768);
            REQUIRE(y[static_cast<size_t>(column)] == row * 131072 + 32768);
        }
    }
}

namespace {

// Two lenses of 160 degrees, turned a little against each other.
struct wide_pair {
    synthetic::Rig rig;
    calibration value;
};

wide_pair make_wide_pair(bool equidistant) {
    synthetic::Camera left;
    left.width = 640, left.height = 480;
    left.fx = 229, left.fy = 230, left.cx = 322, left.cy = 238;
    left.equidistant = equidistant;
    if (equidistant) {
        left.k1 = -0.02, left.k2 = 0.004, left.k3 = -0.002, left.k4 = 0.0003;
    } else {
        left.k1 = 0.6, left.k2 = 0.02, left.k3 = 0.0002;
        left.k4 = 0.95, left.k5 = 0.1, left.k6 = 0.001;
    }
    synthetic::Camera right = left;
    right.fx = right.fy = 231;
    right.cx = 318;
    const synthetic::Vector rotation_rad{0.01, 0.03, -0.02}, translation_mm{-100, 1, 2};
    const synthetic::Rig rig = synthetic::posed_rig(left, right, rotation_rad, translation_mm);
    return {rig, synthetic::calibration_of(rig, rotation_rad, translation_mm)};
}

}  // namespace

TEST_CASE("the rectified pair of wide lenses is that of pinholes, of 110 degrees at most") {
    Random random(synthetic::test_seed());
    for (const bool equidistant : {true, false}) {
        wide_pair wide = make_wide_pair(equidistant);
        wide.value.depth_near_mm = 300;
        wide.value.depth_far_mm = 30000;
        rectify_plan plan;
        REQUIRE(make(wide.value, as_it_is, &plan) == ERROR_OK);
        const double half_deg = 180 / std::acos(-1) * std::atan(0.5 * plan.width_px / plan.f_px);
        CHECK(half_deg > 50);
        CHECK(half_deg < 55.2);
        CHECK(plan.f_px == doctest::Approx(230).epsilon(0.05));
        const Table tables[2] = {Table(plan, wide.value, RECTIFY_LEFT),
                                 Table(plan, wide.value, RECTIFY_RIGHT)};
        std::vector<int32_t> x_q16(size_t(plan.width_px)), y_q16(x_q16);
        const synthetic::Camera *cameras[2] = {&wide.rig.left, &wide.rig.right};
        int seen = 0;
        double max_px = 0;
        for (int i = 0; i < 2000; i++) {
            const double depth_mm = uniform(random, 300, 5000);
            const double x = uniform(random, -1.3, 1.3), y = uniform(random, -1.3, 1.3);
            const double point_mm[3] = {depth_mm * x, depth_mm * y, depth_mm};
            double rect_px[2][2];
            project_rect(plan, point_mm, rect_px[0], rect_px[1]);
            REQUIRE(rect_px[0][1] == rect_px[1][1]);
            for (int side = 0; side < 2; side++) {
                const int row = int(std::lround(rect_px[side][1]));
                const int column = int(std::lround(rect_px[side][0]));
                if (row < 0 || column < 0 || row >= plan.height_px || column >= plan.width_px) {
                    continue;
                }
                // The world's point of exactly this rectified pixel.
                const double ray_rect[3] = {
                    (column - (side == 0 ? plan.cx_left_px : plan.cx_right_px)) / plan.f_px,
                    (row - plan.cy_px) / plan.fy_px, 1};
                double ray[3];
                geometry_rotate_back(rotation(plan, side == 0 ? RECTIFY_LEFT : RECTIFY_RIGHT),
                                     ray_rect, ray);
                synthetic::Camera own = *cameras[side];
                own.R_camera_world = {1, 0, 0, 0, 1, 0, 0, 0, 1};
                own.centre_mm = {};
                const auto truth = own.project({ray[0], ray[1], ray[2]});
                REQUIRE(truth.has_value());
                if (truth->x < 0 || truth->y < 0 || truth->x > 639 || truth->y > 479) {
                    continue;
                }
                rectify_row_coordinates(&tables[side].table, row, x_q16.data(), y_q16.data());
                max_px = std::fmax(max_px, std::hypot(x_q16[size_t(column)] / 65536.0 - truth->x,
                                                      y_q16[size_t(column)] / 65536.0 - truth->y));
                seen++;
            }
        }
        CHECK(seen > 2000);
        CHECK(max_px < 0.01);
    }
}
