// SPDX-License-Identifier: Apache-2.0
#include "measure/zoom_expect.h"

#include <math.h>
#include <string.h>

#include "core/error.h"
#include "core/invariant.h"
#include "core/math.h"
#include "measure/measure_tuning.h"
#include "stereo/geometry/geometry.h"
#include "stereo/zoom/adjustment.h"

enum {
    TRACKS_MIN = 20,                       // as adjust_pair
    TRIES = 8,                             // points that are tried for each track
    TRACKS_MAX = 2 * MEASURE_MATCHES_MAX,  // of both pairs
    BOARD_SEEN_MAX = 2 * ZOOM_EXPECT_CORNERS_MAX,
    DRAWS_SERVED = 64,  // draws between two calls of who watches
};

// Relief of a scene of unknown depths, part of its distance.
static const double relief = 1.0 / 12;
// A board is held askew, rad: a plane across the axis would show less.
static const double board_turn_rad = 0.4;

struct scene {
    const struct zoom_expect_request *request;
    struct zoom_frames frames;
    struct zoom_field field;
    double near_mm, far_mm, sigma_px;
    int matches;
    uint32_t random;
    struct adjust_track *track;
    int count;
};

static double next_unit(uint32_t *state) {
    *state = *state * 1664525u + 1013904223u;
    return (double)(*state >> 8) / (1 << 24);
}

static bool shows(const struct scene *scene, int side, const double px[2]) {
    for (int axis = 0; axis < 2; axis++) {
        const struct zoom_range *edge = &scene->frames.edge_px[side][axis];
        if (!(px[axis] > edge->min && px[axis] < edge->max)) {
            return false;
        }
    }
    return true;
}

// Adds what both views of a state see of a point to a track; false if one does not see it.
static bool see(const struct scene *scene, const struct adjustment *adjustment, int state,
                struct adjust_track *track) {
    for (int side = 0; side < 2; side++) {
        const int view = adjust_view(state, side);
        double *px = track->pixel_px[track->count];
        if (!camera_view_project(&adjustment->view[view], &track->point, px, NULL, NULL) ||
            !shows(scene, side, px)) {
            return false;
        }
        track->view[track->count++] = view;
    }
    return true;
}

// A point of the scene, anywhere in the left picture of a state.
static bool draw_point(struct scene *scene, const struct adjustment *adjustment, int state,
                       struct far_point *point) {
    const struct camera_view *left = &adjustment->view[adjust_view(state, 0)];
    double px[2], ray[3];
    for (int axis = 0; axis < 2; axis++) {
        const struct zoom_range *edge = &scene->frames.edge_px[0][axis];
        px[axis] = edge->min + (edge->max - edge->min) * next_unit(&scene->random);
    }
    const double depth_mm =
        scene->near_mm + (scene->far_mm - scene->near_mm) * next_unit(&scene->random);
    if (!camera_view_ray(left, px, ray) || !(ray[2] > 0)) {
        return false;
    }
    *point = (struct far_point){.x = ray[0] / ray[2], .y = ray[1] / ray[2], .w = 1 / depth_mm};
    memcpy(point->origin_mm, left->position_mm, sizeof point->origin_mm);
    return true;
}

// Adds the tracks of a pair. `carried_state` >= 0: that of a wider pair, which shows a part of them
// too.
static void add_tracks(struct scene *scene, const struct adjustment *adjustment, int state,
                       int carried_state) {
    const int before = scene->count;
    for (int i = 0; i < TRIES * scene->matches && scene->count - before < scene->matches; i++) {
        if (i % DRAWS_SERVED == 0) {
            watch_serve(&adjustment->watch);
        }
        struct adjust_track track = {.is_placed = true, .sigma_px = scene->sigma_px};
        if (!draw_point(scene, adjustment, state, &track.point) ||
            !see(scene, adjustment, state, &track)) {
            continue;
        }
        struct adjust_track carried = track;
        if (carried_state >= 0 && next_unit(&scene->random) < MEASURE_CARRIED_PART &&
            see(scene, adjustment, carried_state, &carried)) {
            carried.sigma_px *= MEASURE_CARRIED_NOISE;
            track = carried;
        }
        INVARIANT(scene->count < TRACKS_MAX);
        scene->track[scene->count++] = track;
    }
}

static double sigma_of(const struct scene *scene, const struct zoom_calibration *calibration,
                       const struct adjustment *adjustment, int state) {
    double gradient[ADJUST_TERMS_MAX];
    const double depth_mm = scene->field.distance_mm[0];
    if (!adjustment_depth_gradient(adjustment, state, scene->field.pixel_px[0], depth_mm,
                                   gradient)) {
        return -1;
    }
    const double sigma = adjust_posterior_sigma(adjustment, gradient);
    const double scale = calibration->scale_sigma * depth_mm;
    return sqrt(sigma * sigma + scale * scale);
}

// ---- a board

struct board {
    double point_mm[ZOOM_EXPECT_CORNERS_MAX][3];
    struct target_observation seen[BOARD_SEEN_MAX];
    struct adjust_target target;
};

// The corners that both cameras see.
static void make_board(const struct scene *scene, const struct adjustment *adjustment,
                       struct board *board) {
    const struct zoom_expect_request *request = scene->request;
    const double vector[3] = {0, board_turn_rad, 0};
    double R[9];
    geometry_rotation_from_vector(vector, R);
    memset(board, 0, sizeof *board);
    board->target = (struct adjust_target){.point_mm = board->point_mm,
                                           .observation = board->seen,
                                           .sigma_px = MEASURE_CORNER_PX * scene->frames.skip};
    for (int i = 0; i < request->columns * request->rows; i++) {
        double *own = board->point_mm[board->target.points], arm[3];
        own[0] = (i % request->columns - 0.5 * (request->columns - 1)) * request->square_mm;
        own[1] = (i / request->columns - 0.5 * (request->rows - 1)) * request->square_mm;
        geometry_rotate(R, own, arm);
        const double z_mm = request->point_mm[2] + arm[2];
        struct adjust_track track = {.point = {.x = (request->point_mm[0] + arm[0]) / z_mm,
                                               .y = (request->point_mm[1] + arm[1]) / z_mm,
                                               .w = 1 / z_mm}};
        if (!(z_mm > 0) || !see(scene, adjustment, 0, &track)) {
            continue;
        }
        for (int side = 0; side < 2; side++) {
            struct target_observation *seen = &board->seen[board->target.observations++];
            seen->view = side;
            seen->point = board->target.points;
            memcpy(seen->pixel_px, track.pixel_px[side], sizeof seen->pixel_px);
        }
        board->target.points++;
    }
}

static int expect_board(struct scene *scene, const struct zoom_calibration *calibration,
                        struct arena *arena, struct adjustment *adjustment, double *sigma_mm) {
    struct board *board = arena_take(arena, 1, sizeof *board);
    if (board == NULL) {
        return ERROR_MEMORY;
    }
    make_board(scene, adjustment, board);
    if (board->target.points >= 2 && adjust_target_place(adjustment->view, &board->target)) {
        adjustment->target = &board->target;
        (void)adjustment_solve(adjustment, scene->track, scene->count);
        *sigma_mm = sigma_of(scene, calibration, adjustment, 0);
        adjustment->target = NULL;
    }
    return ERROR_OK;
}

// ---- pairs

static int expect_alone(struct scene *scene, const struct zoom_calibration *calibration,
                        struct arena *arena, struct zoom_expect *expect) {
    const struct zoom_expect_request *request = scene->request;
    struct adjustment adjustment;
    int error = adjustment_begin(calibration, &request->state, 1, arena, &adjustment);
    if (error != ERROR_OK) {
        return error;
    }
    adjustment.watch = request->watch;
    scene->count = 0;
    add_tracks(scene, &adjustment, 0, -1);
    if (scene->count < TRACKS_MIN) {
        return ERROR_RANGE;
    }
    if (!request->only_helped) {
        (void)adjustment_solve(&adjustment, scene->track, scene->count);
        expect->alone_mm = sigma_of(scene, calibration, &adjustment, 0);
    }
    return request->columns > 0
               ? expect_board(scene, calibration, arena, &adjustment, &expect->board_mm)
               : ERROR_OK;
}

static int expect_other(struct scene *scene, const struct zoom_calibration *calibration,
                        struct arena *arena, struct zoom_expect *expect) {
    struct zoom_state states[2] = {scene->request->state, *scene->request->other};
    struct adjustment adjustment;
    const int error = adjustment_begin(calibration, states, 2, arena, &adjustment);
    if (error != ERROR_OK) {
        return error;
    }
    const int narrow = adjustment.view[adjust_view(1, 0)].lens.fx_px >
                       adjustment.view[adjust_view(0, 0)].lens.fx_px;
    adjustment.watch = scene->request->watch;
    scene->count = 0;
    add_tracks(scene, &adjustment, 1 - narrow, -1);
    add_tracks(scene, &adjustment, narrow, 1 - narrow);
    if (scene->count >= TRACKS_MIN) {
        (void)adjustment_solve(&adjustment, scene->track, scene->count);
        expect->other_mm = sigma_of(scene, calibration, &adjustment, 0);
    }
    return ERROR_OK;
}

static int run(struct scene *scene, const struct zoom_calibration *calibration, struct arena *arena,
               struct zoom_expect *expect) {
    scene->track = arena_take(arena, TRACKS_MAX, sizeof *scene->track);
    if (scene->track == NULL) {
        return ERROR_MEMORY;
    }
    const size_t mark = arena_mark(arena);
    int error = expect_alone(scene, calibration, arena, expect);
    arena_release(arena, mark);
    if (error == ERROR_OK && scene->request->other != NULL) {
        error = expect_other(scene, calibration, arena, expect);
    }
    return error;
}

int zoom_expect_at(const struct zoom_calibration *calibration, const struct zoom_frames *frames,
                   const struct zoom_expect_request *request, struct arena *arena,
                   struct zoom_expect *expect) {
    INVARIANT(request->columns >= 0 && request->rows >= 0 &&
              request->columns * request->rows <= ZOOM_EXPECT_CORNERS_MAX);
    struct scene scene = {.request = request,
                          .frames = zoom_frames_or_whole(calibration, frames),
                          .matches = request->matches > 0 ? request->matches : MEASURE_MATCHES,
                          .random = 1};
    INVARIANT(scene.matches <= MEASURE_MATCHES_MAX);
    int error =
        zoom_field_at(calibration, frames, &request->state, request->point_mm, &scene.field);
    if (error != ERROR_OK) {
        return error;
    }
    const double depth_mm = scene.field.distance_mm[0];
    const bool has_depths = request->near_mm > 0 && request->far_mm >= request->near_mm;
    scene.near_mm = has_depths ? request->near_mm : depth_mm * (1 - relief);
    scene.far_mm = has_depths ? request->far_mm : depth_mm * (1 + relief);
    scene.sigma_px =
        scene.frames.skip * (request->match_px > 0 ? request->match_px : MEASURE_MATCH_PX);
    struct zoom_expect found = {-1, -1, -1};
    const size_t mark = arena_mark(arena);
    error = run(&scene, calibration, arena, &found);
    arena_release(arena, mark);
    if (error == ERROR_OK) {
        *expect = found;
    }
    return error;
}

double zoom_expect_other_factor(const struct zoom_calibration *calibration,
                                const struct zoom_state *state) {
    const struct zoom_camera *left = &calibration->camera[0];
    const double smallest_px = zoom_function_value(left, ZOOM_FOCAL, left->zoom.min);
    const double f_px = zoom_function_value(left, ZOOM_FOCAL, state->side[0].zoom_counts);
    return f_px < MEASURE_LONGER_BELOW * smallest_px ? MEASURE_LONGER_FACTOR : 1;
}

void zoom_expect_complete(const struct zoom_calibration *calibration,
                          struct zoom_expect_request *request, struct zoom_state *other) {
    const struct zoom_wish wish = {ZOOM_WISH_FACTOR,
                                   zoom_expect_other_factor(calibration, &request->state)};
    struct zoom_range reach;
    *other = request->state;
    const int error = zoom_for_wish(calibration, NULL, &wish, request->point_mm, other, &reach);
    request->other = error == ERROR_OK ? other : NULL;
    request->columns = MEASURE_BOARD_COLUMNS;
    request->rows = MEASURE_BOARD_ROWS;
    request->square_mm = MEASURE_BOARD_SQUARE_MM;
}

size_t zoom_expect_need_bytes(void) {
    const size_t alone = adjustment_need_bytes(1) + arena_need_bytes(1, sizeof(struct board));
    const size_t both = adjustment_need_bytes(2);
    return arena_need_bytes(TRACKS_MAX, sizeof(struct adjust_track)) +
           (alone > both ? alone : both);
}
