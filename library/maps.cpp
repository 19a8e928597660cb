// SPDX-License-Identifier: Apache-2.0
/// The arrays of a result: maps of its pixels, and its surface.
#include <limits>

#include "daemon/surface/result/result_figures.h"
#include "library/result.hpp"

void vergence_result_size(const vergence_result *result, int *width_px, int *height_px) {
    *width_px = result->job.result.plan.width_px;
    *height_px = result->job.result.plan.height_px;
}

namespace {

const float nan_of_map = std::numeric_limits<float>::quiet_NaN();

size_t pixels_of(const vergence_result &result) {
    const rectify_plan &plan = result.job.result.plan;
    return static_cast<size_t>(plan.width_px) * static_cast<size_t>(plan.height_px);
}

void make_disparity(const vergence_result &result, std::vector<float> *map) {
    const match_output &match = result.job.result.match;
    map->clear();
    for (int y = 0; y < match.reason.height; y++) {
        const int32_t *disparity_q8 = image_i32_row(&match.disparity_q8, y);
        const uint8_t *reason = image_u8_row(&match.reason, y);
        for (int x = 0; x < match.reason.width; x++) {
            map->push_back(reason_has_disparity(reason[x])
                               ? static_cast<float>(disparity_q8[x]) / 256.0f
                               : nan_of_map);
        }
    }
}

/// A map of a value of the measured points.
template <class Value>
void make_of_points(const vergence_result &result, const Value &value, std::vector<float> *map) {
    const reconstruct_result &from = result.job.result;
    map->assign(pixels_of(result), nan_of_map);
    for (uint32_t i = 0; i < from.vertex_count; i++) {
        if (!surface_figures_is_filled(&from, from.vertex_pixel[i])) {
            (*map)[from.vertex_pixel[i]] = value(from.points[i]);
        }
    }
}

template <class Row>
void make_bytes(const vergence_result &result, size_t channels, const Row &row,
                std::vector<uint8_t> *map) {
    const rectify_plan &plan = result.job.result.plan;
    const size_t values = static_cast<size_t>(plan.width_px) * channels;
    map->clear();
    for (int y = 0; y < plan.height_px; y++) {
        const uint8_t *from = row(y);
        map->insert(map->end(), from, from + values);
    }
}

const void *floats_of(const vergence_result &result, vergence_map map) {
    const bool refined = result.job.options.refine;
    std::vector<float> &made = result.floats[map];
    if (made.empty() && map == VERGENCE_DISPARITY_PX) {
        make_disparity(result, &made);
    } else if (made.empty() && map == VERGENCE_DEPTH_MM) {
        make_of_points(
            result, [](const triangulate_point &p) { return static_cast<float>(p.z_um) / 1e3f; },
            &made);
    } else if (made.empty()) {
        make_of_points(
            result,
            [refined](const triangulate_point &p) {
                return refined ? static_cast<float>(p.sigma_um) / 1e3f : nan_of_map;
            },
            &made);
    }
    return made.data();
}

const void *bytes_of(const vergence_result &result, vergence_map map) {
    const reconstruct_result &from = result.job.result;
    std::vector<uint8_t> &made = result.bytes[map - VERGENCE_REASON];
    if (made.empty() && map == VERGENCE_REASON) {
        make_bytes(
            result, 1, [&](int y) { return image_u8_row(&from.match.reason, y); }, &made);
    } else if (made.empty()) {
        const image_rgb8 &image = map == VERGENCE_LEFT_RGB ? from.left_colour : from.right_colour;
        make_bytes(
            result, 3, [&](int y) { return image_rgb8_row(&image, y); }, &made);
    }
    return made.data();
}

}  // namespace

int vergence_result_map(const vergence_result *result, enum vergence_map map, const void **data,
                        vergence_error *error) {
    return library_guard(error, [&] {
        if (map < VERGENCE_DISPARITY_PX || map > VERGENCE_RIGHT_RGB) {
            return library_fail(error, ERROR_ARGUMENT, "unknown map");
        }
        if (!result->job.context.metric && (map == VERGENCE_DEPTH_MM || map == VERGENCE_SIGMA_MM)) {
            return library_fail(error, ERROR_UNSUPPORTED, library_no_lengths);
        }
        if (map == VERGENCE_RIGHT_RGB && result->job.compact != nullptr) {
            return library_fail(error, ERROR_UNSUPPORTED, "a surface.compact has no right picture");
        }
        const std::lock_guard<std::mutex> lock(result->making);
        *data = map <= VERGENCE_SIGMA_MM ? floats_of(*result, map) : bytes_of(*result, map);
        return static_cast<int>(ERROR_OK);
    });
}

const char *vergence_reason_text(int reason) {
    return reason >= 0 && reason < REASON_COUNT ? reason_text(reason) : nullptr;
}

int vergence_reason_has_disparity(int reason) {
    return reason >= 0 && reason < REASON_COUNT &&
                   reason_has_disparity(static_cast<uint8_t>(reason))
               ? 1
               : 0;
}

namespace {

void make_surface(const vergence_result &result) {
    const reconstruct_result &from = result.job.result;
    surface_arrays &made = result.surface;
    const auto width = static_cast<uint32_t>(from.plan.width_px);
    for (uint32_t i = 0; i < from.vertex_count; i++) {
        const triangulate_point &point = from.points[i];
        for (const int32_t value_um : {point.x_um, point.y_um, point.z_um}) {
            made.position_mm.push_back(static_cast<float>(value_um) / 1e3f);
        }
        made.sigma_mm.push_back(static_cast<float>(point.sigma_um) / 1e3f);
        const uint32_t pixel = from.vertex_pixel[i];
        const uint8_t *colour = image_rgb8_row(&from.left_colour, static_cast<int>(pixel / width)) +
                                3 * (pixel % width);
        for (int k = 0; k < 3; k++) {
            made.normal.push_back(static_cast<float>(from.normals_q14[i][k]) / 16384.0f);
            made.colour.push_back(colour[k]);
        }
    }
    made.made = true;
}

}  // namespace

int vergence_result_surface(const vergence_result *result, vergence_surface *surface,
                            vergence_error *error) {
    return library_guard(error, [&] {
        const std::lock_guard<std::mutex> lock(result->making);
        if (!result->surface.made) {
            result->surface = {};
            make_surface(*result);
        }
        const reconstruct_result &from = result->job.result;
        const surface_arrays &made = result->surface;
        *surface = {from.vertex_count,  from.triangle_count, made.position_mm.data(),
                    made.normal.data(), made.colour.data(),  made.sigma_mm.data(),
                    from.vertex_pixel,  from.triangles};
        return static_cast<int>(ERROR_OK);
    });
}
