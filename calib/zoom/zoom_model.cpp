// SPDX-License-Identifier: Apache-2.0
#include "calib/zoom/zoom_model.hpp"

#include <cmath>

#include "core/invariant.h"

namespace calib {

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

namespace {

double effect_of(const zoom_layout &layout, const double *shared, int camera, int function,
                 int setting) {
    const int place = layout.effect_at(camera, function, setting);
    return place < 0 ? 0 : shared[place];
}

double focal_of(const zoom_camera &model, double zoom_counts, double effect) {
    return zoom_function_value(&model, ZOOM_FOCAL, zoom_counts) + effect;
}

}  // namespace

zoom_camera zoom_camera_of(const zoom_problem &problem, const zoom_layout &layout,
                           const double *shared, int camera) {
    const zoom_side &side = problem.side[size_t(camera)];
    zoom_camera model{};
    model.pixel_mm = side.pixel_mm;
    model.zoom = side.zoom;
    model.focus = side.focus;
    model.log_focal = side.log_focal;
    for (int name = 0; name < ZOOM_FUNCTIONS; name++) {
        zoom_function &function = model.function[name];
        function.terms = layout.orders()[size_t(name)];
        const int skipped = function.terms - layout.estimated_terms(name);
        const double *term = shared + layout.terms_at(camera, name);
        for (int i = skipped; i < function.terms; i++) {
            function.term[i] = term[i - skipped];
            // T_i(-1) is 1 or -1: a function without a constant term is 0 at the lower end.
            const double constant = i % 2 == 0 ? -function.term[i] : function.term[i];
            function.term[0] += skipped == 0 ? 0 : constant;
        }
    }
    for (int i = 0; i < ZOOM_FOCUS_TERMS; i++) {
        model.focus_dioptre_by_count[i] = shared[layout.focus_at(camera) + i];
    }
    for (int i = 0; i < ZOOM_MOUNT_PARAMETERS; i++) {
        const int place = layout.mount_at(camera, i);
        model.mount[i] = place < 0 ? 0 : shared[place];
    }
    return model;
}

double focal_at(const zoom_problem &problem, const zoom_layout &layout, const double *shared,
                int camera, int setting, double zoom_counts) {
    return focal_of(zoom_camera_of(problem, layout, shared, camera), zoom_counts,
                    effect_of(layout, shared, camera, ZOOM_FOCAL, setting));
}

posed_camera camera_at(const zoom_problem &problem, const zoom_layout &layout, const double *shared,
                       const zoom_view_state &view_state, const zoom_latents &latent) {
    const int camera = view_state.camera;
    const zoom_camera model = zoom_camera_of(problem, layout, shared, camera);
    zoom_camera_state state{};
    state.focus_counts = view_state.axes.focus_counts;
    for (int name = 0; name < ZOOM_FUNCTIONS; name++) {
        state.deviation[name] = effect_of(layout, shared, camera, name, view_state.setting);
    }
    posed_camera posed;
    posed.focal_px =
        std::fmax(1, focal_of(model, view_state.axes.zoom_counts + latent[LATENT_READING],
                              state.deviation[ZOOM_FOCAL]));
    double value[ZOOM_FUNCTIONS];
    zoom_values_at(&model, &state, posed.focal_px, value);
    for (int name = 0; name < ZOOM_FUNCTIONS; name++) {
        if (zoom_lens_parameter(name) >= 0) {
            posed.lens.value[size_t(zoom_lens_parameter(name))] = value[name];
        }
    }
    posed.focus_dioptre = value[ZOOM_FOCUS_DIOPTRE];
    posed.lens.value[CENTRE_X] += latent[LATENT_CENTRE_X];
    posed.lens.value[CENTRE_Y] += latent[LATENT_CENTRE_Y];
    posed.lens.value[LOG_FOCAL] =
        std::log(posed.focal_px / std::fmax(0.1, zoom_focal_ratio(&model, value)));

    const double angle_rad =
        view_state.axes.pan_rad * (1 + model.mount[ZOOM_PAN_SCALE]) +
        (view_state.visit < 0 ? 0 : shared[layout.pan_at(camera, view_state.visit)]) +
        latent[LATENT_PAN];
    rigid T_instrument_camera;
    zoom_pose_at(&model, angle_rad, value[ZOOM_PUPIL], T_instrument_camera.R,
                 T_instrument_camera.t_mm);
    posed.T_camera_instrument = inverse(T_instrument_camera);
    return posed;
}

zoom_view_state view_state_of(const zoom_problem::capture &capture, int camera) {
    return {camera, capture.setting[size_t(camera)], capture.visit, capture.axes[size_t(camera)]};
}

}  // namespace calib
