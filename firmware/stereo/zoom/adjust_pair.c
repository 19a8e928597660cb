// SPDX-License-Identifier: Apache-2.0
#include "stereo/zoom/adjust_pair.h"

#include <math.h>
#include <string.h>

#include "core/error.h"
#include "core/invariant.h"
#include "core/order.h"

enum {
    TRACKS_MIN = 20,
    DISTINCT_MIN = 200,  // distinct points from which a pair with too few fits counts as lost
    SAMPLE = 8,          // tracks of a hypothesis
    HYPOTHESES = 300,
    SCORED_TRACKS_MAX = 512,  // tracks that count its support
    PASSES = 2,
    SERVED = 64,       // tracks between two calls of who watches
    CORNER_REACH = 3,  // px of the level by which the corners of the same thing may differ
};

// The noise assumed of a match before it is measured, and the smallest accepted afterwards: the
// error that the alignment of small windows leaves common to neighbours.
static const double first_noise_px = 0.5, least_noise_px = 0.02;
static const double outlier_sigmas = 4;
// A track supports a hypothesis within this many px.
static const double support_px = 1.5;

bool adjust_pair_is_lost(const struct adjust_report *report) {
    return report->used == 0 && report->corners >= DISTINCT_MIN;
}

const char *adjust_health_text(enum adjust_health health) {
    static const char *const texts[] = {"good", "touch up", "calibrate"};
    INVARIANT((int)health >= 0 && health <= ADJUST_CALIBRATE);
    return texts[health];
}

// Matches of one pair; `track` is behind those of other pairs.
struct matches {
    const struct adjust_picture *picture;
    struct adjust_picture reduced;  // if smooth
    struct adjustment *adjustment;
    struct adjust_tracks *all;
    struct sparse_picture corners[2];
    struct sparse_pair *pair;
    struct adjust_track *track;
    // Change of a residual by one sigma of each independent unknown.
    float (*effect)[ADJUST_TERMS_MAX];
    float *residual, *work;
    int count;
};

static int find_matches(struct matches *m, struct arena *arena) {
    struct adjust_expectation expectation = {m->picture, m->adjustment,
                                             CORNER_REACH * m->corners[1].factor};
    const int count = sparse_match(&m->corners[0], &m->corners[1], adjust_expect,
                                   adjust_expect_serve, &expectation, arena, m->pair);
    m->count = count < 0 ? 0 : count;
    for (int i = 0; i < m->count; i++) {
        struct adjust_track *track = &m->track[i];
        *track = (struct adjust_track){.count = 2};
        memcpy(track->pixel_px[0], m->pair[i].left_px, sizeof track->pixel_px[0]);
        memcpy(track->pixel_px[1], m->pair[i].right_px, sizeof track->pixel_px[1]);
        for (int side = 0; side < 2; side++) {
            track->view[side] = adjust_view(m->picture->state, side);
            adjust_to_sensor(&m->picture->window[side], track->pixel_px[side]);
        }
    }
    return count < 0 ? count : ERROR_OK;
}

// Residuals of all tracks, and what the independent parts of the remaining uncertainty do to them.
static void linearize(struct matches *m) {
    INVARIANT(m->count <= SPARSE_LEFT_MAX);
    const struct adjustment *adjustment = m->adjustment;
    const double *factor =
        adjustment->posterior + adjust_view(m->picture->state, 0) * VIEW_TERMS * adjustment->terms;
    for (int i = 0; i < m->count; i++) {
        double residual, derivative[ADJUST_TERMS];
        struct adjust_track *track = &m->track[i];
        if (i % SERVED == 0) {
            watch_serve(&adjustment->watch);
        }
        track->rejected = !adjustment_track_epipolar(adjustment, track, &residual, derivative);
        m->residual[i] = track->rejected ? 1e6F : (float)residual;
        float *effect = m->effect[i];
        memset(effect, 0, sizeof m->effect[i]);
        for (int c = 0; c < ADJUST_TERMS && !track->rejected; c++) {
            const double *row = factor + c * adjustment->terms;
            for (int k = 0; k < adjustment->terms; k++) {
                effect[k] += (float)(derivative[c] * row[k]);
            }
        }
    }
}

static uint32_t next_random(uint32_t *state) {
    *state = *state * 1664525u + 1013904223u;
    return *state >> 8;
}

// Makes the equations diagonal (Gauss and Jordan); false if they are close to singular.
static bool eliminate(double M[SAMPLE][SAMPLE + 1]) {
    for (int i = 0; i < SAMPLE; i++) {
        if (!(M[i][i] > 1e-9)) {
            return false;
        }
        for (int k = 0; k < SAMPLE; k++) {
            const double factor = k == i ? 0 : M[k][i] / M[i][i];
            for (int j = i; j <= SAMPLE && k != i; j++) {
                M[k][j] -= factor * M[i][j];
            }
        }
    }
    return true;
}

// The parts that explain a sample of residuals with least surprise: A^T (A A^T + s^2)^-1 r.
static bool solve_map(const struct matches *m, const int sample[SAMPLE],
                      double parts[ADJUST_TERMS_MAX]) {
    double M[SAMPLE][SAMPLE + 1];
    INVARIANT(m->count >= SAMPLE);
    for (int i = 0; i < SAMPLE; i++) {
        const float *a = m->effect[sample[i]];
        for (int j = 0; j < SAMPLE; j++) {
            const float *b = m->effect[sample[j]];
            float sum = 0;
            for (int k = 0; k < m->adjustment->terms; k++) {
                sum += a[k] * b[k];
            }
            M[i][j] = (double)sum + (i == j ? first_noise_px * first_noise_px : 0);
        }
        M[i][SAMPLE] = (double)m->residual[sample[i]];
    }
    if (!eliminate(M)) {
        return false;
    }
    memset(parts, 0, ADJUST_TERMS_MAX * sizeof *parts);
    for (int i = 0; i < SAMPLE; i++) {
        const double weight = M[i][SAMPLE] / M[i][i];
        for (int k = 0; k < m->adjustment->terms; k++) {
            parts[k] += weight * (double)m->effect[sample[i]][k];
        }
    }
    return true;
}

static double remaining(const struct matches *m, int i, const double parts[ADJUST_TERMS_MAX]) {
    double rest = (double)m->residual[i];
    for (int k = 0; k < m->adjustment->terms; k++) {
        rest -= parts[k] * (double)m->effect[i][k];
    }
    return rest < 0 ? -rest : rest;
}

// Rejects the tracks that the hypothesis with the most support does not explain. Returns the number
// of the others.
static int ransac_inliers(struct matches *m) {
    uint32_t random = 1;
    double best_parts[ADJUST_TERMS_MAX] = {0}, best_score = -1;
    const int scored_step = m->count / SCORED_TRACKS_MAX + 1;
    for (int round = 0; round < HYPOTHESES && m->count >= TRACKS_MIN; round++) {
        int sample[SAMPLE];
        double parts[ADJUST_TERMS_MAX], score = 0;
        watch_serve(&m->adjustment->watch);
        for (int i = 0; i < SAMPLE; i++) {
            sample[i] = (int)(next_random(&random) % (uint32_t)m->count);
        }
        if (!solve_map(m, sample, parts)) {
            continue;
        }
        for (int i = 0; i < m->count; i += scored_step) {
            const double rest = remaining(m, i, parts) / support_px;
            score += rest < 1 ? 1 - rest * rest : 0;
        }
        if (score > best_score) {
            best_score = score;
            memcpy(best_parts, parts, sizeof parts);
        }
    }
    int kept = 0;
    for (int i = 0; i < m->count; i++) {
        m->track[i].rejected = m->track[i].rejected || remaining(m, i, best_parts) > support_px;
        kept += !m->track[i].rejected;
    }
    return kept;
}

// Median of the kept tracks' residuals.
static double median_residual(struct matches *m) {
    int n = 0;
    for (int i = 0; i < m->count; i++) {
        if (!m->track[i].rejected) {
            m->work[n++] = (float)m->track[i].residual;
        }
    }
    return (double)order_statistic(m->work, n, n / 2);
}

static double noise_of(double median_px) {
    const double noise = 1.4826 * median_px;
    return noise > least_noise_px ? noise : least_noise_px;
}

static double median_depth(struct matches *m) {
    int n = 0;
    for (int i = 0; i < m->count; i++) {
        if (!m->track[i].rejected && m->track[i].point.w > 0) {
            m->work[n++] = (float)(1 / m->track[i].point.w);
        }
    }
    return (double)order_statistic(m->work, n, n / 2);
}

// Rejects the tracks outside of the noise. Returns the number of the others.
static int reject(struct matches *m, double noise_px, double *rms_px) {
    int kept = 0;
    double square = 0;
    for (int i = 0; i < m->count; i++) {
        struct adjust_track *track = &m->track[i];
        track->rejected = track->rejected || track->residual > outlier_sigmas * noise_px;
        kept += !track->rejected;
        square += track->rejected ? 0 : track->residual * track->residual;
    }
    *rms_px = kept > 0 ? sqrt(square / kept) : 0;
    return kept;
}

// Fits all tracks, estimates the noise of these, and rejects what lies outside of it. The median
// finds outliers; the noise of the others, which has longer tails than a normal one, is their rms.
static int fit(struct matches *m, struct adjust_report *report) {
    int kept = 0;
    report->noise_px = first_noise_px;
    for (int round = 0; round < 3; round++) {
        for (int i = 0; i < m->count; i++) {
            m->track[i].sigma_px = report->noise_px;
        }
        (void)adjustment_solve(m->adjustment, m->all->track, m->all->count + m->count);
        const double median_px = median_residual(m);
        double rms_px;
        report->rows_px = median_px * sqrt(2.0);
        report->noise_px = noise_of(median_px);
        kept = reject(m, report->noise_px, &rms_px);
        report->noise_px = rms_px > report->noise_px ? rms_px : report->noise_px;
    }
    return kept;
}

// Keeps those that fit, behind the others.
static void keep(struct matches *m) {
    INVARIANT(m->all->count + m->count <= m->all->max);
    for (int i = 0; i < m->count; i++) {
        if (!m->track[i].rejected) {
            m->all->track[m->all->count++] = m->track[i];
        }
    }
}

// ERROR_MEMORY, ERROR_TOO_SMALL.
static int find_corners(const struct matches *m, const struct adjust_picture *picture,
                        struct arena *arena, struct sparse_picture corners[2]) {
    for (int side = 0; side < 2; side++) {
        watch_serve(&m->adjustment->watch);
        const int error = sparse_picture_make(&picture->grey[side],
                                              side == 0 ? SPARSE_LEFT_MAX : SPARSE_RIGHT_MAX, arena,
                                              &corners[side]);
        if (error != ERROR_OK) {
            return error;
        }
    }
    return ERROR_OK;
}

// The same pictures with `factor` times fewer pixels along each side. ERROR_MEMORY.
static int reduce(const struct adjust_picture *picture, int factor, struct arena *arena,
                  struct adjust_picture *reduced) {
    INVARIANT(factor > 1);
    *reduced = *picture;
    for (int side = 0; side < 2; side++) {
        const int width = picture->grey[side].width / factor;
        const int height = picture->grey[side].height / factor;
        struct calibration_window *window = &reduced->window[side];
        reduced->grey[side] = (struct image_u8){
            arena_take(arena, (size_t)width * (size_t)height, 1), width, height, width};
        if (reduced->grey[side].data == NULL) {
            return ERROR_MEMORY;
        }
        sparse_reduce(&picture->grey[side], factor, &reduced->grey[side]);
        // A mean is in the middle of its pixels, where `early_px` has what a sensor skips.
        window->column_px += (factor - 1) * window->skip;
        window->row_px += (factor - 1) * window->skip;
        window->skip *= factor;
    }
    return ERROR_OK;
}

// Of smooth pictures, which have few corners, those of the reduced ones if these have more.
static int choose_corners(struct matches *m, struct arena *arena) {
    int error = find_corners(m, m->picture, arena, m->corners);
    if (error != ERROR_OK || m->corners[0].count >= DISTINCT_MIN) {
        return error;
    }
    struct sparse_picture corners[2];
    error = reduce(m->picture, 2 * m->corners[0].factor, arena, &m->reduced);
    error = error == ERROR_OK ? find_corners(m, &m->reduced, arena, corners) : error;
    if (error == ERROR_OK && corners[0].count > m->corners[0].count) {
        m->picture = &m->reduced;
        memcpy(m->corners, corners, sizeof corners);
    }
    return error == ERROR_TOO_SMALL ? ERROR_OK : error;
}

static int run(struct matches *m, struct arena *arena, struct adjust_report *report) {
    const int found = choose_corners(m, arena);
    if (found != ERROR_OK) {
        return found == ERROR_TOO_SMALL ? ERROR_OK : found;
    }
    report->corners = m->corners[0].count;
    // First where the prior allows; then, better known, where the first pass allows, which
    // separates more of the points.
    for (int pass = 0; pass < PASSES; pass++) {
        const int error = find_matches(m, arena);
        if (error != ERROR_OK) {
            return error;
        }
        (void)adjustment_solve(m->adjustment, m->all->track, m->all->count);
        report->matches = m->count;
        linearize(m);
        report->used = 0;
        if (ransac_inliers(m) < TRACKS_MIN) {
            return ERROR_OK;
        }
        report->rows_before_px = median_residual(m) * sqrt(2.0);
        report->used = fit(m, report);
        if (report->used < TRACKS_MIN) {
            report->used = 0;
            return ERROR_OK;
        }
    }
    keep(m);
    return ERROR_OK;
}

int adjust_pair_match(const struct adjust_picture *picture, struct arena *arena,
                      struct adjustment *adjustment, struct adjust_tracks *tracks,
                      struct adjust_report *report) {
    const size_t mark = arena_mark(arena);
    *report = (struct adjust_report){0};
    INVARIANT(tracks->count + SPARSE_LEFT_MAX <= tracks->max);
    struct matches m = {.picture = picture,
                        .adjustment = adjustment,
                        .all = tracks,
                        .track = tracks->track + tracks->count};
    m.pair = arena_take(arena, SPARSE_LEFT_MAX, sizeof *m.pair);
    m.effect = arena_take(arena, SPARSE_LEFT_MAX, sizeof *m.effect);
    m.residual = arena_take(arena, SPARSE_LEFT_MAX, sizeof *m.residual);
    m.work = arena_take(arena, SPARSE_LEFT_MAX, sizeof *m.work);
    int error = ERROR_MEMORY;
    if (m.pair != NULL && m.effect != NULL && m.residual != NULL && m.work != NULL) {
        error = run(&m, arena, report);
    }
    if (error == ERROR_OK && report->used == 0) {
        (void)adjustment_solve(adjustment, tracks->track, tracks->count);
    }
    if (error == ERROR_OK && report->used > 0) {
        report->depth_mm = median_depth(&m);
    }
    arena_release(arena, mark);
    return error;
}

size_t adjust_pair_match_need_bytes(int width, int height) {
    return arena_need_bytes(SPARSE_LEFT_MAX, sizeof(struct sparse_pair)) +
           arena_need_bytes(SPARSE_LEFT_MAX, ADJUST_TERMS_MAX * sizeof(float)) +
           2 * arena_need_bytes(SPARSE_LEFT_MAX, sizeof(float)) +
           sparse_picture_need_bytes(width, height, SPARSE_LEFT_MAX) +
           sparse_picture_need_bytes(width, height, SPARSE_RIGHT_MAX) +
           // The reduced ones.
           2 * arena_need_bytes((size_t)(width / 2) * (size_t)(height / 2), 1) +
           sparse_picture_need_bytes(width / 2, height / 2, SPARSE_LEFT_MAX) +
           sparse_picture_need_bytes(width / 2, height / 2, SPARSE_RIGHT_MAX) +
           sparse_match_need_bytes(SPARSE_LEFT_MAX, SPARSE_RIGHT_MAX);
}

// Corrections larger than the prior allows say that it is too small also for what they do not show.
static struct adjust_sigma sigma_of(const struct adjustment *adjustment, double growth,
                                    const double *gradient) {
    return (struct adjust_sigma){adjust_prior_sigma(adjustment, gradient),
                                 growth * adjust_posterior_sigma(adjustment, gradient)};
}

void adjust_pair_assess(const struct adjust_picture *picture, const struct adjustment *adjustment,
                        struct adjust_report *report) {
    const int left = VIEW_TERMS * adjust_view(picture->state, 0);
    const int right = VIEW_TERMS * adjust_view(picture->state, 1);
    const double growth = adjust_birge_ratio(adjustment);
    double gradient[ADJUST_TERMS_MAX] = {0};
    INVARIANT(right + VIEW_TERMS <= adjustment->terms && picture->depth_near_mm > 0);
    gradient[left + VIEW_FOCAL] = gradient[right + VIEW_FOCAL] = 0.5;
    report->focal = sigma_of(adjustment, growth, gradient);
    gradient[left + VIEW_FOCAL] = -1;
    gradient[right + VIEW_FOCAL] = 1;
    report->ratio = sigma_of(adjustment, growth, gradient);
    memset(gradient, 0, sizeof gradient);
    gradient[left + VIEW_ROTATION_Y] = -1;
    gradient[right + VIEW_ROTATION_Y] = 1;
    report->vergence_rad = sigma_of(adjustment, growth, gradient);
    report->depth_mm = report->used > 0 ? report->depth_mm : 2 * picture->depth_near_mm;
    double px[2] = {0.5 * picture->grey[0].width, 0.5 * picture->grey[0].height};
    adjust_to_sensor(&picture->window[0], px);
    if (adjustment_depth_gradient(adjustment, picture->state, px, report->depth_mm, gradient)) {
        report->depth = sigma_of(adjustment, growth, gradient);
    }
    report->chi_square_score = adjust_chi_square_score(adjustment);
    // Rows may fit while the depth does not: the word considers both. Where a sensor skips pixels,
    // texture aliases, and matches alone are so far apart: 0.5 px at every 4th, 0.9 at every 6th.
    const bool apart = report->rows_px > 0.6 && picture->window[0].skip <= 1;
    const bool misfit = report->used > 0 && (report->chi_square_score > 4 || apart);
    report->health = ADJUST_GOOD;
    if (misfit || adjust_pair_is_lost(report)) {
        report->health = ADJUST_CALIBRATE;
    } else if (report->used == 0 || report->depth.after > 2.5e-3 * report->depth_mm) {
        report->health = ADJUST_TOUCH_UP;
    }
}

int adjust_pair(const struct adjust_picture *picture, struct arena *arena,
                struct adjustment *adjustment, struct adjust_report *report) {
    const size_t mark = arena_mark(arena);
    struct adjust_tracks tracks = {arena_take(arena, SPARSE_LEFT_MAX, sizeof *tracks.track), 0,
                                   SPARSE_LEFT_MAX};
    const int error = tracks.track == NULL
                          ? ERROR_MEMORY
                          : adjust_pair_match(picture, arena, adjustment, &tracks, report);
    if (error == ERROR_OK) {
        adjust_pair_assess(picture, adjustment, report);
    }
    arena_release(arena, mark);
    return error;
}

size_t adjust_pair_need_bytes(int width, int height) {
    return arena_need_bytes(SPARSE_LEFT_MAX, sizeof(struct adjust_track)) +
           adjust_pair_match_need_bytes(width, height);
}

// The lens of a window of the sensor.
static void to_window(const struct calibration_window *window, const struct image_u8 *grey,
                      struct lens *lens) {
    INVARIANT(window->skip >= 1);
    double centre[2] = {lens->cx_px, lens->cy_px};
    adjust_from_sensor(window, centre);
    lens->cx_px = centre[0];
    lens->cy_px = centre[1];
    lens->fx_px /= window->skip;
    lens->fy_px /= window->skip;
    lens->width_px = grey->width;
    lens->height_px = grey->height;
}

int adjust_conclude(const struct zoom_calibration *calibration,
                    const struct adjust_picture *picture, const struct adjustment *adjustment,
                    const struct adjust_report *report, struct calibration *result,
                    struct calibration_fault *fault) {
    struct calibration adjusted;
    const struct camera_view *view = &adjustment->view[adjust_view(picture->state, 0)];
    int error = zoom_calibration_at(calibration, &picture->axes, &adjusted, fault);
    if (error == ERROR_OK) {
        camera_view_pair(&view[0], &view[1], &adjusted);
        to_window(&picture->window[0], &picture->grey[0], &adjusted.left);
        to_window(&picture->window[1], &picture->grey[1], &adjusted.right);
        adjusted.origin.side[0].window = picture->window[0];
        adjusted.origin.side[1].window = picture->window[1];
        // What remains unknown, at the depth of the scene: as an angle, beside the scale.
        adjusted.scale_sigma = calibration->scale_sigma;
        adjusted.yaw_sigma_rad = report->depth.after * calibration_baseline_mm(&adjusted) /
                                 (report->depth_mm * report->depth_mm);
        error = calibration_round(&adjusted);
    }
    if (error == ERROR_OK) {
        error = calibration_validate(&adjusted, fault);
    }
    if (error == ERROR_OK) {
        *result = adjusted;
    }
    return error;
}

int adjust_calibration(const struct zoom_calibration *calibration,
                       const struct adjust_picture *picture, struct arena *arena,
                       struct calibration *result, struct adjust_report *report,
                       struct calibration_fault *fault) {
    const size_t mark = arena_mark(arena);
    struct adjustment adjustment;
    int error = zoom_state_check(calibration, &picture->axes, fault);
    if (error == ERROR_OK) {
        error = adjustment_begin(calibration, &picture->axes, 1, arena, &adjustment);
    }
    if (error == ERROR_OK) {
        error = adjust_pair(picture, arena, &adjustment, report);
    }
    if (error == ERROR_OK) {
        error = adjust_conclude(calibration, picture, &adjustment, report, result, fault);
    }
    arena_release(arena, mark);
    return error;
}

size_t adjust_calibration_need_bytes(int width, int height) {
    return adjustment_need_bytes(1) + adjust_pair_need_bytes(width, height);
}
