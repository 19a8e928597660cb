// SPDX-License-Identifier: Apache-2.0
#include "stereo/zoom/adjust_target.h"

#include <math.h>
#include <string.h>

#include "core/cholesky.h"
#include "core/invariant.h"
#include "core/math.h"
#include "stereo/geometry/geometry.h"

enum { POSE = 6, PLACE_STEPS = 30 };

static const double cauchy_sigmas = 2.385;

// The normal equations of a target: of its pose, and of both with the corrections.
struct normal {
    double pose[POSE][POSE], mixed[POSE][ADJUST_TERMS_MAX], side[POSE];
};

// One observation: residual, and derivatives with respect to view and pose.
struct row {
    double residual[2], of_view[2][VIEW_TERMS], of_pose[2][POSE];
};

static bool look(const struct camera_view *view, const struct adjust_target *target,
                 const struct target_observation *observation, struct row *row) {
    double arm[3], point[3], pixel[2], of_point[2][3];
    const struct camera_view *camera = &view[observation->view];
    INVARIANT(observation->point >= 0 && observation->point < target->points);
    geometry_rotate(target->R_instrument_target, target->point_mm[observation->point], arm);
    for (int i = 0; i < 3; i++) {
        point[i] = target->position_mm[i] + arm[i];
    }
    // Seen from the origin of the instrument, on the ray through the point.
    const struct far_point far = {
        {0, 0, 0}, point[0] / point[2], point[1] / point[2], 1 / point[2]};
    if (!(point[2] > 0) || !camera_view_project(camera, &far, pixel, row->of_view, of_point)) {
        return false;
    }
    for (int i = 0; i < 2; i++) {
        row->residual[i] = observation->pixel_px[i] - pixel[i];
        // Of the point's coordinates: x/z, y/z and 1/z are those of `far`.
        double of_world[3] = {of_point[i][0] * far.w, of_point[i][1] * far.w, 0};
        of_world[2] =
            -far.w * (of_point[i][0] * far.x + of_point[i][1] * far.y + of_point[i][2] * far.w);
        double of_turn[3];
        geometry_cross(arm, of_world, of_turn);
        for (int k = 0; k < 3; k++) {
            row->of_pose[i][k] = of_world[k];
            row->of_pose[i][3 + k] = of_turn[k];
        }
    }
    return true;
}

// Share of its squared limit by which an observation is off.
static double share_of(const struct adjust_target *target, const struct row *row) {
    const double limit = target->sigma_px * cauchy_sigmas;
    INVARIANT(limit > 0);
    return (row->residual[0] * row->residual[0] + row->residual[1] * row->residual[1]) /
           (2 * limit * limit);
}

static double weight_of(const struct adjust_target *target, const struct row *row) {
    return 1 / (target->sigma_px * target->sigma_px * (1 + share_of(target, row)));
}

// A direction of the pose's equations that nothing shows: a length turns about itself.
static const double unseen = 1e-10;

static void add_pose(const struct row *row, double weight, struct normal *n) {
    for (int i = 0; i < 2; i++) {
        for (int a = 0; a < POSE; a++) {
            const double factor = weight * row->of_pose[i][a];
            for (int b = 0; b < POSE; b++) {
                n->pose[a][b] += factor * row->of_pose[i][b];
            }
            n->side[a] += factor * row->residual[i];
        }
    }
}

// The normal equations of the pose and what is to be made small.
static bool weigh(const struct camera_view *view, struct adjust_target *target, struct normal *n,
                  double *cost) {
    double square = 0;
    memset(n, 0, sizeof *n);
    *cost = 0;
    for (int i = 0; i < target->observations; i++) {
        struct row row;
        if (!look(view, target, &target->observation[i], &row)) {
            return false;
        }
        add_pose(&row, weight_of(target, &row), n);
        square += row.residual[0] * row.residual[0] + row.residual[1] * row.residual[1];
        *cost += math_log(1 + share_of(target, &row));
    }
    target->residual_px = sqrt(square / (2 * target->observations));
    return true;
}

// Moves the pose by the solution of its equations, which are damped.
static void move(const struct normal *n, double damping, struct adjust_target *target) {
    double factor[POSE * POSE], step[POSE], turn[9], turned[9];
    memcpy(factor, n->pose, sizeof factor);
    memcpy(step, n->side, sizeof step);
    for (int i = 0; i < POSE; i++) {
        factor[i * POSE + i] *= 1 + damping;
    }
    cholesky_factorize(factor, POSE, unseen);
    cholesky_forward(factor, POSE, step, 1);
    cholesky_backward(factor, POSE, step);
    geometry_rotation_from_vector(step + 3, turn);
    geometry_multiply(turn, target->R_instrument_target, turned);
    memcpy(target->R_instrument_target, turned, sizeof turned);
    for (int i = 0; i < 3; i++) {
        target->position_mm[i] += step[i];
    }
}

// Moves the pose to the best agreement with the observations (Levenberg and Marquardt): if a length
// does not fit, undamped steps overshoot.
static bool settle(const struct camera_view *view, struct adjust_target *target) {
    struct adjust_target best = *target;
    struct normal n, trial;
    double least, cost, damping = 1e-6;
    if (!weigh(view, target, &n, &least)) {
        return false;
    }
    best.residual_px = target->residual_px;
    for (int step = 0; step < PLACE_STEPS && damping < 1e6; step++) {
        *target = best;
        move(&n, damping, target);
        if (!weigh(view, target, &trial, &cost) || !(cost < least)) {
            damping *= 10;
            continue;
        }
        const bool done = least - cost < 1e-10 * least;
        damping *= 0.1;
        best = *target;
        n = trial;
        least = cost;
        if (done) {
            break;
        }
    }
    *target = best;
    return true;
}

// The point where two cameras see a point of the target.
static bool meet(const struct camera_view *view, const struct adjust_target *target, int point,
                 double result_mm[3]) {
    const struct target_observation *seen[2] = {NULL, NULL};
    for (int i = 0; i < target->observations; i++) {
        const struct target_observation *observation = &target->observation[i];
        if (observation->point == point && seen[observation->view % 2] == NULL) {
            seen[observation->view % 2] = observation;
        }
    }
    double ray[2][3];
    struct geometry_midpoint middle;
    if (seen[0] == NULL || seen[1] == NULL ||
        !camera_view_ray(&view[seen[0]->view], seen[0]->pixel_px, ray[0]) ||
        !camera_view_ray(&view[seen[1]->view], seen[1]->pixel_px, ray[1]) ||
        !geometry_rays_midpoint(view[seen[0]->view].position_mm, ray[0],
                                view[seen[1]->view].position_mm, ray[1], &middle)) {
        return false;
    }
    memcpy(result_mm, middle.point_mm, sizeof middle.point_mm);
    return true;
}

static bool unit(double v[3]) {
    const double length = geometry_norm(v);
    for (int i = 0; i < 3; i++) {
        v[i] /= length;
    }
    return length > 0;
}

// Axes of three points: along the first two, normal to all.
static bool axes_of(double points[3][3], double R[9]) {
    double x[3], y[3], z[3];
    for (int i = 0; i < 3; i++) {
        x[i] = points[1][i] - points[0][i];
        y[i] = points[2][i] - points[0][i];
    }
    geometry_cross(x, y, z);
    if (!unit(x) || !unit(z)) {
        return false;
    }
    geometry_cross(z, x, y);
    for (int i = 0; i < 3; i++) {
        R[3 * i] = x[i];
        R[3 * i + 1] = y[i];
        R[3 * i + 2] = z[i];
    }
    return true;
}

static double distance2(const double a[3], const double b[3]) {
    const double d[3] = {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
    return geometry_dot(d, d);
}

// How far point c is from the line of a and b: of the triangle's area.
static double off_line(const double a[3], const double b[3], const double c[3]) {
    const double u[3] = {b[0] - a[0], b[1] - a[1], b[2] - a[2]};
    const double v[3] = {c[0] - a[0], c[1] - a[1], c[2] - a[2]};
    double normal[3];
    geometry_cross(u, v, normal);
    return geometry_norm(normal);
}

// How far point i is from the chosen point, or from the line of the first two; 1 if none is chosen.
static double measure_spread(const double (*point)[3], const int *chosen, int count, int i) {
    if (count == 0) {
        return 1;
    }
    if (count == 1) {
        return distance2(point[chosen[0]], point[i]);
    }
    return off_line(point[chosen[0]], point[chosen[1]], point[i]);
}

// The next point that both cameras see, as far as possible from the ones before; -1: none.
static int next_point(const struct camera_view *view, const struct adjust_target *target,
                      const int *chosen, int count) {
    int best = -1;
    double most = 1e-9, at[3];
    for (int i = 0; i < target->points; i++) {
        const double far = measure_spread(target->point_mm, chosen, count, i);
        if (far > most && meet(view, target, i, at)) {
            most = far;
            best = i;
        }
    }
    return best;
}

// Three points of the target that both cameras see, far apart; a length gets a third beside it.
static bool choose_points(const struct camera_view *view, const struct adjust_target *target,
                          double own[3][3], double seen[3][3]) {
    static const double beside_mm[3] = {0, 100, 37};
    int chosen[3] = {-1, -1, -1};
    for (int rank = 0; rank < 3; rank++) {
        chosen[rank] = next_point(view, target, chosen, rank);
        if (chosen[rank] < 0) {
            break;
        }
        memcpy(own[rank], target->point_mm[chosen[rank]], sizeof own[rank]);
        (void)meet(view, target, chosen[rank], seen[rank]);
    }
    for (int i = 0; i < 3 && chosen[1] >= 0 && chosen[2] < 0; i++) {
        own[2][i] = own[0][i] + beside_mm[i];
        seen[2][i] = seen[0][i] + beside_mm[i];
    }
    return chosen[1] >= 0;
}

bool adjust_target_place(const struct camera_view *view, struct adjust_target *target) {
    double own[3][3], seen[3][3], R_target[9], R_seen[9], arm[3];
    if (!choose_points(view, target, own, seen) || !axes_of(own, R_target) ||
        !axes_of(seen, R_seen)) {
        return false;
    }
    for (int i = 0; i < 3; i++) {
        for (int j = 0; j < 3; j++) {
            target->R_instrument_target[3 * i + j] = geometry_dot(R_seen + 3 * i, R_target + 3 * j);
        }
    }
    geometry_rotate(target->R_instrument_target, own[0], arm);
    for (int i = 0; i < 3; i++) {
        target->position_mm[i] = seen[0][i] - arm[i];
    }
    return settle(view, target);
}

// What a change of the pose absorbs shows nothing of the views.
static void eliminate(struct normal *n, int terms, double *H, double *g) {
    cholesky_factorize(&n->pose[0][0], POSE, unseen);
    cholesky_forward(&n->pose[0][0], POSE, n->side, 1);
    for (int c = 0; c < terms; c++) {
        cholesky_forward(&n->pose[0][0], POSE, &n->mixed[0][c], ADJUST_TERMS_MAX);
    }
    for (int k = 0; k < POSE; k++) {
        for (int a = 0; a < terms; a++) {
            g[a] -= n->mixed[k][a] * n->side[k];
            for (int b = 0; b < terms; b++) {
                H[a * terms + b] -= n->mixed[k][a] * n->mixed[k][b];
            }
        }
    }
}

void adjust_target_add(const struct camera_view *view, struct adjust_target *target, int terms,
                       double *H, double *g) {
    struct normal n;
    memset(&n, 0, sizeof n);
    if (!settle(view, target)) {
        return;
    }
    for (int s = 0; s < target->observations; s++) {
        const int first = VIEW_TERMS * target->observation[s].view;
        INVARIANT(first + VIEW_TERMS <= terms);
        struct row row;
        if (!look(view, target, &target->observation[s], &row)) {
            continue;
        }
        const double weight = weight_of(target, &row);
        add_pose(&row, weight, &n);
        for (int i = 0; i < 2; i++) {
            for (int a = 0; a < VIEW_TERMS; a++) {
                const double factor = weight * row.of_view[i][a];
                g[first + a] += factor * row.residual[i];
                for (int b = 0; b < VIEW_TERMS; b++) {
                    H[(first + a) * terms + first + b] += factor * row.of_view[i][b];
                }
                for (int b = 0; b < POSE; b++) {
                    n.mixed[b][first + a] += factor * row.of_pose[i][b];
                }
            }
        }
    }
    eliminate(&n, terms, H, g);
}
