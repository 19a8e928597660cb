// SPDX-License-Identifier: Apache-2.0
#include "stereo/zoom/zoom_sigma.h"

#include <math.h>
#include <string.h>

#include "core/error.h"
#include "core/invariant.h"
#include "stereo/geometry/geometry.h"

double zoom_variance_sum(const struct zoom_variance *variance) {
    const double sum =
        variance->lens + variance->mount + variance->motor + variance->pan + variance->cross;
    return sum > 0 ? sum : 0;
}

// What is being differentiated: `side` of the pair with one number changed.
struct propagation {
    struct zoom_camera camera[2];  // changed and changed back
    struct zoom_state state;
    zoom_evaluate *evaluate;
    void *context;
    int count;
};

// Half of the values' change when a number goes from `step` below to `step` above its value.
static void difference(struct propagation *at, double *number, double step,
                       double change[ZOOM_VALUES_MAX]) {
    INVARIANT(step > 0 && at->count <= ZOOM_VALUES_MAX);
    const double value = *number;
    struct zoom_pair pair;
    double below[ZOOM_VALUES_MAX];
    *number = value - step;
    zoom_pair_at(at->camera, &at->state, &pair);
    at->evaluate(&pair, at->context, below);
    *number = value + step;
    zoom_pair_at(at->camera, &at->state, &pair);
    at->evaluate(&pair, at->context, change);
    *number = value;
    for (int i = 0; i < at->count; i++) {
        change[i] = (change[i] - below[i]) / 2;
    }
}

static void add_independent(struct propagation *at, double *number, double sigma,
                            double variance[ZOOM_VALUES_MAX]) {
    if (sigma <= 0) {
        return;
    }
    double change[ZOOM_VALUES_MAX];
    difference(at, number, sigma, change);
    for (int i = 0; i < at->count; i++) {
        variance[i] += change[i] * change[i];
    }
}

static bool is_mount(const struct zoom_camera camera[2], const double *number) {
    INVARIANT(number != NULL);
    for (int side = 0; side < 2; side++) {
        const double *mount = camera[side].mount;
        for (int i = 0; i < ZOOM_MOUNT_PARAMETERS; i++) {
            if (number == &mount[i]) {
                return true;
            }
        }
    }
    return false;
}

enum { TOGETHER = 8 };  // values whose derivatives are kept at a time: 12 KB of them

// Derivatives of values `first`.. by all parameters, taken over one standard deviation.
static void derivatives(struct propagation *at, const struct zoom_calibration *calibration,
                        double *const parameter[], int first, int values,
                        double change[][TOGETHER]) {
    for (int i = 0; i < calibration->parameters; i++) {
        const double sigma = sqrt(calibration->covariance[i * (i + 1) / 2 + i]);
        INVARIANT(sigma >= 0);
        double all[ZOOM_VALUES_MAX] = {0};
        if (sigma > 0) {
            difference(at, parameter[i], sigma, all);
        }
        for (int k = 0; k < values; k++) {
            change[i][k] = sigma > 0 ? all[first + k] / sigma : 0;
        }
    }
}

// The part to which the covariance of two parameters belongs.
static double *choose_part(struct zoom_variance *variance, bool mount_i, bool mount_j) {
    if (mount_i != mount_j) {
        return &variance->cross;
    }
    return mount_i ? &variance->mount : &variance->lens;
}

// Adds g^T C g for each value, by parts.
static void add_parts(const struct zoom_calibration *calibration, const bool mount[],
                      double change[][TOGETHER], int values, struct zoom_variance *variance) {
    INVARIANT(values > 0 && values <= TOGETHER);
    for (int i = 0; i < calibration->parameters; i++) {
        const double *row = &calibration->covariance[i * (i + 1) / 2];
        for (int j = 0; j <= i; j++) {
            const double covariance = (i == j ? 1 : 2) * row[j];
            for (int k = 0; k < values && covariance != 0; k++) {
                double *part = choose_part(&variance[k], mount[i], mount[j]);
                *part += covariance * change[i][k] * change[j][k];
            }
        }
    }
}

static void add_parameters(struct propagation *at, const struct zoom_calibration *calibration,
                           struct zoom_variance *variance) {
    double *parameter[ZOOM_PARAMETERS_MAX], change[ZOOM_PARAMETERS_MAX][TOGETHER];
    bool mount[ZOOM_PARAMETERS_MAX];
    const int count = zoom_parameter_list(at->camera, parameter);
    INVARIANT(calibration->parameters == 0 || calibration->parameters == count);
    for (int i = 0; i < calibration->parameters; i++) {
        mount[i] = is_mount(at->camera, parameter[i]);
    }
    for (int first = 0; first < at->count; first += TOGETHER) {
        const int values = at->count - first < TOGETHER ? at->count - first : TOGETHER;
        derivatives(at, calibration, parameter, first, values, change);
        add_parts(calibration, mount, change, values, &variance[first]);
    }
}

void zoom_propagate(const struct zoom_calibration *calibration, const struct zoom_state *state,
                    zoom_evaluate *evaluate, void *context, int count,
                    struct zoom_variance *variance) {
    INVARIANT(count > 0 && count <= ZOOM_VALUES_MAX);
    struct propagation at = {
        .state = *state, .evaluate = evaluate, .context = context, .count = count};
    memcpy(at.camera, calibration->camera, sizeof at.camera);
    memset(variance, 0, (size_t)count * sizeof *variance);
    add_parameters(&at, calibration, variance);
    double lens[ZOOM_VALUES_MAX] = {0}, motor[ZOOM_VALUES_MAX] = {0}, pan[ZOOM_VALUES_MAX] = {0};
    for (int side = 0; side < 2; side++) {
        const struct zoom_camera *camera = &calibration->camera[side];
        for (int name = 0; name < ZOOM_FUNCTIONS; name++) {
            add_independent(&at, &at.state.side[side].deviation[name],
                            camera->function[name].irregularity, lens);
        }
        const double counts = sqrt(camera->reading_sigma_counts * camera->reading_sigma_counts +
                                   camera->drift_sigma_counts * camera->drift_sigma_counts);
        add_independent(&at, &at.state.side[side].zoom_counts, counts, motor);
        add_independent(&at, &at.state.side[side].focus_counts, counts, motor);
        add_independent(&at, &at.state.side[side].pan_rad, camera->pan_sigma_rad, pan);
    }
    for (int i = 0; i < count; i++) {
        variance[i].lens += lens[i];
        variance[i].motor += motor[i];
        variance[i].pan += pan[i];
    }
}

// A point as the left camera sees it, seen by both.
struct seen_points {
    int count;
    double left_px[ZOOM_VALUES_MAX][2], right_px[ZOOM_VALUES_MAX][2];
};

static void to_instrument(const struct zoom_pair *pair, int side, const double pixel_px[2],
                          double direction[3]) {
    double ray[3] = {0, 0, 1};
    if (!lens_ray(&pair->side[side].lens, pixel_px, ray)) {
        ray[0] = (pixel_px[0] - pair->side[side].lens.cx_px) / pair->side[side].lens.fx_px;
        ray[1] = (pixel_px[1] - pair->side[side].lens.cy_px) / pair->side[side].lens.fy_px;
    }
    geometry_rotate(pair->side[side].R_instrument_camera, ray, direction);
}

// Depths in the left camera's frame of points at fixed pixels.
static void depths(const struct zoom_pair *pair, void *context, double *values) {
    const struct seen_points *points = context;
    INVARIANT(points->count <= ZOOM_VALUES_MAX);
    for (int i = 0; i < points->count; i++) {
        double left[3], right[3];
        to_instrument(pair, 0, points->left_px[i], left);
        to_instrument(pair, 1, points->right_px[i], right);
        struct geometry_midpoint midpoint;
        values[i] = 0;
        if (geometry_rays_midpoint(pair->side[0].position_mm, left, pair->side[1].position_mm,
                                   right, &midpoint)) {
            values[i] = midpoint.s;  // the ray in the camera's frame has z = 1
        }
    }
}

// Adds the point at a left pixel and depth; false if the right camera does not see it.
static bool add_point(const struct zoom_pair *pair, const double pixel_px[2], double depth_mm,
                      struct seen_points *points) {
    double direction[3], arm_mm[3], in_right_mm[3];
    to_instrument(pair, 0, pixel_px, direction);
    for (int i = 0; i < 3; i++) {
        arm_mm[i] =
            pair->side[0].position_mm[i] + depth_mm * direction[i] - pair->side[1].position_mm[i];
    }
    geometry_rotate_back(pair->side[1].R_instrument_camera, arm_mm, in_right_mm);
    const int i = points->count;
    INVARIANT(depth_mm > 0 && i < ZOOM_VALUES_MAX);
    const struct lens *right = &pair->side[1].lens;
    double *seen_px = points->right_px[i];
    if (!lens_project(right, in_right_mm, seen_px) || seen_px[0] < 0 || seen_px[1] < 0 ||
        seen_px[0] > right->width_px || seen_px[1] > right->height_px) {
        return false;
    }
    memcpy(points->left_px[i], pixel_px, sizeof points->left_px[i]);
    points->count++;
    return true;
}

struct zoom_variance zoom_depth_variance(const struct zoom_calibration *calibration,
                                         const struct zoom_state *state, const double pixel_px[2],
                                         double depth_mm) {
    struct zoom_pair pair;
    zoom_pair_at(calibration->camera, state, &pair);
    struct seen_points points = {.count = 0};
    struct zoom_variance variance;
    memset(&variance, 0, sizeof variance);
    if (!add_point(&pair, pixel_px, depth_mm, &points)) {
        return variance;
    }
    zoom_propagate(calibration, state, depths, &points, 1, &variance);
    const double by_scale_mm = calibration->scale_sigma * depth_mm;
    variance.lens += by_scale_mm * by_scale_mm;
    return variance;
}

void zoom_depth_sigma(const struct zoom_calibration *calibration, const struct zoom_state *state,
                      double *scale_sigma, double *yaw_sigma_rad) {
    struct zoom_pair pair;
    struct calibration at;
    memset(&at, 0, sizeof at);
    zoom_pair_at(calibration->camera, state, &pair);
    *scale_sigma = calibration->scale_sigma;
    *yaw_sigma_rad = 0;
    if (zoom_pair_calibration(&pair, &at) != ERROR_OK) {
        return;
    }
    const double met_mm = calibration_vergence_depth_mm(&at);
    const double baseline_mm = calibration_baseline_mm(&at);
    const double middle_mm = met_mm > 0 && met_mm < 100 * baseline_mm ? met_mm : 10 * baseline_mm;
    // Of the middle and halfway to the corners, where the axes meet; and of the middle off there.
    static const double place[TOGETHER][3] = {{0, 0, 1},        {-0.25, -0.25, 1}, {0.25, -0.25, 1},
                                              {-0.25, 0.25, 1}, {0.25, 0.25, 1},   {0, 0, 0.7},
                                              {0, 0, 1.5},      {0, 0, 0.85}};
    const struct lens *lens = &pair.side[0].lens;
    struct seen_points points = {.count = 0};
    double point_mm[ZOOM_VALUES_MAX];
    for (int i = 0; i < TOGETHER; i++) {
        const double pixel_px[2] = {lens->width_px * (0.5 + place[i][0]),
                                    lens->height_px * (0.5 + place[i][1])};
        const int next = points.count;
        if (add_point(&pair, pixel_px, middle_mm * place[i][2], &points)) {
            point_mm[next] = middle_mm * place[i][2];
        }
    }
    if (points.count == 0) {
        return;
    }
    struct zoom_variance variance[ZOOM_VALUES_MAX];
    zoom_propagate(calibration, state, depths, &points, points.count, variance);
    // Least squares of (sigma / z)^2 = scale^2 + yaw^2 (z / baseline)^2.
    double n = 0, sx = 0, sy = 0, sxx = 0, sxy = 0;
    for (int i = 0; i < points.count; i++) {
        const double x = point_mm[i] * point_mm[i] / (baseline_mm * baseline_mm);
        const double y = zoom_variance_sum(&variance[i]) / (point_mm[i] * point_mm[i]);
        n += 1;
        sx += x;
        sy += y;
        sxx += x * x;
        sxy += x * y;
    }
    const double spread = n * sxx - sx * sx;
    double slope = spread > 0 ? (n * sxy - sx * sy) / spread : 0;
    double constant = (sy - slope * sx) / n;
    if (slope < 0) {
        slope = 0;
        constant = sy / n;
    } else if (constant < 0) {
        constant = 0;
        slope = sxy / sxx;
    }
    *scale_sigma = sqrt(constant + calibration->scale_sigma * calibration->scale_sigma);
    *yaw_sigma_rad = sqrt(slope);
}
