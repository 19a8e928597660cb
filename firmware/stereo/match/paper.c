// SPDX-License-Identifier: Apache-2.0
// The historical baseline: a greedy path through disparity space, row by row.
//
// A reconstruction, not a port. The first account of this instrument most likely matched with this
// model: G. Guerra-Filho, "An optimal time-space algorithm for dense stereo matching", Journal of
// Real-Time Image Processing, 2010, of which only the abstract was available. *Known* from it: a
// greedy heuristic computes a path in disparity space; the work per pixel is constant, as the
// range of disparities is not searched; time and space are O(n); a procedure repairs the map at
// depth discontinuities. *Inferred* by us is everything else:
//
// 1. Each pixel has a *signature*: 30 comparisons of grey values around it. The dissimilarity of
//    two pixels is the number of differing bits: 0 if equal, 15 by chance. A difference of
//    exposure does not matter.
// 2. A *walk* follows the row. Its only state is its position: a column of the left row and one of
//    the right (their difference is the disparity). Before each step it compares a few moves by
//    the dissimilarity of the next 8 pixels plus a penalty: straight on; skip one pixel of either
//    row (a slant); and where straight on does not fit, skip up to 32 of either row (an
//    occlusion). The cheapest is taken and never revised.
// 3. A greedy walk finds a surface late. So a second walk comes back from the other end and may
//    switch to the path of the first, and a third likewise to that of the second. Pixels on which
//    the last two agree are kept.
// 4. *Repair*: between two kept pieces the edge is put where both fit best.
// 5. *Validation*: sums along the path of the dissimilarities at the match and at one and two
//    disparities away give the sub-pixel position, the confidence and the reason to reject.
//
// A surface more than 32 px away needs several lucky jumps; repeated patterns and rows without
// texture mislead a walk for as long as they last. This is inherent in the method: it leaves
// horizontal stripes.
//
// Measured on eight recorded pairs with ground truth (the Middlebury ones of RESULTS.md), "filled"
// by the rule of `vergence evaluate`: mean bad-1.0 is 7.7 %, from 1.8 % (venus) to 19.2 % (Art);
// 10.3 % if a walk may not switch to the other's path, 8.7 % without repair. Of the kept pixels,
// 3.3 % are off by more than 1 px, at a density of 87 %.
#include <string.h>

#include "core/error.h"
#include "core/invariant.h"
#include "stereo/image/reason.h"
#include "stereo/match/checks.h"
#include "stereo/match/tuning.h"
#if defined(__bfin__)
#include "stereo/bfin/quotient.h"
#endif

enum {
    SAMPLES = 6,  // comparisons per row of a signature: 2 on each side, 1 above, 1 below
    SAMPLE_REACH_PX = 2,
    SIGNATURE_REACH_ROWS = 2,  // a signature joins the samples from 2 rows above to 2 below
    SIGNATURE_BITS = SAMPLES * (2 * SIGNATURE_REACH_ROWS + 1),
    CHANCE = SIGNATURE_BITS / 2,
    WALKS = 3,
    // Sums over the pixels ahead.
    PENALTY_SLANT = TUNE_PAPER_SLANT * TUNE_PAPER_AHEAD_PX,
    PENALTY_OTHER_PATH = TUNE_PAPER_OTHER_PATH * TUNE_PAPER_AHEAD_PX,
    PENALTY_JUMP = TUNE_PAPER_JUMP * TUNE_PAPER_AHEAD_PX,
    ON_SURFACE = TUNE_PAPER_ON_SURFACE * TUNE_PAPER_AHEAD_PX,  // threshold for trying a slant
    LOST = TUNE_PAPER_MISFIT * TUNE_PAPER_AHEAD_PX,            // threshold for trying a jump
};

enum {
    OFFSETS = 5,          // disparities -2 .. 2 relative to a match
    HERE = OFFSETS / 2,   // index of the match itself among them
    FIELD_BITS = 12,      // bits for each sum when all sums are added at once
    NOWHERE = INT16_MIN,  // no disparity: the walk skipped this pixel
    TOO_EXPENSIVE = INT16_MAX,
    PROGRESS_ROWS = 8,
    // Upper bound of evaluations per pixel: the moves and the sum ahead of each walk, repair,
    // validation.
    EVALUATIONS_MAX =
        WALKS * (TUNE_PAPER_AHEAD_PX * (1 + 1 + 2 + 2 * (TUNE_PAPER_JUMP_MAX_PX - 1)) + 2) + 2 +
        OFFSETS,
};
_Static_assert(EVALUATIONS_MAX <= (int)MATCH_PAPER_EVALUATIONS_MAX, "as documented in the header");
_Static_assert(SIGNATURE_BITS *(2 * TUNE_PAPER_AROUND_PX + 1) < 1 << FIELD_BITS,
               "sums fit their fields");

// Position of a walk: a column of the left row and one of the right.
struct spot {
    int left, right;
};

struct move {
    int change;  // change of the disparity
    int score;   // sum over the pixels ahead after the move
    int total;   // score plus penalty
};

// Result of a walk for a pixel of the left row.
struct step {
    int16_t disparity;  // NOWHERE: the walk skipped this pixel
    int16_t score;      // sum over the pixels ahead from there
};

// A pixel of the left row.
struct column {
    struct step step[2];  // the walk forward, the walk back
    int16_t disparity;
    bool kept;
    uint64_t beside;  // 1 and the dissimilarities at the OFFSETS, FIELD_BITS each; 0: not kept
};

struct paper {
    const struct match_input *input;
    const struct match_options *options;
    struct match_output *output;
    int width, first, last;  // width in px; first and last disparity
    uint8_t *sample;         // 3 rows of grey values, 0 outside their spans
    uint32_t *left_signature, *right_signature;
    struct column *column;
    struct rectify_span left, right;  // valid columns of the present row
    uint32_t evaluations;             // in the present row
};

static void take_rows(struct match_memory *memory, struct paper *paper) {
    const size_t columns = (size_t)paper->width;
    paper->sample = match_take(memory, 3 * (columns + 2 * SAMPLE_REACH_PX), 1);
    paper->left_signature = match_take(memory, 2 * columns, sizeof *paper->left_signature);
    paper->column = match_take(memory, columns, sizeof *paper->column);
}

size_t match_paper_need_bytes(int width, const struct match_options *options) {
    if (width < 1 || width > IMAGE_MAX_SIDE_PX || !match_range_is_legal(options) ||
        options->speckle_px < 0) {
        return 0;
    }
    struct paper counted = {.width = width};
    struct match_memory memory = {0};
    take_rows(&memory, &counted);
    const size_t filtering = speckle_filter_need_bytes(width, options->speckle_px, 1);
    return memory.need_bytes > filtering ? memory.need_bytes : filtering;
}

static int clamp(int value, int min, int max) {
    return value < min ? min : (value > max ? max : value);
}

static struct rectify_span span_of(const struct rectify_span *spans, int y, int width) {
    return spans != NULL ? spans[y] : (struct rectify_span){0, (int16_t)width};
}

// Adds the samples of row y, or of the nearest existing row, to the signatures; drops the oldest.
static void push_samples(const struct paper *paper, const struct image_u8 *image,
                         const struct rectify_span *spans, int y, uint32_t *signature) {
    INVARIANT(image->width == paper->width);
    const int middle = clamp(y, 0, image->height - 1);
    match_input_rows(paper->input, MATCH_WANTS_GREY, middle - SAMPLE_REACH_PX,
                     middle + SAMPLE_REACH_PX + 1);
    const size_t length = (size_t)paper->width + 2 * SAMPLE_REACH_PX;
    memset(paper->sample, 0, 3 * length);
    for (int i = 0; i < 3; i++) {
        const int row = clamp(middle + (i - 1) * SAMPLE_REACH_PX, 0, image->height - 1);
        const struct rectify_span span = span_of(spans, row, paper->width);
        INVARIANT(span.begin >= 0 && span.begin <= span.end && span.end <= paper->width);
        memcpy(paper->sample + (size_t)i * length + SAMPLE_REACH_PX + span.begin,
               image_u8_row(image, row) + span.begin, (size_t)(span.end - span.begin));
    }
    const uint8_t *above = paper->sample + SAMPLE_REACH_PX;
    const uint8_t *here = above + length;
    const uint8_t *below = here + length;
    const uint32_t mask = (1u << SIGNATURE_BITS) - 1;
    for (int x = 0; x < paper->width; x++) {
        const uint8_t grey = here[x];
        const uint32_t left = (uint32_t)(here[x - 2] > grey) | (uint32_t)(here[x - 1] > grey) << 1;
        const uint32_t right = (uint32_t)(here[x + 1] > grey) | (uint32_t)(here[x + 2] > grey) << 1;
        const uint32_t column = (uint32_t)(above[x] > grey) | (uint32_t)(below[x] > grey) << 1;
        signature[x] = (signature[x] << SAMPLES | left << 4 | right << 2 | column) & mask;
    }
}

// Number of bits in which two signatures differ, and two pairs of neighbouring ones.
#if defined(__bfin__)
static inline int differing(uint32_t left, uint32_t right) {
    return __builtin_bfin_ones((int)(left ^ right));
}

static inline int differing_pairs(const uint32_t *left, const uint32_t *right) {
    return differing(left[0], right[0]) + differing(left[1], right[1]);
}
#else
static inline int count_bits(uint64_t word) {
    word -= word >> 1 & 0x5555555555555555u;
    word = (word & 0x3333333333333333u) + (word >> 2 & 0x3333333333333333u);
    word = (word + (word >> 4)) & 0x0f0f0f0f0f0f0f0fu;
    return (int)(word * 0x0101010101010101u >> 56);
}

static inline int differing(uint32_t left, uint32_t right) {
    return count_bits(left ^ right);
}

static inline int differing_pairs(const uint32_t *left, const uint32_t *right) {
    uint64_t words[2];
    memcpy(&words[0], left, sizeof words[0]);
    memcpy(&words[1], right, sizeof words[1]);
    return count_bits(words[0] ^ words[1]);
}
#endif

// A whole quotient below 256.
static inline int quotient(int numerator, int denominator) {
#if defined(__bfin__)
    return (int)quotient_8_bits((uint32_t)numerator, (uint32_t)denominator);
#else
    return numerator / denominator;
#endif
}

static inline bool inside(const struct paper *paper, struct spot spot) {
    return spot.left >= paper->left.begin && spot.left < paper->left.end &&
           spot.right >= paper->right.begin && spot.right < paper->right.end;
}

static inline struct spot further(struct spot spot, int pixels) {
    return (struct spot){spot.left + pixels, spot.right + pixels};
}

static inline int dissimilarity(struct paper *paper, struct spot spot) {
    paper->evaluations++;
    return differing(paper->left_signature[spot.left], paper->right_signature[spot.right]);
}

static inline bool room_ahead(const struct paper *paper, struct spot spot, int direction) {
    return inside(paper, spot) &&
           inside(paper, further(spot, (TUNE_PAPER_AHEAD_PX - 1) * direction));
}

// Sum of the dissimilarities ahead of a position with room; TOO_EXPENSIVE if it exceeds `limit`, or
// if a quarter of the pixels exceeds half of that.
static inline int score_ahead(struct paper *paper, struct spot spot, int direction, int limit) {
    // Two pixels at a time; backwards a pair begins at its second pixel.
    const int back = direction < 0 ? 1 : 0;
    const uint32_t *left = paper->left_signature + spot.left - back;
    const uint32_t *right = paper->right_signature + spot.right - back;
    int score = 0;
    for (int i = 2; i <= TUNE_PAPER_AHEAD_PX; i += 2) {
        score += differing_pairs(left, right);
        if (score > limit || (i == TUNE_PAPER_AHEAD_PX / 4 && 2 * score > limit)) {
            paper->evaluations += (uint32_t)i;
            return TOO_EXPENSIVE;
        }
        left += 2 * direction;
        right += 2 * direction;
    }
    paper->evaluations += TUNE_PAPER_AHEAD_PX;
    return score;
}

// Where a change of the disparity leads: it skips pixels of one row, and uses no pixel twice.
static inline struct spot changed(struct spot spot, int direction, int change) {
    return change * direction > 0 ? (struct spot){spot.left + change, spot.right}
                                  : (struct spot){spot.left, spot.right - change};
}

// The changes of the disparity that stay in its range and leave room ahead.
struct changes {
    int least, most;
};

static inline struct changes changes_from(const struct paper *paper, struct spot spot,
                                          int direction) {
    const int ahead = TUNE_PAPER_AHEAD_PX - 1;
    const int left =
        direction > 0 ? paper->left.end - 1 - spot.left : spot.left - paper->left.begin;
    const int right =
        direction > 0 ? paper->right.end - 1 - spot.right : spot.right - paper->right.begin;
    if (left < ahead || right < ahead) {
        return (struct changes){1, -1};
    }
    const int disparity = spot.left - spot.right;
    const int down = (direction > 0 ? right : left) - ahead;
    const int up = (direction > 0 ? left : right) - ahead;
    return (struct changes){
        .least = -down > paper->first - disparity ? -down : paper->first - disparity,
        .most = up < paper->last - disparity ? up : paper->last - disparity,
    };
}

static void try_move(struct paper *paper, struct spot spot, int direction,
                     const struct changes *changes, int change, int penalty, struct move *best) {
    if (change < changes->least || change > changes->most) {
        return;
    }
    const struct spot target = changed(spot, direction, change);
    const int score = score_ahead(paper, target, direction, best->total - penalty - 1);
    if (score != TOO_EXPENSIVE) {
        *best = (struct move){change, score, score + penalty};
    }
}

// The cheapest move if straight on scores `score`; `other` is the other walk's disparity there.
static struct move choose(struct paper *paper, struct spot spot, int direction, int score,
                          int other) {
    struct move best = {0, score, score};
    const int change = other - (spot.left - spot.right);
    const bool switches = other != NOWHERE && change != 0;
    if (!switches && score <= ON_SURFACE) {
        return best;
    }
    const struct changes changes = changes_from(paper, spot, direction);
    if (switches) {
        try_move(paper, spot, direction, &changes, change, PENALTY_OTHER_PATH, &best);
    }
    if (score > ON_SURFACE) {
        try_move(paper, spot, direction, &changes, 1, PENALTY_SLANT, &best);
        try_move(paper, spot, direction, &changes, -1, PENALTY_SLANT, &best);
    }
    for (int jump = 2; score > LOST && jump <= TUNE_PAPER_JUMP_MAX_PX; jump++) {
        try_move(paper, spot, direction, &changes, jump, PENALTY_JUMP, &best);
        try_move(paper, spot, direction, &changes, -jump, PENALTY_JUMP, &best);
    }
    INVARIANT(best.total <= score);
    return best;
}

// Not inlined: gcc makes jumps for the Blackfin that are too far otherwise.
__attribute__((noinline)) static void walk(struct paper *paper, int index) {
    const int own = index % 2;
    const int direction = own == 0 ? 1 : -1;
    for (int x = 0; x < paper->width; x++) {
        paper->column[x].step[own] = (struct step){NOWHERE, TOO_EXPENSIVE};
    }
    // From the ends of both rows, or as close to them as the range allows.
    const struct spot begin = {paper->left.begin, paper->right.begin};
    const struct spot end = {paper->left.end - 1, paper->right.end - 1};
    struct spot spot = direction > 0 ? begin : end;
    const int disparity = spot.left - spot.right;
    spot = changed(spot, direction, clamp(disparity, paper->first, paper->last) - disparity);
    int score = 0;
    if (room_ahead(paper, spot, direction)) {
        score = score_ahead(paper, spot, direction, TOO_EXPENSIVE - 1);
    }
    while (inside(paper, spot)) {
        struct column *column = &paper->column[spot.left];
        const int16_t here = (int16_t)(spot.left - spot.right);
        const int other = index == 0 ? NOWHERE : column->step[1 - own].disparity;
        const struct move move = choose(paper, spot, direction, score, other);
        if (move.change == direction) {  // a slant occludes nothing
            column->step[own] = (struct step){here, (int16_t)score};
        }
        spot = changed(spot, direction, move.change);
        INVARIANT(inside(paper, spot));
        INVARIANT(here + move.change >= paper->first && here + move.change <= paper->last);
        paper->column[spot.left].step[own] =
            (struct step){(int16_t)(here + move.change), (int16_t)move.score};
        score = move.score;
        if (room_ahead(paper, further(spot, direction), direction)) {
            // One pixel leaves the sum, one enters. Without room the walk goes straight on to the
            // end.
            score = move.score - dissimilarity(paper, spot) +
                    dissimilarity(paper, further(spot, TUNE_PAPER_AHEAD_PX * direction));
            INVARIANT(score >= 0 && score <= TUNE_PAPER_AHEAD_PX * SIGNATURE_BITS);
        }
        spot = further(spot, direction);
    }
}

static int dissimilarity_or_chance(struct paper *paper, int x, int disparity) {
    const struct spot spot = {x, x - disparity};
    const bool known = disparity >= paper->first && disparity <= paper->last && inside(paper, spot);
    return known ? dissimilarity(paper, spot) : CHANCE;
}

// Where the dissimilarities of both sides are least, with `left` before the edge and `right` after
// the pixels that are hidden there.
static int best_edge(struct paper *paper, int begin, int end, int left, int right, int hidden) {
    int cost = 0;  // cost relative to an edge at `begin`
    int lowest = 0;
    int edge = begin;
    for (int x = begin; x + hidden < end; x++) {
        cost += dissimilarity_or_chance(paper, x, left) -
                dissimilarity_or_chance(paper, x + hidden, right);
        edge = cost < lowest ? x + 1 : edge;
        lowest = cost < lowest ? cost : lowest;
    }
    return edge;
}

// Fills the gap [begin, end) between two kept pixels: with the left one's disparity up to an edge,
// and the right one's after it. If the right one is nearer, it hides as many pixels as the
// disparities differ; these stay rejected. The edge is put where the dissimilarities are smallest.
static void repair(struct paper *paper, int begin, int end) {
    struct column *column = paper->column;
    INVARIANT(begin < end && column[begin - 1].kept && column[end].kept);
    const int left = column[begin - 1].disparity;
    const int right = column[end].disparity;
    const int nearer = right - left > TUNE_PAPER_AGREE_PX ? right - left : 0;
    const int hidden = nearer < end - begin ? nearer : end - begin;
    const int edge = best_edge(paper, begin, end, left, right, hidden);
    INVARIANT(edge >= begin && edge + hidden <= end);
    for (int x = begin; x < end; x++) {
        column[x].kept = x < edge || x >= edge + hidden;
        column[x].disparity = (int16_t)(x < edge + hidden ? left : right);
        INVARIANT(!column[x].kept || inside(paper, (struct spot){x, x - column[x].disparity}));
    }
}

// Keeps the pixels on which the two walks agree, and repairs the rest.
static void join(struct paper *paper) {
    for (int x = 0; x < paper->width; x++) {
        struct column *column = &paper->column[x];
        const struct step *step = column->step;
        const int gap = step[0].disparity - step[1].disparity;
        column->disparity = step[step[1].score < step[0].score].disparity;
        column->kept = column->disparity != NOWHERE && gap <= TUNE_PAPER_AGREE_PX &&
                       gap >= -TUNE_PAPER_AGREE_PX;
    }
    for (int x = paper->left.begin; x < paper->left.end; x++) {
        const int begin = x;
        while (x < paper->left.end && !paper->column[x].kept) {
            x++;
        }
        if (begin < x && begin > paper->left.begin && x < paper->left.end) {
            repair(paper, begin, x);
        }
    }
}

static bool textured(const struct paper *paper, int x, int y) {
    const uint8_t *grey = image_u8_row(&paper->input->left, y);
    const int begin = clamp(x - TUNE_CONTRAST_COLUMNS / 2, paper->left.begin, paper->left.end);
    const int end = clamp(x + TUNE_CONTRAST_COLUMNS / 2 + 1, paper->left.begin, paper->left.end);
    uint8_t darkest = UINT8_MAX;
    uint8_t brightest = 0;
    for (int i = begin; i < end; i++) {
        darkest = grey[i] < darkest ? grey[i] : darkest;
        brightest = grey[i] > brightest ? grey[i] : brightest;
    }
    return match_accepts(MATCH_CONTRAST, brightest - darkest);
}

// Position of the lowest point of the "V" through the sums, in 1/256; at most half way to a
// neighbour.
static int refine_q8(const int *sum) {
    const int before = sum[HERE - 1] - sum[HERE];
    const int after = sum[HERE + 1] - sum[HERE];
    const int steeper = before > after ? before : after;
    const int half = DISPARITY_ONE / 2;
    const int fall = before - after;
    const int size = fall < 0 ? -fall : fall;
    const int offset = size < steeper ? quotient(size * half, steeper) : size > 0 ? half : 0;
    return fall < 0 ? -offset : offset;
}

static enum reason validate(const struct paper *paper, int x, int y, const int *sum, int count,
                            int margin) {
    const struct column *column = &paper->column[x];
    INVARIANT(!column->kept || (sum[HERE] >= 0 && sum[HERE] <= count * SIGNATURE_BITS));
    const struct match_accepted_range accepted = match_accepted_range_of(paper->options);
    const int index = column->disparity - paper->first;
    const bool at_end = index < accepted.first || index > accepted.last;
    enum reason reason = REASON_VALID;
    if (!column->kept) {
        reason = REASON_OCCLUDED;
    } else if (sum[HERE] > TUNE_PAPER_MISFIT * count || at_end) {
        reason = REASON_OUT_OF_RANGE;
    } else if (margin < TUNE_PAPER_MARGIN * count) {
        reason = REASON_AMBIGUOUS;
    }
    return reason == REASON_VALID || textured(paper, x, y) ? reason : REASON_NO_TEXTURE;
}

// `around` is the sum over the columns around.
static void finish_pixel(const struct paper *paper, int x, int y, uint64_t around) {
    // The disparities whose right pixel lies inside the span.
    const int min = clamp(x - paper->right.end + 1, paper->first, INT16_MAX);
    const int max = clamp(x - paper->right.begin, INT16_MIN, paper->last);
    int disparity_q8 = DISPARITY_ONE * paper->first;
    int confidence = 0;
    enum reason reason = REASON_BORDER;
    if (x >= paper->left.begin && x < paper->left.end && min <= max) {
        int sum[OFFSETS];
        for (int i = 0; i < OFFSETS; i++) {
            sum[i] = (int)(around >> i * FIELD_BITS & ((1u << FIELD_BITS) - 1));
        }
        const int count = (int)(around >> OFFSETS * FIELD_BITS);
        const int risen = sum[0] < sum[OFFSETS - 1] ? sum[0] : sum[OFFSETS - 1];
        const int margin = risen - sum[HERE];
        const int disparity = clamp(paper->column[x].disparity, min, max);
        disparity_q8 = DISPARITY_ONE * disparity;
        if (paper->column[x].kept) {
            INVARIANT(disparity == paper->column[x].disparity);
            INVARIANT(count >= 1 && count <= 2 * TUNE_PAPER_AROUND_PX + 1);
            disparity_q8 += disparity > min && disparity < max ? refine_q8(sum) : 0;
            confidence = margin > 0 ? quotient(margin * UINT8_MAX, risen + sum[HERE]) : 0;
        }
        reason =
            paper->options->keep_all ? REASON_VALID : validate(paper, x, y, sum, count, margin);
    }
    INVARIANT(confidence <= UINT8_MAX);
    image_i32_row(&paper->output->disparity_q8, y)[x] = disparity_q8;
    image_u8_row(&paper->output->confidence, y)[x] = (uint8_t)confidence;
    image_u8_row(&paper->output->reason, y)[x] = (uint8_t)reason;
}

__attribute__((noinline)) static void finish_row(struct paper *paper, int y) {
    struct column *column = paper->column;
    for (int x = 0; x < paper->width; x++) {
        column[x].beside = column[x].kept;
        for (int i = OFFSETS - 1; i >= 0 && column[x].kept; i--) {
            const int beside = dissimilarity_or_chance(paper, x, column[x].disparity + i - HERE);
            column[x].beside = column[x].beside << FIELD_BITS | (uint64_t)beside;
        }
    }
    uint64_t around = 0;
    for (int x = -TUNE_PAPER_AROUND_PX; x < paper->width; x++) {
        around +=
            x + TUNE_PAPER_AROUND_PX < paper->width ? column[x + TUNE_PAPER_AROUND_PX].beside : 0;
        around -= x > TUNE_PAPER_AROUND_PX ? column[x - TUNE_PAPER_AROUND_PX - 1].beside : 0;
        if (x >= 0) {
            finish_pixel(paper, x, y, around);
        }
    }
}

static void match_row(struct paper *paper, int y) {
    paper->left = span_of(paper->input->left_span, y, paper->width);
    paper->right = span_of(paper->input->right_span, y, paper->width);
    paper->evaluations = 0;
    for (int i = 0; i < WALKS; i++) {
        walk(paper, i);
    }
    join(paper);
    finish_row(paper, y);
    INVARIANT(paper->evaluations <= (uint32_t)EVALUATIONS_MAX * (uint32_t)paper->width);
}

int match_paper_run_counted(const struct match_input *input, const struct match_options *options,
                            match_progress *progress, void *progress_self, struct arena *arena,
                            struct match_output *output, uint64_t *evaluations) {
    const int error = match_check(input, options, output);
    if (error != ERROR_OK) {
        return error;
    }
    const size_t mark = arena_mark(arena);
    const int height = input->left.height;
    struct paper paper = {.input = input, .options = options, .output = output};
    paper.width = input->left.width;
    paper.first = match_searched_min(options);
    paper.last = paper.first + match_searched_count(options) - 1;
    INVARIANT(paper.width >= MATCH_MIN_WIDTH_PX && paper.first <= paper.last);
    struct match_memory memory = {.arena = arena};
    take_rows(&memory, &paper);
    if (memory.failed) {
        arena_release(arena, mark);
        return ERROR_MEMORY;
    }
    memset(paper.left_signature, 0, 2 * (size_t)paper.width * sizeof *paper.left_signature);
    paper.right_signature = paper.left_signature + paper.width;
    bool cancelled = false;
    *evaluations = 0;
    for (int y = -2 * SIGNATURE_REACH_ROWS; y < height && !cancelled; y++) {
        const int next = y + SIGNATURE_REACH_ROWS;
        push_samples(&paper, &input->left, input->left_span, next, paper.left_signature);
        push_samples(&paper, &input->right, input->right_span, next, paper.right_signature);
        if (y >= 0) {
            match_row(&paper, y);
            *evaluations += paper.evaluations;
            const bool due = progress != NULL && ((y + 1) % PROGRESS_ROWS == 0 || y + 1 == height);
            cancelled = due && !progress(progress_self, y + 1, height);
        }
    }
    arena_release(arena, mark);
    if (cancelled) {
        return ERROR_CANCELLED;
    }
    return options->keep_all
               ? ERROR_OK
               : speckle_filter_run_all(options->speckle_px, &parallel_serial, arena, output);
}

int match_paper_run(const struct match_input *input, const struct match_options *options,
                    match_progress *progress, void *progress_self, struct arena *arena,
                    struct match_output *output) {
    uint64_t evaluations;
    return match_paper_run_counted(input, options, progress, progress_self, arena, output,
                                   &evaluations);
}
