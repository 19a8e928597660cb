// SPDX-License-Identifier: Apache-2.0
#include "calib/zoom/zoom_result.hpp"

#include <algorithm>
#include <cmath>

#include "core/invariant.h"

namespace calib {

namespace {

// Of the lengths of a print: those of office printers are right to some 1e-4.
const double PRINT_SIGMA = 2e-4;
// Of a potentiometer's reading, between calibration and use.
const double DRIFT_COUNTS = 1;

// One parameter of the calibration as a sum of shared parameters.
using combination = std::vector<std::pair<int, double>>;

combination term_of(const zoom_layout &layout, int camera, int function, int term) {
    const int first = layout.terms_at(camera, function);
    if (function != ZOOM_PUPIL) {
        return {{first + term, 1}};
    }
    if (term > 0) {
        return {{first + term - 1, 1}};
    }
    combination sum;  // makes the function 0 at u = -1
    for (int i = 0; i < layout.estimated_terms(function); i++) {
        sum.emplace_back(first + i, i % 2 == 0 ? 1 : -1);
    }
    return sum;
}

// All parameters of the text in the order of `zoom_parameter_list`.
std::vector<combination> parameters_of(const zoom_layout &layout) {
    std::vector<combination> result;
    for (int camera = 0; camera < CAMERAS; camera++) {
        for (int function = 0; function < ZOOM_FUNCTIONS; function++) {
            for (int term = 0; term < layout.orders()[size_t(function)]; term++) {
                result.push_back(term_of(layout, camera, function, term));
            }
        }
        for (int i = 0; i < ZOOM_FOCUS_TERMS; i++) {
            result.push_back({{layout.focus_at(camera) + i, 1}});
        }
        for (int i = 0; i < ZOOM_MOUNT_PARAMETERS; i++) {
            if (layout.mount_at(camera, i) >= 0) {
                result.push_back({{layout.mount_at(camera, i), 1}});
            }
        }
    }
    return result;
}

void describe_camera(const zoom_solution &solution, int camera, zoom_camera *out) {
    const zoom_layout &layout = solution.layout;
    const zoom_side &side = solution.problem.side[size_t(camera)];
    *out = zoom_camera_of(solution.problem, layout, solution.estimate.shared.data(), camera);
    out->width_px = side.frame.width_px;
    out->height_px = side.frame.height_px;
    out->radius_px = side.frame.radius_px;
    for (int function = 0; function < ZOOM_FUNCTIONS; function++) {
        const int effect = layout.settings(camera) > 0 ? layout.effect_at(camera, function, 0) : -1;
        out->function[function].irregularity =
            effect >= 0 ? solution.prior.sigma[size_t(effect)] : 0;
    }
    out->function[ZOOM_CENTRE_X].term[0] += side.frame.middle_x_px;
    out->function[ZOOM_CENTRE_Y].term[0] += side.frame.middle_y_px;
    out->pan_rad = {INFINITY, -INFINITY};
    for (const zoom_problem::capture &capture : solution.problem.captures) {
        const double pan = capture.axes[size_t(camera)].pan_rad;
        out->pan_rad = {std::fmin(out->pan_rad.min, pan), std::fmax(out->pan_rad.max, pan)};
    }
    const zoom_latents &latent = solution.prior.latent_sigma[size_t(camera)];
    out->reading_sigma_counts = latent[LATENT_READING];
    out->drift_sigma_counts = solution.problem.reading_noise ? DRIFT_COUNTS : 0;
    // An unseen setting differs by both.
    for (const int axis : {0, 1}) {
        double &irregularity = out->function[ZOOM_CENTRE_X + axis].irregularity;
        irregularity = std::hypot(irregularity, latent[size_t(LATENT_CENTRE_X + axis)]);
    }
    out->pan_sigma_rad = solution.problem.pan_sigma_rad;
    out->creep_sigma_rad = latent[LATENT_PAN];
}

void describe_data(zoom_solution *solution) {
    zoom_validation &out = solution->rig->validation;
    const zoom_problem &problem = solution->problem;
    out.settings =
        int(std::max(problem.side[LEFT].settings.size(), problem.side[RIGHT].settings.size()));
    out.boards = int(problem.places.size());
    double squares = 0;
    for (size_t i = 0; i < problem.captures.size(); i++) {
        for (int camera = 0; camera < CAMERAS; camera++) {
            const posed_camera posed =
                fitted_camera(problem, solution->layout, solution->estimate, i, camera);
            const bundle_view &view = problem.captures[i].view[size_t(camera)];
            for (const bundle_corner &corner : view.corners) {
                double r[2];
                const bool used = view.used && corner.used &&
                                  zoom_residual(problem, solution->layout, solution->estimate,
                                                posed, i, camera, corner, r);
                squares += used ? r[0] * r[0] + r[1] * r[1] : 0;
                (used ? out.corners : out.rejected_corners)++;
            }
        }
    }
    solution->rms_px = out.corners > 0 ? std::sqrt(squares / out.corners) : 0;
    out.rms_px = solution->rms_px;
}

}  // namespace

void describe_zoom(zoom_solution *solution) {
    solution->rig = std::make_shared<zoom_calibration>();
    zoom_calibration &rig = *solution->rig;
    for (int camera = 0; camera < CAMERAS; camera++) {
        describe_camera(*solution, camera, &rig.camera[camera]);
    }
    rig.scale_sigma = PRINT_SIGMA;
    describe_data(solution);
    const std::vector<combination> list = parameters_of(solution->layout);
    INVARIANT(list.size() <= ZOOM_PARAMETERS_MAX);
    rig.parameters = int(list.size());
    const matrix &C = solution->covariance.shared;
    double *out = rig.covariance;
    for (const combination &row : list) {
        for (const combination *column = list.data(); column <= &row; column++) {
            double sum = 0;
            for (const auto &[i, a] : row) {
                for (const auto &[k, b] : *column) {
                    sum += a * b * C(i, k);
                }
            }
            *out++ = sum;
        }
    }
}

}  // namespace calib
