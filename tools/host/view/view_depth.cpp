// SPDX-License-Identifier: Apache-2.0
#include "tools/host/view/view_depth.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstring>
#include <nlohmann/json.hpp>
#include <vector>

#include "console/pair/calibration_match.h"
#include "core/error.h"
#include "daemon/base/workers.h"
#include "stereo/reconstruct.h"
#include "tools/host/view/view_source.hpp"

namespace {

using nlohmann::json;

/// The matched size: half of 640 x 480 px, and a smaller part of larger pictures.
constexpr double width_wanted_px = 320;
constexpr double scale_min = 0.25, scale_max = 1;
constexpr int row_lines = 9, row_step_px = 8;

/// Columns of one rectified row in the raw picture, every few pixels: [x, y, x, y, ...].
json trace(const rectify_table &table, int y, std::vector<std::int32_t> *work) {
    const auto width = static_cast<std::size_t>(table.width_px);
    constexpr double one_q16 = 65536;
    json line = json::array();
    work->resize(4 * width);
    const rectify_extent extent = rectify_row_extent(&table, y, work->data() + 2 * width);
    rectify_row_coordinates(&table, y, work->data(), work->data() + width);
    for (int x = extent.span.begin; x < extent.span.end; x += row_step_px) {
        const auto at = static_cast<std::size_t>(x);
        line.push_back(std::round(10 * (*work)[at] / one_q16) / 10);
        line.push_back(std::round(10 * (*work)[width + at] / one_q16) / 10);
    }
    return line;
}

template <class Image>
void append(const Image &image, std::string *bytes) {
    const auto row_bytes = static_cast<std::size_t>(image.width) * sizeof *image.data;
    for (int y = 0; y < image.height; y++) {
        bytes->append(reinterpret_cast<const char *>(image.data + y * image.stride), row_bytes);
    }
}

// In 16 bits a pixel; 0 where there is none.
void append_sigma(const reconstruct_result &result, std::string *bytes) {
    std::vector<std::uint16_t> sigma_q8(
        static_cast<std::size_t>(result.plan.width_px * result.plan.height_px));
    for (std::size_t i = 0; result.sigma.data != nullptr && i < sigma_q8.size(); i++) {
        sigma_q8[i] = subpixel_sigma_q8(result.sigma.data[i]);
    }
    bytes->append(reinterpret_cast<const char *>(sigma_q8.data()), 2 * sigma_q8.size());
}

}  // namespace

struct view_depth_maker::state {
    workers *pool = workers_create(0);
    std::vector<std::uint16_t> half[2];
    std::vector<unsigned char> memory;
    std::string text;  ///< of the calibration below
    view_depth_request asked;
    calibration rig{};
    reconstruct_options options{};
    rectify_plan plan{};
    json rows;
    triangulate_vertical vertical{};  ///< as last measured, once a second
    std::chrono::steady_clock::time_point rows_at{};
    int error = ERROR_MISSING;

    void prepare(const view_picture &picture, const view_depth_request &now);
    void trace_rows();
    json describe(const reconstruct_result &result, double ms) const;
};

/// Curves in the left and the right raw picture that the calibration takes for the same row.
void view_depth_maker::state::trace_rows() {
    rows = json::array();
    std::vector<std::int32_t> work;
    std::vector<unsigned char> space(2 * rectify_table_need_bytes(&plan) + 4096);
    arena tables;
    rectify_table table[2];
    arena_init(&tables, space.data(), space.size());
    if (rectify_table_make(&plan, &rig, RECTIFY_LEFT, &tables, &table[0]) != ERROR_OK ||
        rectify_table_make(&plan, &rig, RECTIFY_RIGHT, &tables, &table[1]) != ERROR_OK) {
        return;
    }
    for (int i = 0; i < row_lines; i++) {
        const int y = (2 * i + 1) * plan.height_px / (2 * row_lines);
        rows.push_back({trace(table[0], y, &work), trace(table[1], y, &work)});
    }
}

/// Does once what depends on the calibration and the depths alone.
void view_depth_maker::state::prepare(const view_picture &picture, const view_depth_request &now) {
    options.refine = now.refined;
    if (text == picture.calibration && now.near_mm == asked.near_mm && now.far_mm == asked.far_mm) {
        return;
    }
    text = picture.calibration;
    asked = now;
    rows_at = {};
    options = reconstruct_default_options();
    options.rectify.depth_near_mm = now.near_mm;
    options.rectify.depth_far_mm = now.far_mm;
    options.rectify.scale =
        std::clamp(2 * width_wanted_px / picture.width_px, scale_min, scale_max);
    options.preset = MATCH_PRESET_FAST;
    options.recompute_surface = true;
    error = calibration_parse(text.data(), text.size(), &rig, nullptr);
    error = error == ERROR_OK ? rectify_plan_make(&rig, &options.rectify, &plan) : error;
    if (error == ERROR_OK) {
        trace_rows();
        options.refine = true;  // takes most memory
        raw_image raw{};
        raw.bits = 8;
        raw.layout = RAW_GREY;
        memory.resize(
            reconstruct_needs(&raw, &raw, &rig, &plan, &options, workers_parallel(pool)->threads)
                .bytes);
        options.refine = now.refined;
    }
}

json view_depth_maker::state::describe(const reconstruct_result &result, double ms) const {
    const auto pixels = static_cast<double>(plan.width_px) * plan.height_px;
    const double valid = result.reason_count[REASON_VALID];
    json reasons = json::array();
    for (int i = 0; i < REASON_COUNT; i++) {
        reasons.push_back({reason_text(i), result.reason_count[i] / pixels});
    }
    const double middle_mm = std::isfinite(plan.depth_far_mm)
                                 ? 2 / (1 / plan.depth_near_mm + 1 / plan.depth_far_mm)
                                 : 2 * plan.depth_near_mm;
    return {{"width", plan.width_px},
            {"height", plan.height_px},
            {"scale", options.rectify.scale},
            {"f", plan.f_px},
            {"baseline", plan.baseline_mm},
            {"offset", plan.cx_left_px - plan.cx_right_px},
            {"near", plan.depth_near_mm},
            {"far", std::isfinite(plan.depth_far_mm) ? json(plan.depth_far_mm) : json()},
            {"share", valid / pixels},
            {"reasons", reasons},
            {"common_sigma", calibration_match_sigma_mm(&rig, nullptr, nullptr, middle_mm)},
            {"common_at", middle_mm},
            {"refined", options.refine},
            {"vertical",
             {{"samples", vertical.samples},
              {"median", vertical.median_px},
              {"trend", vertical.trend_px},
              {"curve", vertical.curve_px}}},
            {"rows", rows},
            {"ms", ms}};
}

view_depth_maker::view_depth_maker() : state_(new state) {}

view_depth_maker::~view_depth_maker() {
    workers_destroy(state_->pool);
}

std::shared_ptr<view_depth> view_depth_maker::make(const view_picture &picture,
                                                   const view_depth_request &asked) {
    const auto begin = std::chrono::steady_clock::now();
    auto depth = std::make_shared<view_depth>();
    if (!picture.error.empty() || picture.calibration.empty()) {
        depth->error = !picture.error.empty() ? picture.error : picture.without;
        return depth;
    }
    state &self = *state_;
    if (self.pool == nullptr) {
        depth->error = "out of memory";
        return depth;
    }
    self.prepare(picture, asked);
    self.options.skip_rows = begin - self.rows_at < std::chrono::seconds(1);
    int error = self.error;
    reconstruct_result result{};
    raw_image raw[2];
    for (int side = 0; side < 2 && error == ERROR_OK; side++) {
        self.half[side].resize(static_cast<std::size_t>(picture.width_px / 2 * picture.height_px));
        view_picture_half(picture, side, self.half[side].data());
        raw[side] = {};
        raw[side].data = self.half[side].data();
        raw[side].width_px = picture.width_px / 2;
        raw[side].height_px = picture.height_px;
        raw[side].stride = raw[side].width_px;
        raw[side].bits = 8;
        raw[side].layout = RAW_GREY;
    }
    if (error == ERROR_OK) {
        reconstruct_environment environment{};
        environment.parallel = workers_parallel(self.pool);
        arena lent;
        arena_init(&lent, self.memory.data(), self.memory.size());
        error = reconstruct_run(&raw[0], &raw[1], &self.rig, &self.plan, &self.options,
                                &environment, &lent, &result);
    }
    if (error != ERROR_OK && error != ERROR_NO_SURFACE) {
        depth->error = std::string("no depth: ") + error_text(error);
        return depth;
    }
    if (!self.options.skip_rows) {
        self.vertical = result.vertical;
        self.rows_at = begin;
    }
    const std::chrono::duration<double, std::milli> took = std::chrono::steady_clock::now() - begin;
    json header = self.describe(result, std::round(10 * took.count()) / 10);
    header["picture"] = picture.number;
    depth->bytes = header.dump() + "\n";
    append(result.match.disparity_q8, &depth->bytes);
    append_sigma(result, &depth->bytes);
    append(result.match.reason, &depth->bytes);
    append(result.left, &depth->bytes);
    append(result.right, &depth->bytes);
    return depth;
}
