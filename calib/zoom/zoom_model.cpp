// SPDX-License-Identifier: Apache-2.0
#include "calib/zoom/zoom_model.hpp"

#include <cmath>

#include "core/invariant.h"
#include "stereo/geometry/geometry.h"

namespace calib {

namespace {

rigid turn_about(const double direction[3], double angle_rad) {
    const double length = geometry_norm(direction);
    const double turn[3] = {direction[0] / length * angle_rad, direction[1] / length * angle_rad,
                            direction[2] / length * angle_rad};
    return turned({}, turn);
}

}  // namespace

bool zoom_deviates(int function) {
    return function == ZOOM_FOCAL || function == ZOOM_CENTRE_X || function == ZOOM_CENTRE_Y ||
           function == ZOOM_RADIAL_2 || function == ZOOM_RADIAL_4 || function == ZOOM_PUPIL;
}

int zoom_lens_parameter(int function) {
    static const int group[ZOOM_FUNCTIONS] = {LOG_FOCAL,    -1,       CENTRE_X, CENTRE_Y,
                                              RADIAL_2,     RADIAL_4, RADIAL_6, TANGENTIAL_1,
                                              TANGENTIAL_2, -1};
    INVARIANT(function >= 0 && function < ZOOM_FUNCTIONS);
    return group[function];
}

zoom_layout::zoom_layout(const zoom_problem &problem, const zoom_orders &orders) : orders_(orders) {
    const double angle_step = 1e-5, length_step = 0.1, dioptre_step = 1e-4;
    const auto take = [this](int count, double step) {
        const int first = size_;
        size_ += count;
        steps_.resize(size_t(size_), step);
        return first;
    };
    const auto step_of = [&](int function) {
        return function == ZOOM_FOCUS_DIOPTRE ? dioptre_step : length_step;
    };
    for (int camera = 0; camera < CAMERAS; camera++) {
        camera_places &at = at_[size_t(camera)];
        settings_[camera] = int(problem.side[size_t(camera)].settings.size());
        for (int function = 0; function < ZOOM_FUNCTIONS; function++) {
            at.terms[function] = take(estimated_terms(function), step_of(function));
        }
        at.focus = take(ZOOM_FOCUS_TERMS, dioptre_step);
        at.mount = take(2, angle_step);
        take(2, length_step);
        take(1, angle_step);
        if (camera == RIGHT) {
            take(3, angle_step);
            take(3, length_step);
        }
    }
    visits_ = problem.visits;
    boards_ = int(problem.boards.size());
    warp_ = take(int(problem.boards.size()) * WARP_PARAMETERS, length_step);
    for (int camera = 0; camera < CAMERAS; camera++) {
        at_[size_t(camera)].pan = take(problem.visits, angle_step);
    }
    first_effect_ = size_;
    for (int camera = 0; camera < CAMERAS; camera++) {
        camera_places &at = at_[size_t(camera)];
        for (int function = 0; function < ZOOM_FUNCTIONS; function++) {
            const bool has = zoom_deviates(function) && orders[size_t(function)] > 0;
            at.effects[function] = has ? take(settings_[camera], step_of(function)) : -1;
        }
    }
}

int zoom_layout::effect_at(int camera, int function, int setting) const {
    INVARIANT(setting < settings_[camera]);
    const int first = at_[size_t(camera)].effects[function];
    return first < 0 || setting < 0 ? -1 : first + setting;
}

int zoom_layout::mount_at(int camera, int parameter) const {
    INVARIANT(parameter >= 0 && parameter < ZOOM_MOUNT_PARAMETERS);
    return camera == LEFT && parameter >= ZOOM_ROTATION_X ? -1
                                                          : at_[size_t(camera)].mount + parameter;
}

std::vector<int> zoom_layout::columns(int camera, int setting, int visit) const {
    std::vector<int> result;
    for (int function = 0; function < ZOOM_FUNCTIONS; function++) {
        for (int i = 0; i < estimated_terms(function); i++) {
            result.push_back(terms_at(camera, function) + i);
        }
        const int effect = effect_at(camera, function, setting);
        if (effect >= 0) {
            result.push_back(effect);
        }
    }
    for (int i = 0; i < ZOOM_FOCUS_TERMS; i++) {
        result.push_back(focus_at(camera) + i);
    }
    for (int i = 0; i < ZOOM_MOUNT_PARAMETERS; i++) {
        const int place = mount_at(camera, i);
        if (place >= 0) {
            result.push_back(place);
        }
    }
    if (visit >= 0) {
        result.push_back(pan_at(camera, visit));
    }
    return result;
}

double zoom_unit(const zoom_range &range, double value) {
    INVARIANT(range.max > range.min);
    return (2 * value - range.min - range.max) / (range.max - range.min);
}

void chebyshev(double u, int count, double *value) {
    INVARIANT(count <= ZOOM_TERMS_MAX);
    for (int i = 0; i < count; i++) {
        value[i] = i == 0 ? 1 : i == 1 ? u : 2 * u * value[i - 1] - value[i - 2];
    }
}

namespace {

double effect_of(const zoom_layout &layout, const double *shared, int camera, int function,
                 int setting) {
    const int place = layout.effect_at(camera, function, setting);
    return place < 0 ? 0 : shared[place];
}

double sum_of_terms(const zoom_layout &layout, const double *shared, int camera, int function,
                    const double *basis) {
    const double *term = shared + layout.terms_at(camera, function);
    const bool pupil = function == ZOOM_PUPIL;
    double sum = 0;
    for (int i = 0; i < layout.estimated_terms(function); i++) {
        // The pupil's terms are T_i(u) - T_i(-1).
        sum += term[i] * (pupil ? basis[i + 1] + (i % 2 == 0 ? 1 : -1) : basis[i]);
    }
    return sum;
}

}  // namespace

double focal_at(const zoom_problem &problem, const zoom_layout &layout, const double *shared,
                int camera, int setting, double zoom_counts) {
    double basis[ZOOM_TERMS_MAX];
    chebyshev(zoom_unit(problem.side[size_t(camera)].zoom, zoom_counts),
              layout.orders()[ZOOM_FOCAL], basis);
    return sum_of_terms(layout, shared, camera, ZOOM_FOCAL, basis) +
           effect_of(layout, shared, camera, ZOOM_FOCAL, setting);
}

posed_camera camera_at(const zoom_problem &problem, const zoom_layout &layout, const double *shared,
                       const zoom_view_state &view_state, const zoom_latents &latent) {
    const int camera = view_state.camera;
    const zoom_side &side = problem.side[size_t(camera)];
    posed_camera posed;
    posed.focal_px = std::fmax(1, focal_at(problem, layout, shared, camera, view_state.setting,
                                           view_state.axes.zoom_counts + latent[LATENT_READING]));
    const double u = zoom_unit(side.log_focal, std::log(posed.focal_px));
    double basis[ZOOM_TERMS_MAX];
    chebyshev(u, ZOOM_TERMS_MAX, basis);
    double pupil_mm = 0;
    for (int function = ZOOM_FOCUS_DIOPTRE; function < ZOOM_FUNCTIONS; function++) {
        const double value = sum_of_terms(layout, shared, camera, function, basis) +
                             effect_of(layout, shared, camera, function, view_state.setting);
        if (function == ZOOM_FOCUS_DIOPTRE) {
            posed.focus_dioptre = value;
        } else if (function == ZOOM_PUPIL) {
            pupil_mm = value;
        } else {
            posed.lens.value[size_t(zoom_lens_parameter(function))] = value;
        }
    }
    posed.lens.value[CENTRE_X] += latent[LATENT_CENTRE_X];
    posed.lens.value[CENTRE_Y] += latent[LATENT_CENTRE_Y];
    chebyshev(zoom_unit(side.focus, view_state.axes.focus_counts), ZOOM_FOCUS_TERMS + 1, basis);
    for (int i = 0; i < ZOOM_FOCUS_TERMS; i++) {
        posed.focus_dioptre += shared[layout.focus_at(camera) + i] * basis[i + 1];
    }
    const double stretch = 1 - posed.focal_px * side.pixel_mm * 1e-3 * posed.focus_dioptre;
    posed.lens.value[LOG_FOCAL] = std::log(posed.focal_px / std::fmax(0.1, stretch));

    double mount[ZOOM_MOUNT_PARAMETERS];
    for (int i = 0; i < ZOOM_MOUNT_PARAMETERS; i++) {
        const int place = layout.mount_at(camera, i);
        mount[i] = place < 0 ? 0 : shared[place];
    }
    const double angle =
        view_state.axes.pan_rad * (1 + mount[ZOOM_PAN_SCALE]) +
        (view_state.visit < 0 ? 0 : shared[layout.pan_at(camera, view_state.visit)]) +
        latent[LATENT_PAN];
    const double direction[3] = {mount[ZOOM_AXIS_DIRECTION_X], 1, mount[ZOOM_AXIS_DIRECTION_Z]};
    const rigid turn = turn_about(direction, angle);
    const rigid still = turned({}, mount + ZOOM_ROTATION_X);
    rigid T_instrument_camera;
    geometry_multiply(turn.R, still.R, T_instrument_camera.R);
    const double point[3] = {mount[ZOOM_AXIS_POINT_X], 0, mount[ZOOM_AXIS_POINT_Z]};
    double arm[3], moved[3];
    for (int i = 0; i < 3; i++) {
        arm[i] = mount[ZOOM_POSITION_X + i] - point[i];
    }
    geometry_rotate(turn.R, arm, moved);
    for (int i = 0; i < 3; i++) {
        T_instrument_camera.t_mm[i] =
            point[i] + moved[i] + T_instrument_camera.R[3 * i + 2] * pupil_mm;
    }
    posed.T_camera_instrument = inverse(T_instrument_camera);
    return posed;
}

zoom_view_state view_state_of(const zoom_problem::capture &capture, int camera) {
    return {camera, capture.setting[size_t(camera)], capture.visit, capture.axes[size_t(camera)]};
}

}  // namespace calib
