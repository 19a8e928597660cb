// SPDX-License-Identifier: Apache-2.0
#include "stereo/zoom/wide_pair.h"

#include <math.h>
#include <string.h>

#include "core/error.h"
#include "core/invariant.h"
#include "core/math.h"
#include "stereo/zoom/sparse_align.h"

enum {
    CORNERS_MAX = 1024,
    TRIES = 200,       // hypotheses of two matches each, for the place of one picture in the other
    SUPPORT_MIN = 12,  // matches that agree on it
    SPACING = 10,      // px between windows that are compared: they overlap, but little
    CELLS_MAX = 4096,
};

static const double reach_px = 16;  // radius of the search for the place, px of the wide picture
static const double agree_px = 1.0;
static const double still_rad = 5e-5;  // 1 mm of depth at 2 m
static const double ratio_min = 1.3;   // ratio of scales below which nothing is gained
static const double first_noise_px = 0.1, least_noise_px = 0.03, outlier_sigmas = 4;

// The tele picture of a side at the scale of the wide one, and where it is in the part of that.
struct side_pictures {
    double ratio;
    struct image_u8 small, part;  // the tele picture reduced; a part of the wide one
    int part_px[2];               // position of the part in the wide picture
    double place[4];              // part = (p0 + p2 u - p3 v, p1 + p3 u + p2 v)
};

// A tele pixel in the reduced picture.
static double reduced(double px, double ratio) {
    return (px + 0.5) / ratio - 0.5;
}

// One row of the reduced picture, or all columns: weights of the pixels that a reduced one covers.
static void reduce_row(const uint8_t *from, int count, double ratio, float weight, float *sums,
                       int small) {
    INVARIANT(ratio >= 1);
    for (int u = 0; u < small; u++) {
        const double begin = u * ratio, end = begin + ratio;
        float sum = 0;
        for (int x = (int)begin; x < end && x < count; x++) {
            const double first = begin > x ? begin : x, last = end < x + 1 ? end : x + 1;
            sum += (float)(last - first) * (float)from[x];
        }
        sums[u] += weight * sum;
    }
}

// Means over squares of `ratio` px, the pixels at their edges counted in part.
static bool reduce(const struct image_u8 *tele, double ratio, struct arena *arena,
                   struct image_u8 *small) {
    const int width = (int)(tele->width / ratio), height = (int)(tele->height / ratio);
    *small = (struct image_u8){arena_take(arena, (size_t)width * (size_t)height, 1), width, height,
                               width};
    const size_t mark = arena_mark(arena);
    float *sums = arena_take(arena, (size_t)width, sizeof *sums);
    if (small->data == NULL || sums == NULL) {
        return false;
    }
    for (int v = 0; v < height; v++) {
        const double begin = v * ratio, end = begin + ratio;
        memset(sums, 0, (size_t)width * sizeof *sums);
        for (int y = (int)begin; y < end && y < tele->height; y++) {
            const double first = begin > y ? begin : y, last = end < y + 1 ? end : y + 1;
            reduce_row(image_u8_row(tele, y), tele->width, ratio, (float)(last - first), sums,
                       width);
        }
        uint8_t *row = image_u8_row(small, v);
        for (int u = 0; u < width; u++) {
            row[u] = (uint8_t)((double)sums[u] / (ratio * ratio) + 0.5);
        }
    }
    arena_release(arena, mark);
    return true;
}

// What places one picture of a side in the other.
struct placing {
    const struct adjust_picture *picture;  // wide, tele
    const struct adjustment *adjustment;
    int side;
    double w;  // reciprocal depth of the scene
    struct side_pictures *s;
};

// Where the wide picture shows what the tele picture shows at a pixel, as far as it is known.
static bool carry(const struct placing *p, const double tele_px[2], double wide_px[2]) {
    const struct camera_view *wide = &p->adjustment->view[adjust_view(0, p->side)];
    const struct camera_view *tele = &p->adjustment->view[adjust_view(1, p->side)];
    double px[2] = {tele_px[0], tele_px[1]}, ray[3];
    adjust_to_sensor(&p->picture[1].window[p->side], px);
    if (!camera_view_ray(tele, px, ray) || !(ray[2] > 0)) {
        return false;
    }
    struct far_point point = {.x = ray[0] / ray[2], .y = ray[1] / ray[2], .w = p->w};
    memcpy(point.origin_mm, tele->position_mm, sizeof point.origin_mm);
    if (!camera_view_project(wide, &point, wide_px, NULL, NULL)) {
        return false;
    }
    adjust_from_sensor(&p->picture[0].window[p->side], wide_px);
    return true;
}

// Chooses the part of the wide picture that shows the tele one, with a margin.
static bool choose_part(const struct placing *p) {
    const struct image_u8 *tele = &p->picture[1].grey[p->side],
                          *wide = &p->picture[0].grey[p->side];
    INVARIANT(tele->width > 0 && wide->width > 0);
    const double corner[2][2] = {{0, 0}, {tele->width - 1, tele->height - 1}};
    int range[2][2];
    for (int end = 0; end < 2; end++) {
        double px[2];
        if (!carry(p, corner[end], px)) {
            return false;
        }
        for (int i = 0; i < 2; i++) {
            const double at = px[i] + (end == 0 ? -2 * reach_px : 2 * reach_px);
            range[end][i] = (int)math_clamp(at, 0, i == 0 ? wide->width : wide->height);
        }
    }
    if (range[1][0] - range[0][0] < 64 || range[1][1] - range[0][1] < 64) {
        return false;
    }
    p->s->part_px[0] = range[0][0];
    p->s->part_px[1] = range[0][1];
    p->s->part =
        (struct image_u8){image_u8_row(wide, range[0][1]) + range[0][0], range[1][0] - range[0][0],
                          range[1][1] - range[0][1], wide->stride};
    return true;
}

// For sparse_match of the reduced picture with the part.
static bool expect(void *context, const double small_px[2], struct sparse_region *region) {
    const struct placing *p = context;
    const double tele_px[2] = {(small_px[0] + 0.5) * p->s->ratio - 0.5,
                               (small_px[1] + 0.5) * p->s->ratio - 0.5};
    double px[2];
    if (!carry(p, tele_px, px)) {
        return false;
    }
    for (int i = 0; i < 2; i++) {
        region->from[i] = region->to[i] = px[i] - p->s->part_px[i];
    }
    region->across = region->beyond = reach_px;
    return true;
}

static void apply(const double place[4], const double px[2], double result[2]) {
    result[0] = place[0] + place[2] * px[0] - place[3] * px[1];
    result[1] = place[1] + place[3] * px[0] + place[2] * px[1];
}

// The similarity that takes two points to their partners; false if they are close together.
static bool similarity(const struct sparse_pair *a, const struct sparse_pair *b, double place[4]) {
    const double u = b->left_px[0] - a->left_px[0], v = b->left_px[1] - a->left_px[1];
    const double x = b->right_px[0] - a->right_px[0], y = b->right_px[1] - a->right_px[1];
    const double square = u * u + v * v;
    if (square < 900) {
        return false;
    }
    place[2] = (u * x + v * y) / square;
    place[3] = (u * y - v * x) / square;
    place[0] = a->right_px[0] - place[2] * a->left_px[0] + place[3] * a->left_px[1];
    place[1] = a->right_px[1] - place[3] * a->left_px[0] - place[2] * a->left_px[1];
    return true;
}

// The similarity that most matches agree with. Returns their number.
static int find_place(const struct sparse_pair *pairs, int count, double place[4]) {
    int best = 0;
    uint32_t random = 1;
    for (int round = 0; round < TRIES && count >= SUPPORT_MIN; round++) {
        int pick[2], support = 0;
        double trial[4];
        for (int i = 0; i < 2; i++) {
            random = random * 1664525u + 1013904223u;
            pick[i] = (int)((random >> 8) % (uint32_t)count);
        }
        if (!similarity(&pairs[pick[0]], &pairs[pick[1]], trial)) {
            continue;
        }
        for (int i = 0; i < count; i++) {
            double at[2];
            apply(trial, pairs[i].left_px, at);
            const double dx = at[0] - pairs[i].right_px[0], dy = at[1] - pairs[i].right_px[1];
            support += dx * dx + dy * dy < agree_px * agree_px;
        }
        if (support > best) {
            best = support;
            memcpy(place, trial, sizeof trial);
        }
    }
    return best;
}

static void serve(void *cookie) {
    const struct placing *p = cookie;
    watch_serve(&p->adjustment->watch);
}

// Prepares one side; `*found` is false if its pictures cannot be compared.
static int place_side(const struct placing *p, struct arena *arena, bool *found) {
    *found = false;
    if (!choose_part(p)) {
        return ERROR_OK;
    }
    if (!reduce(&p->picture[1].grey[p->side], p->s->ratio, arena, &p->s->small)) {
        return ERROR_MEMORY;
    }
    const size_t mark = arena_mark(arena);
    struct sparse_picture corners[2];
    struct sparse_pair *pairs = arena_take(arena, CORNERS_MAX, sizeof *pairs);
    int error = pairs == NULL ? ERROR_MEMORY
                              : sparse_picture_make(&p->s->small, CORNERS_MAX, arena, &corners[0]);
    if (error == ERROR_OK) {
        error = sparse_picture_make(&p->s->part, 4 * CORNERS_MAX, arena, &corners[1]);
    }
    if (error == ERROR_OK) {
        struct placing copy = *p;
        const int count =
            sparse_match(&corners[0], &corners[1], expect, serve, &copy, arena, pairs);
        error = count < 0 ? count : ERROR_OK;
        *found = count > 0 && find_place(pairs, count, p->s->place) >= SUPPORT_MIN;
    }
    arena_release(arena, mark);
    return error == ERROR_TOO_SMALL ? ERROR_OK : error;
}

// Adds to a track of the tele pair what the wide picture of a side shows of it.
static bool carry_track(const struct placing *p, struct adjust_track *track) {
    double px[2] = {track->pixel_px[p->side][0], track->pixel_px[p->side][1]}, at[2];
    adjust_from_sensor(&p->picture[1].window[p->side], px);
    const double u = reduced(px[0], p->s->ratio), v = reduced(px[1], p->s->ratio);
    const double small[2] = {u, v};
    apply(p->s->place, small, at);
    if (!sparse_align(&p->s->small, u, v, &p->s->part, at)) {
        return false;
    }
    INVARIANT(track->count < ADJUST_SEEN_MAX);
    double *wide = track->pixel_px[track->count];
    wide[0] = at[0] + p->s->part_px[0];
    wide[1] = at[1] + p->s->part_px[1];
    adjust_to_sensor(&p->picture[0].window[p->side], wide);
    track->view[track->count++] = adjust_view(0, p->side);
    return true;
}

// One track of each cell of the reduced picture, so that windows are nearly independent.
static bool take_cell(const struct side_pictures *s, const struct adjust_track *track,
                      uint8_t taken[CELLS_MAX]) {
    const int columns = s->small.width / SPACING + 1;
    INVARIANT(s->ratio >= ratio_min);
    const int column = (int)(reduced(track->pixel_px[0][0], s->ratio) / SPACING);
    const int row = (int)(reduced(track->pixel_px[0][1], s->ratio) / SPACING);
    const int cell = row * columns + column;
    if (column < 0 || row < 0 || cell >= CELLS_MAX || taken[cell]) {
        return false;
    }
    taken[cell] = 1;
    return true;
}

static int carry_tracks(struct placing *p, struct side_pictures side[2], const bool found[2],
                        struct adjust_tracks *tracks, int first) {
    uint8_t taken[CELLS_MAX] = {0};
    INVARIANT(first >= 0 && first <= tracks->count);
    int carried = 0;
    for (int i = first; i < tracks->count; i++) {
        struct adjust_track *track = &tracks->track[i];
        serve(p);
        if (!take_cell(&side[found[0] ? 0 : 1], track, taken)) {
            continue;
        }
        for (int k = 0; k < 2; k++) {
            p->side = k;
            p->s = &side[k];
            carried += found[k] && carry_track(p, track);
        }
        if (track->count > 2) {
            track->sigma_px = first_noise_px;
        }
    }
    return carried;
}

// The median residual of the carried tracks, by counting.
static double median_carried(const struct adjust_tracks *tracks) {
    enum { BINS = 1000 };
    static const double bin_px = 0.002;
    int bins[BINS] = {0}, count = 0, sum = 0, at = 0;
    for (int i = 0; i < tracks->count; i++) {
        const struct adjust_track *track = &tracks->track[i];
        if (track->count > 2 && !track->rejected) {
            const double bin = track->residual / bin_px;
            bins[bin < BINS - 1 ? (int)bin : BINS - 1]++;
            count++;
        }
    }
    while (at < BINS - 1 && 2 * (sum + bins[at]) < count) {
        sum += bins[at++];
    }
    return (at + 0.5) * bin_px;
}

// Fits all, then once more with the noise that the carried tracks show and without their outliers.
static void fit(struct adjustment *adjustment, struct adjust_tracks *tracks,
                struct wide_pair_report *report) {
    for (int round = 0; round < 3; round++) {
        (void)adjustment_solve(adjustment, tracks->track, tracks->count);
        report->carried_px = median_carried(tracks);
        // The rms of several coordinates: its median is near the standard deviation.
        const double noise =
            report->carried_px > least_noise_px ? report->carried_px : least_noise_px;
        for (int i = 0; i < tracks->count; i++) {
            struct adjust_track *track = &tracks->track[i];
            if (track->count > 2) {
                track->sigma_px = noise;
                track->rejected = track->residual > outlier_sigmas * noise;
            }
        }
    }
}

static int compare(const struct adjust_picture picture[2], struct arena *arena,
                   struct adjustment *adjustment, struct adjust_tracks *tracks, int first,
                   struct wide_pair_report *report) {
    struct side_pictures side[2];
    bool found[2] = {false, false};
    struct placing p = {
        .picture = picture, .adjustment = adjustment, .w = 1 / report->pair[1].depth_mm};
    for (int k = 0; k < 2; k++) {
        const double skips = (double)picture[0].window[k].skip / picture[1].window[k].skip;
        side[k].ratio = skips * adjustment->view[adjust_view(1, k)].lens.fx_px /
                        adjustment->view[adjust_view(0, k)].lens.fx_px;
        p.side = k;
        p.s = &side[k];
        const int error = side[k].ratio < ratio_min ? ERROR_OK : place_side(&p, arena, &found[k]);
        if (error != ERROR_OK) {
            return error;
        }
    }
    if (found[0] || found[1]) {
        report->carried = carry_tracks(&p, side, found, tracks, first);
        fit(adjustment, tracks, report);
        for (int k = 0; k < 2 && report->carried > 0; k++) {
            adjust_extra_term(adjustment, VIEW_TERMS * adjust_view(1, k) + VIEW_ROTATION_Y,
                              &report->turn_rad[k], &report->turn_sigma_rad[k]);
        }
    }
    return ERROR_OK;
}

int wide_pair_adjust(const struct adjust_picture picture[2], struct arena *arena,
                     struct adjustment *adjustment, struct wide_pair_report *report) {
    const size_t mark = arena_mark(arena);
    INVARIANT(picture[0].state == 0 && picture[1].state == 1 && adjustment->views == 4);
    *report = (struct wide_pair_report){.turn_sigma_rad = {INFINITY, INFINITY}};
    struct adjust_tracks tracks = {arena_take(arena, 2 * SPARSE_LEFT_MAX, sizeof *tracks.track), 0,
                                   2 * SPARSE_LEFT_MAX};
    int error = tracks.track == NULL ? ERROR_MEMORY : ERROR_OK;
    int first = 0;
    for (int i = 0; i < 2 && error == ERROR_OK; i++) {
        first = tracks.count;
        error = adjust_pair_match(&picture[i], arena, adjustment, &tracks, &report->pair[i]);
    }
    if (error == ERROR_OK && report->pair[1].used > 0) {
        error = compare(picture, arena, adjustment, &tracks, first, report);
    }
    for (int i = 0; i < 2 && error == ERROR_OK; i++) {
        adjust_pair_assess(&picture[i], adjustment, &report->pair[i]);
    }
    arena_release(arena, mark);
    return error;
}

bool wide_pair_turned(const struct wide_pair_report *report) {
    bool turned = false;
    for (int side = 0; side < 2; side++) {
        const double turn = fabs(report->turn_rad[side]);
        turned = turned || (turn > still_rad && turn > 4 * report->turn_sigma_rad[side]);
    }
    return turned;
}

size_t wide_pair_need_bytes(int width, int height) {
    const size_t small = (size_t)((double)width / ratio_min) * (size_t)((double)height / ratio_min);
    const size_t comparing = 2 * arena_need_bytes(small, 1) +
                             arena_need_bytes(CORNERS_MAX, sizeof(struct sparse_pair)) +
                             sparse_picture_need_bytes(width, height, CORNERS_MAX) +
                             sparse_picture_need_bytes(width, height, 4 * CORNERS_MAX) +
                             sparse_match_need_bytes(CORNERS_MAX, 4 * CORNERS_MAX);
    const size_t matching = adjust_pair_match_need_bytes(width, height);
    return arena_need_bytes(2 * SPARSE_LEFT_MAX, sizeof(struct adjust_track)) +
           (comparing > matching ? comparing : matching);
}
