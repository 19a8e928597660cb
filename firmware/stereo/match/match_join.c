// SPDX-License-Identifier: Apache-2.0
// Pixels that continue the surface around them, although a limit rejected them.
#include "core/invariant.h"
#include "stereo/image/reason.h"
#include "stereo/match/match_state.h"
#include "stereo/match/match_validity.h"

enum {
    // A pixel is joined to the surface around it if this many of the 45 pixels of the window are on
    // it: half if only its cost rejected it, two thirds if it had a rival.
    COLUMNS = 4,
    ROWS = 2,
    COST_MIN = 23,
    RIVAL_MIN = 30,
    STEP_Q8 = 256,
    MARK_JOINED = 0x40,
    // The margins around: of pixels up to so far, every fourth; what is more counts as the highest.
    AROUND = 12,
    AROUND_STEP = 4,
    MARGIN_MAX = 60,
};

// The pixels of the image up to so many columns and rows from (x, y).
struct window {
    int x_begin, x_end, y_begin, y_end;
};

static struct window window_at(const struct match_output *output, int x, int y, int columns,
                               int rows) {
    const int width = output->reason.width;
    const int height = output->reason.height;
    return (struct window){x > columns ? x - columns : 0,
                           x + columns < width ? x + columns + 1 : width, y > rows ? y - rows : 0,
                           y + rows < height ? y + rows + 1 : height};
}

int match_margin_around(const struct match_output *output, int x, int y) {
    const struct window window = window_at(output, x, y, AROUND, AROUND);
    int sum = 0;
    int count = 0;
    for (int j = window.y_begin; j < window.y_end; j += AROUND_STEP) {
        const uint8_t *restrict confidence = image_u8_row(&output->confidence, j);
        for (int i = window.x_begin; i < window.x_end; i += AROUND_STEP) {
            sum += confidence[i] < MARGIN_MAX ? confidence[i] : MARGIN_MAX;
            count++;
        }
    }
    return sum / count;
}

struct joining {
    struct match_output *output;
    struct match_believed believed;
    int lowest;  // disparity searched
    int parts;
};

// Number of pixels around (x, y) that continue its surface: accepted ones, and those rejected for
// the reason `too`; REASON_VALID for none.
static int companions(const struct match_output *output, int x, int y, uint8_t too) {
    const int32_t here_q8 = image_i32_row(&output->disparity_q8, y)[x];
    const struct window window = window_at(output, x, y, COLUMNS, ROWS);
    int count = 0;
    for (int j = window.y_begin; j < window.y_end; j++) {
        const uint8_t *restrict reason = image_u8_row(&output->reason, j);
        const int32_t *restrict disparity_q8 = image_i32_row(&output->disparity_q8, j);
        for (int i = window.x_begin; i < window.x_end; i++) {
            const int32_t step_q8 = disparity_q8[i] - here_q8;
            // Marked pixels count as what they were, whichever is looked at first.
            const uint8_t was = reason[i] & (MARK_JOINED - 1);
            count += ((reason[i] == REASON_VALID) | (was == too)) & (step_q8 <= STEP_Q8) &
                     (step_q8 >= -STEP_Q8);
        }
    }
    return count;
}

// Whether one check alone rejected the winner: the limit of its cost, or that of its margin.
static bool is_doubtful(const struct match_believed *believed, int index, uint8_t reason,
                        uint8_t confidence) {
    return reason == REASON_AMBIGUOUS ||
           (reason == REASON_OUT_OF_RANGE && confidence >= MATCH_MARGIN_MIN &&
            index >= believed->first && index <= believed->last);
}

// Whether winners around that only their cost rejected are as good as accepted ones: where texture
// is faint noise makes correct ones expensive, but their rivals stay far behind.
static bool continues_distinct(const struct match_output *output, int x, int y) {
    return match_margin_around(output, x, y) >= MATCH_DISTINCT_MARGIN &&
           companions(output, x, y, REASON_OUT_OF_RANGE) >= COST_MIN;
}

// The cost of a winner grows with the slope of its surface and with differences of the lenses, and
// its margin shrinks: correct ones that limits alone reject are kept if they continue a surface.
static void join_rows(const struct joining *of, int y_begin, int y_end) {
    struct match_output *output = of->output;
    const int width = output->reason.width;
    for (int y = y_begin; y < y_end; y++) {
        uint8_t *reason = image_u8_row(&output->reason, y);
        const uint8_t *confidence = image_u8_row(&output->confidence, y);
        const int32_t *disparity_q8 = image_i32_row(&output->disparity_q8, y);
        for (int x = 0; x < width; x++) {
            if (reason[x] == REASON_VALID) {
                continue;
            }
            const int index = match_whole_disparity(disparity_q8[x]) - of->lowest;
            const bool expensive = reason[x] == REASON_OUT_OF_RANGE;
            const int min = expensive ? COST_MIN : RIVAL_MIN;
            if (is_doubtful(&of->believed, index, reason[x], confidence[x]) &&
                (companions(output, x, y, REASON_VALID) >= min ||
                 (expensive && continues_distinct(output, x, y)))) {
                reason[x] = (uint8_t)(reason[x] | MARK_JOINED);
            }
        }
    }
}

// Row `half` of the 2 x parts halves.
static int half_row(const struct joining *of, int half) {
    return of->output->reason.height * half / (2 * of->parts);
}

// A pass over the upper halves of all parts reads no row that another part writes in it, nor does
// one over the lower halves.
static void join_upper_half(void *context, int index) {
    const struct joining *of = context;
    join_rows(of, half_row(of, 2 * index), half_row(of, 2 * index + 1));
}

static void join_lower_half(void *context, int index) {
    const struct joining *of = context;
    join_rows(of, half_row(of, 2 * index + 1), half_row(of, 2 * index + 2));
}

static void accept_joined(void *context, int index) {
    const struct joining *of = context;
    const int width = of->output->reason.width;
    const int y_end = half_row(of, 2 * index + 2);
    for (int y = half_row(of, 2 * index); y < y_end; y++) {
        uint8_t *restrict reason = image_u8_row(&of->output->reason, y);
        for (int x = 0; x < width; x++) {
            reason[x] = reason[x] >= MARK_JOINED ? (uint8_t)REASON_VALID : reason[x];
        }
    }
}

void match_join(const struct match_options *options, const struct parallel *parallel,
                struct match_output *output) {
    // Halves that are lower than the window would meet.
    const int parts_max = output->reason.height / (2 * ROWS);
    struct joining of = {.output = output,
                         .believed = match_believed_of(options),
                         .lowest = match_searched_min(options),
                         .parts = parallel->threads < parts_max ? parallel->threads : parts_max};
    INVARIANT(of.parts >= 1);
    parallel->run(parallel->self, join_upper_half, &of, of.parts);
    parallel->run(parallel->self, join_lower_half, &of, of.parts);
    parallel->run(parallel->self, accept_joined, &of, of.parts);
}
