// SPDX-License-Identifier: Apache-2.0
#include "stereo/zoom/adjust_prior.h"

#include <math.h>
#include <string.h>

#include "core/error.h"
#include "core/invariant.h"

// What the derivatives are taken of.
struct prior {
    struct zoom_camera camera[2];
    struct zoom_state state[ADJUST_STATES_MAX];
    int states, terms;
};

static void views_at(const struct prior *prior, int state, struct camera_view view[2]) {
    struct zoom_pair pair;
    zoom_pair_at(prior->camera, &prior->state[state], &pair);
    for (int side = 0; side < 2; side++) {
        view[side].lens = pair.side[side].lens;
        memcpy(view[side].R_instrument_camera, pair.side[side].R_instrument_camera,
               sizeof view[side].R_instrument_camera);
        memcpy(view[side].position_mm, pair.side[side].position_mm, sizeof view[side].position_mm);
    }
}

// Half the difference of all views for a number that is changed by +-`step`: the effect of one
// standard deviation if that is `step`.
static void effect(struct prior *prior, double *number, double step, double *column) {
    const double kept = *number;
    INVARIANT(step > 0);
    for (int state = 0; state < prior->states; state++) {
        struct camera_view above[2], below[2];
        *number = kept + step;
        views_at(prior, state, above);
        *number = kept - step;
        views_at(prior, state, below);
        for (int side = 0; side < 2; side++) {
            double *terms = column + VIEW_TERMS * adjust_view(state, side);
            camera_view_difference(&above[side], &below[side], terms);
            for (int i = 0; i < VIEW_TERMS; i++) {
                terms[i] *= 0.5;
            }
        }
    }
    *number = kept;
}

static void add_square(const double *column, int terms, double *covariance) {
    for (int i = 0; i < terms; i++) {
        for (int j = 0; j < terms && column[i] != 0; j++) {
            covariance[i * terms + j] += column[i] * column[j];
        }
    }
}

static void add_deviation(struct prior *prior, double *number, double sigma, double *covariance) {
    double column[ADJUST_TERMS_MAX];
    if (sigma > 0) {
        effect(prior, number, sigma, column);
        add_square(column, prior->terms, covariance);
    }
}

enum motor { PAN, ZOOM, FOCUS };

static double *position(struct prior *prior, int state, int side, enum motor motor) {
    struct zoom_camera_state *at = &prior->state[state].side[side];
    if (motor == PAN) {
        return &at->pan_rad;
    }
    return motor == ZOOM ? &at->zoom_counts : &at->focus_counts;
}

// The same deviation in all states.
static void add_common(struct prior *prior, int side, enum motor motor, double sigma,
                       double *covariance) {
    double sum[ADJUST_TERMS_MAX] = {0}, column[ADJUST_TERMS_MAX];
    INVARIANT(prior->terms <= ADJUST_TERMS_MAX);
    for (int state = 0; state < prior->states && sigma > 0; state++) {
        effect(prior, position(prior, state, side, motor), sigma, column);
        for (int i = 0; i < prior->terms; i++) {
            sum[i] += column[i];
        }
    }
    add_square(sum, prior->terms, covariance);
}

static void add_motors(struct prior *prior, double *covariance) {
    static const enum zoom_mount_parameter tilt[] = {ZOOM_ROTATION_X, ZOOM_ROTATION_Z};
    for (int side = 0; side < 2; side++) {
        const struct zoom_camera *camera = &prior->camera[side];
        add_common(prior, side, PAN, camera->pan_sigma_rad, covariance);
        add_common(prior, side, ZOOM, camera->drift_sigma_counts, covariance);
        add_common(prior, side, FOCUS, camera->drift_sigma_counts, covariance);
        // A servo that moved about its axis during the calibration is taken to tilt as far about
        // the other ones until it is used.
        for (int i = 0; i < 2; i++) {
            add_deviation(prior, &prior->camera[side].mount[tilt[i]], camera->creep_sigma_rad,
                          covariance);
        }
        for (int state = 0; state < prior->states; state++) {
            add_deviation(prior, position(prior, state, side, PAN), camera->creep_sigma_rad,
                          covariance);
            add_deviation(prior, position(prior, state, side, ZOOM), camera->reading_sigma_counts,
                          covariance);
            add_deviation(prior, position(prior, state, side, FOCUS), camera->reading_sigma_counts,
                          covariance);
            for (int name = 0; name < ZOOM_FUNCTIONS; name++) {
                add_deviation(prior, &prior->state[state].side[side].deviation[name],
                              camera->function[name].irregularity, covariance);
            }
        }
    }
}

static double covariance_of(const struct zoom_calibration *calibration, int i, int j) {
    return i >= j ? calibration->covariance[i * (i + 1) / 2 + j]
                  : calibration->covariance[j * (j + 1) / 2 + i];
}

// E C E^T, where row i of `effects` is the effect of one standard deviation of parameter i.
static void add_parameters(const struct zoom_calibration *calibration, const double *effects,
                           int terms, double *covariance) {
    const int count = calibration->parameters;
    INVARIANT(count >= 0 && count <= ZOOM_PARAMETERS_MAX);
    for (int i = 0; i < count; i++) {
        double mixed[ADJUST_TERMS_MAX] = {0};
        const double sigma_i = sqrt(covariance_of(calibration, i, i));
        for (int j = 0; j < count && sigma_i > 0; j++) {
            const double sigma_j = sqrt(covariance_of(calibration, j, j));
            const double c =
                sigma_j > 0 ? covariance_of(calibration, i, j) / (sigma_i * sigma_j) : 0;
            for (int k = 0; k < terms && c != 0; k++) {
                mixed[k] += c * effects[j * terms + k];
            }
        }
        for (int k = 0; k < terms; k++) {
            for (int l = 0; l < terms; l++) {
                covariance[k * terms + l] += effects[i * terms + k] * mixed[l];
            }
        }
    }
}

int adjust_prior_covariance(const struct zoom_calibration *calibration,
                            const struct zoom_state *state, int states, struct arena *arena,
                            double *covariance) {
    const size_t mark = arena_mark(arena);
    const int terms = 2 * states * VIEW_TERMS;
    INVARIANT(states >= 1 && states <= ADJUST_STATES_MAX);
    struct prior *prior = arena_take(arena, 1, sizeof *prior);
    double *effects =
        arena_take(arena, (size_t)ZOOM_PARAMETERS_MAX * (size_t)terms, sizeof(double));
    if (prior == NULL || effects == NULL) {
        arena_release(arena, mark);
        return ERROR_MEMORY;
    }
    memcpy(prior->camera, calibration->camera, sizeof prior->camera);
    memcpy(prior->state, state, (size_t)states * sizeof *state);
    prior->states = states;
    prior->terms = terms;
    double *parameter[ZOOM_PARAMETERS_MAX];
    const int count = zoom_parameter_list(prior->camera, parameter);
    INVARIANT(count <= ZOOM_PARAMETERS_MAX);
    memset(effects, 0, (size_t)ZOOM_PARAMETERS_MAX * (size_t)terms * sizeof(double));
    for (int i = 0; i < count && i < calibration->parameters; i++) {
        const double sigma = sqrt(covariance_of(calibration, i, i));
        if (sigma > 0) {
            effect(prior, parameter[i], sigma, effects + i * terms);
        }
    }
    add_parameters(calibration, effects, terms, covariance);
    add_motors(prior, covariance);
    arena_release(arena, mark);
    return ERROR_OK;
}

size_t adjust_prior_need_bytes(int states) {
    return arena_need_bytes(1, sizeof(struct prior)) +
           arena_need_bytes((size_t)ZOOM_PARAMETERS_MAX * 2 * (size_t)states * VIEW_TERMS,
                            sizeof(double));
}
