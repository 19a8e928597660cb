// SPDX-License-Identifier: Apache-2.0
// Text that each set of kernels compiles. Validation of the winners of a row: the reason why a
// pixel has no disparity, or its sub-pixel position; what looks around a pixel is in validation.c.
// The loops over a row have no branches, so that compilers can vectorize them. Rows needed: the
// row's own; the medians at the end of the run, the rows above and below.
#ifndef VERGENCE_STEREO_MATCH_VALIDATION_H
#define VERGENCE_STEREO_MATCH_VALIDATION_H

#include <string.h>

#include "stereo/image/reason.h"
#include "stereo/match/checks.h"
#include "stereo/match/lanes.h"
#include "stereo/match/selection.h"
#include "stereo/match/state.h"

// Offset of the lowest point of the "V" through three costs, in 1/256 of a disparity, [-128, 128].
// It is computed from the averaged costs: the sums of path costs contain the penalty for leaving a
// whole disparity, which would pull every offset towards 0 (by 0.15 px, measured). Without branches
// and in 16 bits, so that compilers can vectorize it.
static inline int16_t sub_pixel_q8(int16_t before, int16_t middle, int16_t after) {
    const int16_t rise_before = (int16_t)(before - middle);
    const int16_t rise_after = (int16_t)(after - middle);
    const int16_t steeper = rise_before > rise_after ? rise_before : rise_after;
    const int16_t fall = (int16_t)(rise_before - rise_after);
    const int16_t size = fall < 0 ? (int16_t)-fall : fall;
    // The quotient size / (2 steeper) in 8 binary places. A neighbour may be lower because path
    // costs overruled it; the offset is then limited to half a disparity.
#if defined(__bfin__)
    const int16_t quotient = (int16_t)quotient_7_places((uint32_t)size, (uint32_t)steeper);
#else
    int16_t rest = size;
    int16_t quotient = 0;
    for (int i = 0; i < 7; i++) {
        rest = (int16_t)(2 * rest);
        const int16_t taken = rest >= steeper ? steeper : 0;
        rest = (int16_t)(rest - taken);
        quotient = (int16_t)(2 * quotient + (taken != 0 ? 1 : 0));
    }
#endif
    const int16_t half_way = fall == 0 ? 0 : DISPARITY_ONE / 2;
    const int16_t offset = steeper <= 0 || size >= steeper ? half_way : quotient;
    return fall < 0 ? (int16_t)-offset : offset;
}

// Whether the right pixel of each pixel is assigned to it, or to a neighbour on the same surface.
static void check_claims(const struct match_level *level, const struct match_line *line) {
    uint8_t *restrict consistent = line->row.consistent;
    const int16_t *restrict lane = line->row.lane;
    const uint32_t *restrict claim = line->row.claim;
    const uint32_t off = (uint32_t)match_rules[MATCH_LEFT_RIGHT].limit;
    const int width = level->width;
    for (int x = 0; x < width; x++) {
        const int right_x = lane[x] < 0 ? width : x - level->disparity_min - lane[x];
        // 0 and 2 off are as many lanes off.
        const uint32_t gap =
            (uint32_t)CLAIM_FIT - 1 + off - claim[right_x] % CLAIM_FIT - (uint32_t)lane[x];
        consistent[x] = gap <= 2 * off;
    }
}

// Whether the winners are inside the requested range, neither at the ends of the search nor in the
// lanes beyond, and have a low enough cost.
static void check_fits(const struct match_level *level, const struct match_line *line) {
    uint8_t *restrict fits = line->row.fits;
    const int16_t *restrict lane = line->row.lane;
    const uint32_t *restrict around = line->row.around;
    uint8_t *restrict fit = line->row.fit;
    const int width = level->width;
    const int more = match_is_smoothed(level) ? TUNE_COST_SMOOTHED : 0;
    for (int x = 0; x < width; x++) {
        fit[x] = (uint8_t)(around[x] >> 8);
    }
    const int16_t first = (int16_t)level->accepted.first;
    const int16_t last = (int16_t)level->accepted.last;
    for (int x = 0; x < width; x++) {
        fits[x] = (lane[x] >= first) & (lane[x] <= last) & match_accepts(MATCH_COST, fit[x] + more);
    }
}

// Extremes of twice as many pixels as before, `reach`, starting at each pixel; of fewer at the end
// of the row.
static inline __attribute__((always_inline)) void widen(uint8_t *restrict darkest,
                                                        uint8_t *restrict brightest, int width,
                                                        const int reach) {
    // Each pixel is written after it was read as a neighbour.
    for (int x = 0; x < width - reach; x++) {
        darkest[x] = darkest[x + reach] < darkest[x] ? darkest[x + reach] : darkest[x];
    }
    for (int x = 0; x < width - reach; x++) {
        brightest[x] = brightest[x + reach] > brightest[x] ? brightest[x + reach] : brightest[x];
    }
}

// Between the darkest and the brightest of the grey levels around each pixel; near the ends of the
// span, of those inside of it.
static void measure_contrast(const struct match_level *level, const struct match_line *line,
                             const uint8_t *guide, struct rectify_span span,
                             uint8_t *restrict contrast) {
    uint8_t *restrict darkest = line->row.darkest;
    uint8_t *restrict brightest = line->row.brightest;
    const int width = level->width;
    memcpy(darkest, guide, (size_t)width);
    if (span.begin < span.end) {
        // A span narrower than the window is compared as a whole.
        memset(darkest, guide[span.begin], (size_t)span.begin);
        memset(darkest + span.end, guide[span.end - 1], (size_t)(width - span.end));
    }
    memcpy(brightest, darkest, (size_t)width);
    widen(darkest, brightest, width, 1);
    widen(darkest, brightest, width, 2);
    widen(darkest, brightest, width, 4);
    widen(darkest, brightest, width, 8);
    const int half = TUNE_CONTRAST_COLUMNS / 2;
    const int begin = span.begin + half < span.end ? span.begin + half : span.end;
    const int end = span.end - half > begin ? span.end - half : begin;
    for (int x = begin; x < end; x++) {
        contrast[x] = match_step(brightest[x - half], darkest[x - half]);
    }
    const int first = span.begin;
    const int last =
        span.end - TUNE_CONTRAST_COLUMNS > first ? span.end - TUNE_CONTRAST_COLUMNS : first;
    for (int x = span.begin; x < begin; x++) {
        contrast[x] = match_step(brightest[first], darkest[first]);
    }
    for (int x = end; x < span.end; x++) {
        contrast[x] = match_step(brightest[last], darkest[last]);
    }
}

static void write_surface(struct match_level *level, const struct match_line *line, int y) {
    const uint8_t *restrict consistent = line->row.consistent;
    const uint8_t *restrict fits = line->row.fits;
    int16_t *restrict surface = level->surface[y % level->surface_rows];
    const int16_t *restrict lane = line->row.lane;
    const uint8_t *restrict margin = line->row.margin;
    const uint32_t *restrict around = line->row.around;
    const int width = level->width;
    for (int x = 0; x < width; x++) {
        const int16_t offset_q8 =
            sub_pixel_q8((int16_t)(around[x] & 0xff), (int16_t)(around[x] >> 8 & 0xff),
                         (int16_t)(around[x] >> 16 & 0xff));
        const int part = (offset_q8 + DISPARITY_ONE / 2) * MATCH_SURFACE_ONE / DISPARITY_ONE;
        const int below_one = part < MATCH_SURFACE_ONE ? part : MATCH_SURFACE_ONE - 1;
        const int doubt = margin[x] < TUNE_MARGIN_MIN ? MATCH_DOUBTFUL : 0;
        const int position = MATCH_SURFACE_ONE * lane[x] + below_one;
        surface[x] = (int16_t)(consistent[x] & fits[x] ? position + doubt : -1);
    }
}

// The limit of the margin, by the contrast around: where that is faint noise decides, elsewhere a
// depth edge lowers the penalty of a jump, and with it the margin.
static inline uint8_t margin_min_at(uint8_t contrast) {
    const uint8_t most = TUNE_CONTRAST_FAINT + TUNE_MARGIN_MIN - TUNE_MARGIN_LEAST;
    const uint8_t capped = contrast < most ? contrast : most;
    const uint8_t more = capped > TUNE_CONTRAST_FAINT ? (uint8_t)(capped - TUNE_CONTRAST_FAINT) : 0;
    return (uint8_t)(match_rules[MATCH_MARGIN].limit - more);
}

// The reason to reject the winner of each pixel, or REASON_VALID.
static void write_reasons(const struct match_line *line, int width, uint8_t *restrict reason) {
    const uint8_t *restrict consistent = line->row.consistent;
    const uint8_t *restrict fits = line->row.fits;
    const uint8_t *restrict contrast = line->row.contrast;
    const uint8_t *restrict margin = line->row.margin;
    for (int x = 0; x < width; x++) {
        // All are read first: compilers do not vectorize reads on a condition.
        const uint8_t fit = fits[x], range = contrast[x], agrees = consistent[x];
        const uint8_t certain = margin[x] >= margin_min_at(range) ? 1 : 0;
        const uint8_t distinct = match_accepts(MATCH_CONTRAST, range) ? 1 : 0;
        uint8_t doubt =
            fit == 0 ? match_rules[MATCH_COST].reason : match_rules[MATCH_MARGIN].reason;
        doubt = distinct == 0 ? match_rules[MATCH_CONTRAST].reason : doubt;
        doubt = (fit & certain) == 0 ? doubt : REASON_VALID;
        reason[x] = agrees == 0 ? match_rules[MATCH_LEFT_RIGHT].reason : doubt;
    }
    const int16_t *restrict lane = line->row.lane;
    for (int x = 0; x < width; x++) {
        reason[x] = lane[x] < 0 ? REASON_BORDER : reason[x];
    }
}

static void write_confidence(const struct match_line *line, int width,
                             uint8_t *restrict confidence) {
    const uint8_t *restrict margin = line->row.margin;
    const int16_t *restrict lane = line->row.lane;
    for (int x = 0; x < width; x++) {
        const uint8_t own = margin[x];
        confidence[x] = lane[x] < 0 ? 0 : own;
    }
}

// Disparities of a row, before they are smoothed.
static void compute_disparities(const struct match_level *level, const struct match_line *line,
                                int32_t *restrict raw_q8) {
    const int16_t *restrict lane = line->row.lane;
    const uint32_t *restrict around = line->row.around;
    const int lowest_q8 = DISPARITY_ONE * level->disparity_min;
    const int16_t last = (int16_t)(level->disparity_count - 1);
    const int width = level->width;
    for (int x = 0; x < width; x++) {
        const int16_t offset_q8 =
            sub_pixel_q8((int16_t)(around[x] & 0xff), (int16_t)(around[x] >> 8 & 0xff),
                         (int16_t)(around[x] >> 16 & 0xff));
        const int16_t inside = lane[x] < last ? lane[x] : last;
        const int whole_q8 = lowest_q8 + DISPARITY_ONE * (inside > 0 ? inside : 0);
        raw_q8[x] = whole_q8 + (lane[x] >= 0 && lane[x] <= last ? offset_q8 : 0);
    }
}

static inline int32_t median_of_three(int32_t a, int32_t b, int32_t c) {
    const int32_t low = a < b ? a : b;
    const int32_t high = a < b ? b : a;
    const int32_t inner = c < high ? c : high;
    return inner > low ? inner : low;
}

// Medians of three along the row; the ends do not change.
static void smooth_along(const int32_t *restrict raw_q8, int width,
                         int32_t *restrict disparity_q8) {
    disparity_q8[0] = raw_q8[0];
    for (int x = 1; x < width - 1; x++) {
        disparity_q8[x] = median_of_three(raw_q8[x - 1], raw_q8[x], raw_q8[x + 1]);
    }
    disparity_q8[width - 1] = raw_q8[width - 1];
}

// Writes row y of the finest level, and the reasons of all image rows that it covers; their
// disparities are written at the end.
static void write_output(const struct match_level *level, const struct match_line *line, int y,
                         struct rectify_span span) {
    const struct match_output *output = level->state->output;
    const int row = y << level->shift_y;
    uint8_t *reason = image_u8_row(&output->reason, row);
    uint8_t *confidence = image_u8_row(&output->confidence, row);
    const int width = level->width;
    compute_disparities(level, line, (int32_t *)line->row.claim);
    smooth_along((int32_t *)line->row.claim, width, image_i32_row(&output->disparity_q8, row));
    if (level->state->options.keep_all) {
        for (int x = 0; x < width; x++) {
            reason[x] = line->row.lane[x] < 0 ? REASON_BORDER : REASON_VALID;
        }
    } else {
        measure_contrast(level, line, match_guide(level, y), span, line->row.contrast);
        write_reasons(line, width, reason);
    }
    write_confidence(line, width, confidence);
    const int end = y == level->height - 1 ? output->reason.height : (y + 1) << level->shift_y;
    for (int copy = row + 1; copy < end; copy++) {
        memcpy(image_u8_row(&output->reason, copy), reason, (size_t)width);
        memcpy(image_u8_row(&output->confidence, copy), confidence, (size_t)width);
    }
}

// Validates the winners of row y and writes them: to the output on level 0, to the surface on
// others.
static void validate_row(struct match_level *level, struct match_line *line, int y,
                         struct rectify_span left) {
    check_claims(level, line);
    check_fits(level, line);
    if (match_is_finest(level)) {
        write_output(level, line, y, left);
    } else {
        write_surface(level, line, y);
    }
}

// `here` becomes the median of itself, the row before, at `raw`, and the next one; `raw` becomes
// the old `here`.
static void smooth_row(int32_t *restrict raw, int32_t *restrict here, const int32_t *restrict next,
                       int columns) {
    for (int x = 0; x < columns; x++) {
        const int32_t was = here[x];
        here[x] = median_of_three(raw[x], was, next[x]);
        raw[x] = was;
    }
}

static void fill_between(int32_t *restrict upper, int32_t *restrict lower, int columns) {
    for (int x = 0; x < columns; x++) {
        const int32_t rise = lower[x] - upper[x];
        const int32_t part = rise <= TUNE_ROW_STEP && rise >= -TUNE_ROW_STEP ? rise / 4 : 0;
        upper[x] += part;
        lower[x] -= part;
    }
}

#endif
