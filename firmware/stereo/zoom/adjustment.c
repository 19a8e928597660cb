// SPDX-License-Identifier: Apache-2.0
#include "stereo/zoom/adjustment.h"

#include <math.h>
#include <string.h>

#include "core/cholesky.h"
#include "core/error.h"
#include "core/invariant.h"
#include "stereo/geometry/geometry.h"

enum {
    ROWS_MAX = 2 * ADJUST_SEEN_MAX,
    COLUMNS_MAX = ADJUST_SEEN_MAX * VIEW_TERMS,
    PLACE_STEPS = 3,
    SOLVE_STEPS = 8,
    TRACKS_SERVED = 64,  // tracks between two calls of who watches
};

// A pivot below this share of a variance: a value without variance of its own.
static const double no_variance = 1e-11;

// Scale of the Cauchy weights in standard deviations: 95 % efficient for Gaussian noise.
static const double cauchy_sigmas = 2.385;

static void update_views(struct adjustment *adjustment) {
    for (int i = 0; i < adjustment->views; i++) {
        camera_view_correct(&adjustment->nominal[i], adjustment->correction + VIEW_TERMS * i,
                            &adjustment->view[i]);
    }
}

int adjustment_begin(const struct zoom_calibration *calibration, const struct zoom_state *state,
                     int states, struct arena *arena, struct adjustment *adjustment) {
    INVARIANT(states >= 1 && states <= ADJUST_STATES_MAX);
    memset(adjustment, 0, sizeof *adjustment);
    adjustment->views = 2 * states;
    adjustment->terms = adjustment->views * VIEW_TERMS;
    const size_t size = (size_t)adjustment->terms * (size_t)adjustment->terms;
    adjustment->prior = arena_take(arena, size, sizeof(double));
    adjustment->posterior = arena_take(arena, size, sizeof(double));
    adjustment->work = arena_take(arena, 3 * size, sizeof(double));
    if (adjustment->prior == NULL || adjustment->posterior == NULL || adjustment->work == NULL) {
        return ERROR_MEMORY;
    }
    for (int i = 0; i < states; i++) {
        struct zoom_pair pair;
        zoom_pair_at(calibration->camera, &state[i], &pair);
        for (int side = 0; side < 2; side++) {
            struct camera_view *view = &adjustment->nominal[adjust_view(i, side)];
            view->lens = pair.side[side].lens;
            memcpy(view->R_instrument_camera, pair.side[side].R_instrument_camera,
                   sizeof view->R_instrument_camera);
            memcpy(view->position_mm, pair.side[side].position_mm, sizeof view->position_mm);
        }
    }
    memset(adjustment->prior, 0, size * sizeof(double));
    const int error = adjust_prior_covariance(calibration, state, states, arena, adjustment->prior);
    if (error != ERROR_OK) {
        return error;
    }
    cholesky_factorize(adjustment->prior, adjustment->terms, no_variance);
    memcpy(adjustment->posterior, adjustment->prior, size * sizeof(double));
    update_views(adjustment);
    return ERROR_OK;
}

size_t adjustment_need_bytes(int states) {
    const size_t terms = 2 * (size_t)states * VIEW_TERMS;
    return 2 * arena_need_bytes(terms * terms, sizeof(double)) +
           arena_need_bytes(3 * terms * terms, sizeof(double)) + adjust_prior_need_bytes(states);
}

// A track's equations at the present views and point: residuals, and derivatives of the predicted
// pixels. Columns are those of the views in the order of the observations.
struct equations {
    int rows, columns;
    int unknowns;  // unknowns of the point: x, y, and w unless it is at infinity
    double residual[ROWS_MAX];
    double of_view[ROWS_MAX][COLUMNS_MAX];
    double of_point[ROWS_MAX][3];
    double triangle[3][3];  // of_point = basis triangle, once orthonormal
};

static bool write_equations(const struct adjustment *adjustment, const struct adjust_track *track,
                            struct equations *e) {
    INVARIANT(track->count >= 2 && track->count <= ADJUST_SEEN_MAX);
    e->rows = 2 * track->count;
    e->columns = VIEW_TERMS * track->count;
    e->unknowns = track->at_infinity ? 2 : 3;
    INVARIANT(e->rows <= ROWS_MAX && e->columns <= COLUMNS_MAX);
    for (int i = 0; i < track->count; i++) {
        double pixel[2], of_view[2][VIEW_TERMS];
        INVARIANT(track->view[i] >= 0 && track->view[i] < adjustment->views);
        if (!camera_view_project(&adjustment->view[track->view[i]], &track->point, pixel, of_view,
                                 e->of_point + 2 * i)) {
            return false;
        }
        for (int k = 0; k < 2; k++) {
            double *row = e->of_view[2 * i + k];
            memset(row, 0, (size_t)e->columns * sizeof *row);
            memcpy(row + VIEW_TERMS * i, of_view[k], sizeof of_view[k]);
            e->residual[2 * i + k] = track->pixel_px[i][k] - pixel[k];
        }
    }
    return true;
}

// Makes the columns of `of_point` orthonormal (modified Gram-Schmidt). False if they are dependent.
static bool orthonormalize(struct equations *e) {
    for (int j = 0; j < e->unknowns; j++) {
        double before = 0, after = 0;
        for (int i = 0; i < e->rows; i++) {
            before += e->of_point[i][j] * e->of_point[i][j];
        }
        for (int k = 0; k < j; k++) {
            double product = 0;
            for (int i = 0; i < e->rows; i++) {
                product += e->of_point[i][k] * e->of_point[i][j];
            }
            for (int i = 0; i < e->rows; i++) {
                e->of_point[i][j] -= product * e->of_point[i][k];
            }
            e->triangle[k][j] = product;
        }
        for (int i = 0; i < e->rows; i++) {
            after += e->of_point[i][j] * e->of_point[i][j];
        }
        if (!(after > 1e-16 * before)) {
            return false;
        }
        e->triangle[j][j] = sqrt(after);
        for (int i = 0; i < e->rows; i++) {
            e->of_point[i][j] /= e->triangle[j][j];
        }
    }
    return true;
}

// The change of the point that fits residuals of which `projected` are the parts along the basis.
static void point_change(const struct equations *e, const double projected[3], double change[3]) {
    change[2] = 0;
    for (int j = e->unknowns - 1; j >= 0; j--) {
        double rest = projected[j];
        for (int k = j + 1; k < e->unknowns; k++) {
            rest -= e->triangle[j][k] * change[k];
        }
        change[j] = rest / e->triangle[j][j];
    }
}

static void project_residual(const struct equations *e, double projected[3]) {
    for (int j = 0; j < e->unknowns; j++) {
        projected[j] = 0;
        for (int i = 0; i < e->rows; i++) {
            projected[j] += e->of_point[i][j] * e->residual[i];
        }
    }
}

// The point on the first ray that is nearest in direction to the second.
static bool start_point(const struct adjustment *adjustment, struct adjust_track *track) {
    const struct camera_view *a = &adjustment->view[track->view[0]],
                             *b = &adjustment->view[track->view[1]];
    double first[3], second[3], arm[3], first_x[3], arm_x[3];
    if (!camera_view_ray(a, track->pixel_px[0], first) ||
        !camera_view_ray(b, track->pixel_px[1], second) || !(first[2] > 0)) {
        return false;
    }
    for (int i = 0; i < 3; i++) {
        track->point.origin_mm[i] = a->position_mm[i];
        arm[i] = a->position_mm[i] - b->position_mm[i];
    }
    first[0] /= first[2];
    first[1] /= first[2];
    first[2] = 1;
    geometry_cross(second, first, first_x);
    geometry_cross(second, arm, arm_x);
    const double square = geometry_dot(arm_x, arm_x);
    track->point.x = first[0];
    track->point.y = first[1];
    track->point.w = square > 0 && !track->at_infinity ? -geometry_dot(first_x, arm_x) / square : 0;
    return true;
}

bool adjustment_track_place(const struct adjustment *adjustment, struct adjust_track *track) {
    track->is_placed = start_point(adjustment, track);
    for (int step = 0; step < PLACE_STEPS && track->is_placed; step++) {
        struct equations e;
        double projected[3], change[3];
        track->is_placed = write_equations(adjustment, track, &e) && orthonormalize(&e);
        if (track->is_placed) {
            project_residual(&e, projected);
            point_change(&e, projected, change);
            track->point.x += change[0];
            track->point.y += change[1];
            track->point.w += change[2];
        }
    }
    return track->is_placed;
}

// Removes from residuals and derivatives what a change of the point absorbs.
static void remove_point(struct equations *e) {
    double projected[3];
    project_residual(e, projected);
    for (int j = 0; j < e->unknowns; j++) {
        for (int i = 0; i < e->rows; i++) {
            e->residual[i] -= e->of_point[i][j] * projected[j];
        }
        double mixed[COLUMNS_MAX] = {0};
        for (int i = 0; i < e->rows; i++) {
            for (int c = 0; c < e->columns; c++) {
                mixed[c] += e->of_point[i][j] * e->of_view[i][c];
            }
        }
        for (int i = 0; i < e->rows; i++) {
            for (int c = 0; c < e->columns; c++) {
                e->of_view[i][c] -= e->of_point[i][j] * mixed[c];
            }
        }
    }
}

// The one equation that a point leaves of the four of two observations: the longest of the unit
// vectors less their parts along the basis gives its direction.
static void remove_point_of_two(struct equations *e) {
    double normal[4] = {0}, longest = 0;
    for (int k = 0; k < 4; k++) {
        double rest[4], square = 0;
        for (int i = 0; i < 4; i++) {
            rest[i] = i == k;
            for (int j = 0; j < 3; j++) {
                rest[i] -= e->of_point[i][j] * e->of_point[k][j];
            }
            square += rest[i] * rest[i];
        }
        if (square > longest) {
            longest = square;
            memcpy(normal, rest, sizeof rest);
        }
    }
    const double scale = 1 / sqrt(longest);
    double residual = 0;
    for (int i = 0; i < 4; i++) {
        normal[i] *= scale;
        residual += normal[i] * e->residual[i];
    }
    e->residual[0] = residual;
    for (int c = 0; c < e->columns; c++) {
        e->of_view[0][c] = normal[0] * e->of_view[0][c] + normal[1] * e->of_view[1][c] +
                           normal[2] * e->of_view[2][c] + normal[3] * e->of_view[3][c];
    }
    e->rows = 1;
}

// Writes a track's equations at its point, moves the point to where it fits best, and leaves what
// it does not absorb.
static bool reduce(const struct adjustment *adjustment, struct adjust_track *track,
                   struct equations *e) {
    double projected[3], change[3], sum = 0;
    if (!write_equations(adjustment, track, e) || !orthonormalize(e)) {
        return false;
    }
    project_residual(e, projected);
    point_change(e, projected, change);
    track->point.x += change[0];
    track->point.y += change[1];
    track->point.w += change[2];
    const int freedom = e->rows - e->unknowns;
    if (track->count == 2 && !track->at_infinity) {
        remove_point_of_two(e);
    } else {
        remove_point(e);
    }
    for (int i = 0; i < e->rows; i++) {
        sum += e->residual[i] * e->residual[i];
    }
    track->residual = sqrt(sum / freedom);
    return true;
}

// The same from the point of a fit before, or else from where the first two observations meet.
static bool place_and_reduce(const struct adjustment *adjustment, struct adjust_track *track,
                             struct equations *e) {
    if (track->is_placed && reduce(adjustment, track, e)) {
        return true;
    }
    return adjustment_track_place(adjustment, track) && reduce(adjustment, track, e);
}

bool adjustment_track_epipolar(const struct adjustment *adjustment, struct adjust_track *track,
                               double *residual_px, double derivative[2 * VIEW_TERMS]) {
    struct equations e;
    INVARIANT(track->count == 2);
    if (!adjustment_track_place(adjustment, track) || !reduce(adjustment, track, &e)) {
        return false;
    }
    *residual_px = e.residual[0];
    memcpy(derivative, e.of_view[0], 2 * VIEW_TERMS * sizeof *derivative);
    return true;
}

// Adds the weighted equations to the normal ones.
static void accumulate(const struct adjust_track *track, const struct equations *e, double weight,
                       int terms, double *H, double *g) {
    for (int a = 0; a < e->columns; a++) {
        const int i = VIEW_TERMS * track->view[a / VIEW_TERMS] + a % VIEW_TERMS;
        for (int row = 0; row < e->rows; row++) {
            const double factor = weight * e->of_view[row][a];
            g[i] += factor * e->residual[row];
            for (int k = 0; k < track->count; k++) {
                double *target = H + i * terms + VIEW_TERMS * track->view[k];
                const double *source = e->of_view[row] + VIEW_TERMS * k;
                for (int b = 0; b < VIEW_TERMS; b++) {
                    target[b] += factor * source[b];
                }
            }
        }
    }
}

// result = A^T B, square matrices.
static void multiply_transposed(const double *A, const double *B, int n, double *result) {
    memset(result, 0, (size_t)n * (size_t)n * sizeof *result);
    for (int k = 0; k < n; k++) {
        for (int i = 0; i < n; i++) {
            const double factor = A[k * n + i];
            for (int j = 0; j < n && factor != 0; j++) {
                result[i * n + j] += factor * B[k * n + j];
            }
        }
    }
}

// From the normal equations for corrections from zero.
static void set_pull(struct adjustment *adjustment, const double *H, const double *g) {
    for (int i = 0; i < adjustment->terms; i++) {
        adjustment->pull[i] = g[i];
        for (int j = 0; j < adjustment->terms; j++) {
            adjustment->pull[i] -= H[i * adjustment->terms + j] * adjustment->correction[j];
        }
    }
}

// The most probable corrections for the normal equations, and what remains unknown.
static void conclude(struct adjustment *adjustment, double *H, double *g) {
    const int n = adjustment->terms;
    double *L = adjustment->prior, *mixed = adjustment->work + (size_t)n * (size_t)n,
           *M = adjustment->work + 2 * (size_t)n * (size_t)n;
    for (int i = 0; i < n; i++) {
        for (int j = 0; j < n; j++) {
            g[i] += H[i * n + j] * adjustment->correction[j];
        }
    }
    multiply_transposed(H, L, n, mixed);  // H is symmetric
    multiply_transposed(L, mixed, n, M);
    for (int i = 0; i < n; i++) {
        M[i * n + i] += 1;
    }
    cholesky_factorize(M, n, no_variance);
    // Column by column: G^-1 L^T, whose transpose is the factor of the posterior.
    double *F = adjustment->posterior;
    for (int row = 0; row < n; row++) {
        for (int i = 0; i < n; i++) {
            double rest = L[row * n + i];
            for (int k = 0; k < i; k++) {
                rest -= M[i * n + k] * F[row * n + k];
            }
            F[row * n + i] = rest / M[i * n + i];
        }
    }
    for (int i = 0; i < n; i++) {
        double *along = mixed + i;  // F^T g
        *along = 0;
        for (int k = 0; k < n; k++) {
            *along += F[k * n + i] * g[k];
        }
    }
    for (int i = 0; i < n; i++) {
        adjustment->correction[i] = 0;
        for (int k = 0; k < n; k++) {
            adjustment->correction[i] += F[i * n + k] * mixed[k];
        }
    }
    set_pull(adjustment, H, g);
    update_views(adjustment);
}

// The largest change of a correction, squared, in variances of what remains unknown.
static double change_since(const struct adjustment *adjustment, const double *before) {
    const int n = adjustment->terms;
    double change = 0;
    for (int i = 0; i < n; i++) {
        double variance = 0;
        for (int k = 0; k < n; k++) {
            variance += adjustment->posterior[i * n + k] * adjustment->posterior[i * n + k];
        }
        const double move = adjustment->correction[i] - before[i];
        if (variance > 0 && move * move > change * variance) {
            change = move * move / variance;
        }
    }
    return change;
}

int adjustment_solve(struct adjustment *adjustment, struct adjust_track *tracks, int count) {
    const int n = adjustment->terms;
    INVARIANT(n > 0 && n <= ADJUST_TERMS_MAX && count >= 0);
    double *H = adjustment->work, g[ADJUST_TERMS_MAX];
    int used = 0;
    for (int step = 0; step < SOLVE_STEPS; step++) {
        memset(H, 0, (size_t)n * (size_t)n * sizeof *H);
        memset(g, 0, sizeof g);
        used = 0;
        for (int i = 0; i < count; i++) {
            struct equations e;
            if (i % TRACKS_SERVED == 0) {
                watch_serve(&adjustment->watch);
            }
            if (tracks[i].rejected || !place_and_reduce(adjustment, &tracks[i], &e)) {
                continue;
            }
            const double sigma_px = tracks[i].sigma_px;
            INVARIANT(sigma_px > 0);
            const double deviation = tracks[i].residual / (sigma_px * cauchy_sigmas);
            const double weight = 1 / ((1 + deviation * deviation) * sigma_px * sigma_px);
            accumulate(&tracks[i], &e, weight, n, H, g);
            used++;
        }
        if (adjustment->target != NULL) {
            adjust_target_add(adjustment->view, adjustment->target, n, H, g);
        }
        double before[ADJUST_TERMS_MAX];
        memcpy(before, adjustment->correction, sizeof before);
        conclude(adjustment, H, g);
        if (change_since(adjustment, before) < 1e-4) {
            break;
        }
    }
    return used;
}

bool adjustment_depth_gradient(const struct adjustment *adjustment, int state,
                               const double left_px[2], double depth_mm,
                               double gradient[ADJUST_TERMS_MAX]) {
    INVARIANT(adjust_view(state, 1) < adjustment->views && depth_mm > 0);
    memset(gradient, 0, ADJUST_TERMS_MAX * sizeof *gradient);
    struct adjust_track track = {.count = 2,
                                 .view = {adjust_view(state, 0), adjust_view(state, 1)}};
    const struct camera_view *left = &adjustment->view[track.view[0]];
    const double *R = left->R_instrument_camera;
    double ray[3];
    if (!camera_view_ray(left, left_px, ray) || !(ray[2] > 0)) {
        return false;
    }
    const double forward[3] = {R[2], R[5], R[8]};
    memcpy(track.point.origin_mm, left->position_mm, sizeof left->position_mm);
    track.point.x = ray[0] / ray[2];
    track.point.y = ray[1] / ray[2];
    // Depth along the camera's axis is a part of the length along the ray.
    const double along = geometry_dot(forward, ray) / ray[2];
    track.point.w = along / depth_mm;
    for (int i = 0; i < 2; i++) {
        if (!camera_view_project(&adjustment->view[track.view[i]], &track.point, track.pixel_px[i],
                                 NULL, NULL)) {
            return false;
        }
    }
    struct equations e;
    if (!write_equations(adjustment, &track, &e) || !orthonormalize(&e)) {
        return false;
    }
    const double w = track.point.w;
    for (int c = 0; c < e.columns; c++) {
        double projected[3] = {0}, change[3];
        for (int j = 0; j < 3; j++) {
            for (int i = 0; i < e.rows; i++) {
                projected[j] -= e.of_point[i][j] * e.of_view[i][c];
            }
        }
        point_change(&e, projected, change);
        gradient[VIEW_TERMS * track.view[c / VIEW_TERMS] + c % VIEW_TERMS] =
            (forward[0] * change[0] + forward[1] * change[1]) / w - along * change[2] / (w * w);
    }
    // The depth refers to the left camera, which moves, too.
    double *of_left = gradient + VIEW_TERMS * track.view[0];
    const double offset[3] = {track.point.x / w, track.point.y / w, 1 / w};
    double of_turn[3];
    geometry_cross(forward, offset, of_turn);
    for (int i = 0; i < 3; i++) {
        of_left[VIEW_ROTATION_X + i] += of_turn[i];
        of_left[VIEW_POSITION_X + i] -= forward[i];
    }
    return true;
}
