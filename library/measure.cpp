// SPDX-License-Identifier: Apache-2.0
/// Lengths and shapes of a result, and its comparison with the truth.
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <cstring>

#include "daemon/surface/result/result_figures.h"
#include "library/result.hpp"
#include "tools/host/evaluate/evaluate.hpp"
#include "tools/host/fit/fit.hpp"

const char *const library_no_lengths =
    "the geometry is assumed: lengths mean nothing (reconstruct with a calibration, or with "
    "--focal "
    "and --baseline)";

namespace {

fit_point point_of(const reconstruct_result &from, uint32_t vertex) {
    const triangulate_point &at = from.points[vertex];
    const auto pixel = static_cast<int>(from.vertex_pixel[vertex]);
    fit_point point = {{at.x_um / 1e3, at.y_um / 1e3, at.z_um / 1e3},
                       at.sigma_um / 1e3,
                       {},
                       pixel % from.plan.width_px,
                       pixel / from.plan.width_px};
    for (int i = 0; i < 3; i++) {
        point.normal[i] = from.normals_q14[vertex][i] / 16384.0;
    }
    return point;
}

fit_common common_of(const vergence_result &result) {
    const reconstruct_context &context = result.job.context;
    return {context.depth_sigma_common_mm, context.has_spread ? context.spread.depth_mm[1] : 1};
}

vergence_value value_of(const fit_value &from) {
    return {from.value, from.sigma, from.sigma_common};
}

/// The point at a pixel. 0, or a code with the error set.
int point_at(const vergence_result &result, const double at_px[2], fit_point *point,
             vergence_error *error) {
    const reconstruct_result &from = result.job.result;
    const auto place = "pixel " + std::to_string(std::lround(at_px[0])) + "," +
                       std::to_string(std::lround(at_px[1]));
    if (!result.job.context.metric) {
        return library_fail(error, ERROR_UNSUPPORTED, library_no_lengths);
    }
    if (!(at_px[0] > -0.5 && at_px[0] < from.plan.width_px - 0.5 && at_px[1] > -0.5 &&
          at_px[1] < from.plan.height_px - 0.5)) {
        return library_fail(error, ERROR_RANGE,
                            place + ": outside of the maps, which have " +
                                std::to_string(from.plan.width_px) + " x " +
                                std::to_string(from.plan.height_px) + " px");
    }
    const auto pixel =
        static_cast<uint32_t>(std::lround(at_px[1]) * from.plan.width_px + std::lround(at_px[0]));
    const uint32_t *const begin = from.vertex_pixel, *const end = begin + from.vertex_count;
    const uint32_t *found = std::lower_bound(begin, end, pixel);
    if (found == end || *found != pixel || surface_figures_is_filled(&from, pixel)) {
        const auto reason = image_u8_row(
            &from.match.reason, static_cast<int>(std::lround(at_px[1])))[std::lround(at_px[0])];
        return library_fail(error, ERROR_MISSING,
                            place + ": not measured here (" + reason_text(reason) + ")");
    }
    *point = point_of(from, static_cast<uint32_t>(found - from.vertex_pixel));
    return ERROR_OK;
}

std::vector<fit_point> points_in(const vergence_result &result, const uint8_t *mask) {
    const reconstruct_result &from = result.job.result;
    std::vector<fit_point> points;
    for (uint32_t i = 0; i < from.vertex_count; i++) {
        const uint32_t pixel = from.vertex_pixel[i];
        if ((mask == nullptr || mask[pixel] != 0) && !surface_figures_is_filled(&from, pixel)) {
            points.push_back(point_of(from, i));
        }
    }
    return points;
}

template <class Found, class Fit>
int fit_in(const vergence_result *result, const uint8_t *mask, const Fit &fit, Found *found,
           vergence_error *error) {
    if (!result->job.context.metric) {
        return library_fail(error, ERROR_UNSUPPORTED, library_no_lengths);
    }
    std::string text;
    return fit(points_in(*result, mask), common_of(*result), found, &text)
               ? static_cast<int>(ERROR_OK)
               : library_fail(error, ERROR_MISSING, text);
}

vergence_score score_of(const evaluate_score &from) {
    vergence_score score{};
    score.pixels = from.pixels;
    std::copy_n(from.bad_percent, EVALUATE_THRESHOLDS, score.bad_percent);
    score.average_px = from.average_px;
    score.rms_px = from.rms_px;
    return score;
}

}  // namespace

int vergence_result_depth(const vergence_result *result, double x_px, double y_px,
                          vergence_value *depth_mm, vergence_error *error) {
    return library_guard(error, [&] {
        fit_point point;
        const double at_px[2] = {x_px, y_px};
        const int code = point_at(*result, at_px, &point, error);
        if (code == ERROR_OK) {
            *depth_mm = value_of(fit_depth(point, common_of(*result)));
        }
        return code;
    });
}

int vergence_result_distance(const vergence_result *result, const double from_px[2],
                             const double to_px[2], vergence_value *distance_mm,
                             vergence_error *error) {
    return library_guard(error, [&] {
        fit_point from, to;
        int code = point_at(*result, from_px, &from, error);
        code = code == ERROR_OK ? point_at(*result, to_px, &to, error) : code;
        if (code == ERROR_OK) {
            *distance_mm = value_of(fit_distance(from, to, common_of(*result)));
        }
        return code;
    });
}

int vergence_result_plane(const vergence_result *result, const uint8_t *mask, vergence_plane *plane,
                          vergence_error *error) {
    return library_guard(error, [&] {
        fit_plane_result found;
        const int code = fit_in(result, mask, fit_plane, &found, error);
        if (code == ERROR_OK) {
            *plane = {{},
                      {},
                      value_of(found.distance_mm),
                      value_of(found.tilt_deg),
                      found.normal_sigma_deg,
                      found.rms_mm,
                      found.points,
                      found.used};
            std::copy_n(found.normal.data(), 3, plane->normal);
            std::copy_n(found.centre_mm.data(), 3, plane->centre_mm);
        }
        return code;
    });
}

int vergence_result_cylinder(const vergence_result *result, const uint8_t *mask,
                             vergence_cylinder *cylinder, vergence_error *error) {
    return library_guard(error, [&] {
        fit_cylinder_result found;
        const int code = fit_in(result, mask, fit_cylinder, &found, error);
        if (code == ERROR_OK) {
            *cylinder = {{},
                         {},
                         value_of(found.radius_mm),
                         found.axis_sigma_deg,
                         found.length_mm,
                         found.rms_mm,
                         found.points,
                         found.used};
            std::copy_n(found.axis.data(), 3, cylinder->axis);
            std::copy_n(found.centre_mm.data(), 3, cylinder->centre_mm);
        }
        return code;
    });
}

int vergence_evaluate(const float *disparity_px, const float *truth_px, const uint8_t *mask,
                      int width_px, int height_px, vergence_evaluation *evaluation,
                      vergence_error *error) {
    return library_guard(error, [&] {
        evaluate_input input;
        input.width_px = width_px;
        input.height_px = height_px;
        input.disparity_px = disparity_px;
        input.truth_px = truth_px;
        input.mask = mask;
        const evaluate_result found = evaluate_disparity(input);
        if (found.filled_all.pixels == 0) {
            return library_fail(error, ERROR_MISSING, "the ground truth has no known pixel");
        }
        *evaluation = {score_of(found.filled_all),     score_of(found.saved_all),
                       score_of(found.filled_visible), score_of(found.kept_visible),
                       found.density_all_percent,      found.density_visible_percent};
        return static_cast<int>(ERROR_OK);
    });
}

namespace {

template <class Value>
Value *copy_of(const std::vector<Value> &values) {
    auto *copy = static_cast<Value *>(std::malloc(values.size() * sizeof(Value)));
    if (copy == nullptr) {
        throw std::bad_alloc();
    }
    std::memcpy(copy, values.data(), values.size() * sizeof(Value));
    return copy;
}

}  // namespace

int vergence_truth_load(const char *path, const char *mask_path, double scale, int *width_px,
                        int *height_px, float **truth_px, uint8_t **mask, vergence_error *error) {
    return library_guard(error, [&] {
        evaluate_truth truth;
        std::string text;
        if (!evaluate_truth_load(path, mask_path != nullptr ? mask_path : "", scale, &truth,
                                 &text)) {
            return library_fail(error, ERROR_SYNTAX, text);
        }
        float *const values = copy_of(truth.disparity_px);
        *mask = truth.mask.empty() ? nullptr : copy_of(truth.mask);
        *truth_px = values;
        *width_px = truth.width_px;
        *height_px = truth.height_px;
        return static_cast<int>(ERROR_OK);
    });
}

void vergence_free(void *memory) {
    std::free(memory);
}
