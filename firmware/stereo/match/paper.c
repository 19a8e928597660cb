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
#include "stereo/bfin/signatures.h"
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
    FIELD_BITS = 10,      // bits for each sum when three are added at once
    NOWHERE = INT16_MIN,  // no disparity: the walk skipped this pixel
    TOO_EXPENSIVE = INT16_MAX,
    PROGRESS_ROWS = 8,
    JUMPS = TUNE_PAPER_JUMP_MAX_PX - 1,  // from 2 px on
};
_Static_assert(SIGNATURE_BITS *(2 * TUNE_PAPER_AROUND_PX + 1) < 1 << FIELD_BITS,
               "sums fit their fields");
_Static_assert(OFFSETS == 5 && 3 * FIELD_BITS <= 32, "three in a word");

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

// The dissimilarities at the OFFSETS, and the number of pixels, FIELD_BITS each.
struct beside {
    uint32_t least, most;  // the first three; the last two, and the pixels
};

// A pixel of the left row.
struct column {
    struct step step[2];  // the walk forward, the walk back
    int16_t disparity;
    bool kept;
    struct beside beside;  // 0: not kept
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
        const uint8_t around[SAMPLES] = {here[x - 2], here[x - 1], here[x + 1],
                                         here[x + 2], above[x],    below[x]};
        uint32_t bits = signature[x];
        for (int i = 0; i < SAMPLES; i++) {
            bits = bits << 1 | (uint32_t)(here[x] - around[i]) >> 31;
        }
        signature[x] = bits & mask;
    }
}

// Number of bits in which two signatures differ.
#if defined(__bfin__)
_Static_assert(TUNE_PAPER_AHEAD_PX == 8, "as in signatures_ahead");
#else
static inline uint32_t bits_of_bytes(uint32_t word) {
    word -= word >> 1 & 0x55555555u;
    word = (word & 0x33333333u) + (word >> 2 & 0x33333333u);
    return (word + (word >> 4)) & 0x0f0f0f0fu;
}

static inline uint32_t sum_of_bytes(uint32_t word) {
    word = (word & 0x00ff00ffu) + (word >> 8 & 0x00ff00ffu);
    return (word + (word >> 16)) & UINT16_MAX;
}

static inline int signatures_differ(uint32_t left, uint32_t right) {
    return (int)sum_of_bytes(bits_of_bytes(left ^ right));
}

// The sum of the dissimilarities of the pixels ahead, and above its 16 bits twice that of the first
// quarter or the sum, whichever is more.
static inline int signatures_ahead(const uint32_t *left, const uint32_t *right,
                                   const int direction) {
    _Static_assert(8 * TUNE_PAPER_AHEAD_PX <= UINT8_MAX, "sums fit bytes");
    uint32_t bytes = 0, begin = 0;
    for (int i = 0; i < TUNE_PAPER_AHEAD_PX; i++) {
        bytes += bits_of_bytes(left[i * direction] ^ right[i * direction]);
        begin = i + 1 == TUNE_PAPER_AHEAD_PX / 4 ? 2 * sum_of_bytes(bytes) : begin;
    }
    const uint32_t sum = sum_of_bytes(bytes);
    return (int)(sum | (begin > sum ? begin : sum) << 16);
}
#endif

// A whole quotient below 256, and part / whole in halves of a disparity.
#if defined(__bfin__)
static inline int quotient(int numerator, int denominator) {
    return (int)quotient_8_bits((uint32_t)numerator, (uint32_t)denominator);
}

static inline int halves(int part, int whole) {
    return (int)quotient_7_places((uint32_t)part, (uint32_t)whole);
}
#else
static inline int quotient(int numerator, int denominator) {
    return numerator / denominator;
}

static inline int halves(int part, int whole) {
    return part * (DISPARITY_ONE / 2) / whole;
}
#endif

static inline struct spot further(struct spot spot, int pixels) {
    return (struct spot){spot.left + pixels, spot.right + pixels};
}

static inline bool inside(const struct paper *paper, struct spot spot) {
    return spot.left >= paper->left.begin && spot.left < paper->left.end &&
           spot.right >= paper->right.begin && spot.right < paper->right.end;
}

static inline int dissimilarity(const struct paper *paper, struct spot spot) {
    return signatures_differ(paper->left_signature[spot.left], paper->right_signature[spot.right]);
}

// Pixels of both rows from the spot to their ends.
static inline struct spot rooms_from(const struct paper *paper, struct spot spot, int direction) {
    return direction > 0 ? (struct spot){paper->left.end - spot.left, paper->right.end - spot.right}
                         : (struct spot){spot.left - paper->left.begin + 1,
                                         spot.right - paper->right.begin + 1};
}

static inline int room_from(const struct paper *paper, struct spot spot, int direction) {
    const struct spot rooms = rooms_from(paper, spot, direction);
    return rooms.left < rooms.right ? rooms.left : rooms.right;
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
    const struct spot rooms = rooms_from(paper, spot, direction);
    const int up = (direction > 0 ? rooms.left : rooms.right) - TUNE_PAPER_AHEAD_PX;
    const int down = (direction > 0 ? rooms.right : rooms.left) - TUNE_PAPER_AHEAD_PX;
    INVARIANT(up >= 0 && down >= 0);
    const int disparity = spot.left - spot.right;
    return (struct changes){
        .least = -down > paper->first - disparity ? -down : paper->first - disparity,
        .most = up < paper->last - disparity ? up : paper->last - disparity,
    };
}

// Takes a change if it is cheaper than the best one, from what signatures_ahead found `ahead`. A
// bad begin is as dear as a bad sum.
static inline void take_cheaper(int change, int ahead, int penalty, struct move *best) {
    if (ahead >> 16 < best->total - penalty) {
        const int score = ahead & UINT16_MAX;
        INVARIANT(score <= ahead >> 16 && score <= TUNE_PAPER_AHEAD_PX * SIGNATURE_BITS);
        *best = (struct move){change, score, score + penalty};
    }
}

static inline void try_move(const struct paper *paper, struct spot spot, int direction,
                            const struct changes *changes, int change, int penalty,
                            struct move *best) {
    if (change >= changes->least && change <= changes->most) {
        const struct spot target = changed(spot, direction, change);
        take_cheaper(change,
                     signatures_ahead(paper->left_signature + target.left,
                                      paper->right_signature + target.right, direction),
                     penalty, best);
    }
}

// What is ahead of `count` jumps by 2 px and more along one row. Returns the lowest.
static inline int look_ahead(const uint32_t *stays, const uint32_t *moves, const int direction,
                             int count, int *ahead) {
    int lowest = INT32_MAX;
    moves += 2 * direction;
    for (int i = 0; i < count; i++) {
        ahead[i] = signatures_ahead(stays, moves + i * direction, direction);
        lowest = ahead[i] < lowest ? ahead[i] : lowest;
    }
    return lowest;
}

static void try_jumps(const struct paper *paper, struct spot spot, const int direction,
                      const struct changes *changes, struct move *best) {
    const uint32_t *left = paper->left_signature + spot.left;
    const uint32_t *right = paper->right_signature + spot.right;
    // The row over whose pixels a jump up skips, and that of a jump down.
    const uint32_t *rises = direction > 0 ? left : right;
    const uint32_t *falls = direction > 0 ? right : left;
    int ahead_up[JUMPS], ahead_down[JUMPS];
    const int up = clamp(changes->most - 1, 0, JUMPS);
    const int down = clamp(-changes->least - 1, 0, JUMPS);
    const int lowest_up = look_ahead(falls, rises, direction, up, ahead_up);
    const int lowest_down = look_ahead(rises, falls, direction, down, ahead_down);
    const int lowest = lowest_up < lowest_down ? lowest_up : lowest_down;
    // Mostly none is cheap enough.
    for (int i = 0; lowest >> 16 < best->total - PENALTY_JUMP && i < JUMPS; i++) {
        if (i < up) {
            take_cheaper(2 + i, ahead_up[i], PENALTY_JUMP, best);
        }
        if (i < down) {
            take_cheaper(-2 - i, ahead_down[i], PENALTY_JUMP, best);
        }
    }
}

// The cheapest move if straight on scores `score`; `other` is the other walk's disparity there.
// There is room ahead.
__attribute__((noinline)) static struct move choose(const struct paper *paper, struct spot spot,
                                                    int direction, int score, int other) {
    struct move best = {0, score, score};
    const struct changes changes = changes_from(paper, spot, direction);
    const int change = other - (spot.left - spot.right);
    if (other != NOWHERE && change != 0) {
        try_move(paper, spot, direction, &changes, change, PENALTY_OTHER_PATH, &best);
    }
    if (score > ON_SURFACE) {
        try_move(paper, spot, direction, &changes, 1, PENALTY_SLANT, &best);
        try_move(paper, spot, direction, &changes, -1, PENALTY_SLANT, &best);
    }
    if (score > LOST) {
        if (direction > 0) {
            try_jumps(paper, spot, 1, &changes, &best);
        } else {
            try_jumps(paper, spot, -1, &changes, &best);
        }
    }
    INVARIANT(best.total <= score);
    return best;
}

// Forgets a walk, and returns where it begins: at the ends of both rows, or as close to them as the
// range allows.
static struct spot begin_walk(struct paper *paper, int own, int direction) {
    for (int x = 0; x < paper->width; x++) {
        paper->column[x].step[own] = (struct step){NOWHERE, TOO_EXPENSIVE};
    }
    const struct spot begin = {paper->left.begin, paper->right.begin};
    const struct spot end = {paper->left.end - 1, paper->right.end - 1};
    const struct spot spot = direction > 0 ? begin : end;
    const int disparity = spot.left - spot.right;
    return changed(spot, direction, clamp(disparity, paper->first, paper->last) - disparity);
}

// Not inlined: the Blackfin's conditional jumps are cheap if they are short.
__attribute__((noinline)) static void walk(struct paper *paper, int index) {
    const int own = index % 2;
    const int direction = 1 - 2 * own;
    struct spot spot = begin_walk(paper, own, direction);
    int room = room_from(paper, spot, direction);
    int score = 0;
    if (room >= TUNE_PAPER_AHEAD_PX) {
        score = UINT16_MAX & signatures_ahead(paper->left_signature + spot.left,
                                              paper->right_signature + spot.right, direction);
    }
    for (; room > 0; room--) {
        struct column *column = &paper->column[spot.left];
        int here = spot.left - spot.right;
        const int other = index == 0 ? NOWHERE : column->step[1 - own].disparity;
        const bool switches = other != NOWHERE && other != here;
        if ((switches || score > ON_SURFACE) && room >= TUNE_PAPER_AHEAD_PX) {
            const struct move move = choose(paper, spot, direction, score, other);
            if (move.change == direction) {  // a slant occludes nothing
                column->step[own] = (struct step){(int16_t)here, (int16_t)score};
            }
            spot = changed(spot, direction, move.change);
            column = &paper->column[spot.left];
            room = room_from(paper, spot, direction);
            INVARIANT(room >= TUNE_PAPER_AHEAD_PX);
            here += move.change;
            INVARIANT(here >= paper->first && here <= paper->last);
            score = move.score;
        }
        column->step[own] = (struct step){(int16_t)here, (int16_t)score};
        if (room > TUNE_PAPER_AHEAD_PX) {
            // One pixel leaves the sum, one enters. Without room the walk goes straight on to the
            // end.
            score += dissimilarity(paper, further(spot, TUNE_PAPER_AHEAD_PX * direction)) -
                     dissimilarity(paper, spot);
            INVARIANT(score >= 0 && score <= TUNE_PAPER_AHEAD_PX * SIGNATURE_BITS);
        }
        spot = further(spot, direction);
    }
}

static int dissimilarity_or_chance(const struct paper *paper, int x, int disparity) {
    const struct spot spot = {x, x - disparity};
    const bool known = disparity >= paper->first && disparity <= paper->last && inside(paper, spot);
    return known ? dissimilarity(paper, spot) : CHANCE;
}

// Where the dissimilarities of both sides are least, with `left` before the edge and `right` after
// the pixels that are hidden there.
static int best_edge(const struct paper *paper, int begin, int end, int left, int right,
                     int hidden) {
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
static int refine_q8(int before, int here, int after) {
    const int steeper = (before > after ? before : after) - here;
    const int half = DISPARITY_ONE / 2;
    const int fall = before - after;
    const int size = fall < 0 ? -fall : fall;
    const int offset = size < steeper ? halves(size, steeper) : size > 0 ? half : 0;
    return fall < 0 ? -offset : offset;
}

static enum reason validate(const struct paper *paper, int x, int here, int count, int margin) {
    const struct match_accepted_range accepted = match_accepted_range_of(paper->options);
    const int index = paper->column[x].disparity - paper->first;
    enum reason reason = REASON_VALID;
    if (here > TUNE_PAPER_MISFIT * count || index < accepted.first || index > accepted.last) {
        reason = REASON_OUT_OF_RANGE;
    } else if (margin < TUNE_PAPER_MARGIN * count) {
        reason = REASON_AMBIGUOUS;
    }
    return reason;
}

static inline int field(uint32_t word, int index) {
    return (int)(word >> index * FIELD_BITS & ((1u << FIELD_BITS) - 1));
}

// The disparities whose right pixel lies inside the span; of a column that has some.
static inline struct changes disparities_at(const struct paper *paper, int x) {
    const int least = x - paper->right.end + 1;
    const int most = x - paper->right.begin;
    return (struct changes){.least = least > paper->first ? least : paper->first,
                            .most = most < paper->last ? most : paper->last};
}

struct finished {
    int32_t *disparity_q8;
    uint8_t *confidence, *reason;
};

// `around` is the sum over the columns around.
static void finish_pixel(const struct paper *paper, int x, int y, const struct beside *around,
                         const struct finished *row) {
    const struct changes range = disparities_at(paper, x);
    INVARIANT(range.least <= range.most);
    enum reason reason = REASON_OCCLUDED;
    int disparity = paper->column[x].disparity;
    int fraction_q8 = 0;
    int confidence = 0;
    if (paper->column[x].kept) {
        const int here = field(around->least, 2);
        const int count = field(around->most, 2);
        const int below = field(around->least, 0);
        const int above = field(around->most, 1);
        const int risen = below < above ? below : above;
        const int margin = risen - here;
        INVARIANT(disparity >= range.least && disparity <= range.most);
        INVARIANT(count >= 1 && count <= 2 * TUNE_PAPER_AROUND_PX + 1);
        if (disparity > range.least && disparity < range.most) {
            fraction_q8 = refine_q8(field(around->least, 1), here, field(around->most, 0));
        }
        confidence = margin > 0 ? quotient(margin * UINT8_MAX, risen + here) : 0;
        INVARIANT(confidence <= UINT8_MAX);
        reason = validate(paper, x, here, count, margin);
    } else {
        disparity = clamp(disparity, range.least, range.most);
    }
    if (reason != REASON_VALID) {
        reason = paper->options->keep_all ? REASON_VALID
                 : textured(paper, x, y)  ? reason
                                          : REASON_NO_TEXTURE;
    }
    row->disparity_q8[x] = DISPARITY_ONE * disparity + fraction_q8;
    row->confidence[x] = (uint8_t)confidence;
    row->reason[x] = (uint8_t)reason;
}

static struct beside compare_beside(const struct paper *paper, int x) {
    const int disparity = paper->column[x].disparity;
    INVARIANT(inside(paper, (struct spot){x, x - disparity}));
    const uint32_t left = paper->left_signature[x];
    const uint32_t *right = paper->right_signature + x - disparity;
    const struct changes range = disparities_at(paper, x);
    uint32_t differ[OFFSETS];
    if (disparity - HERE >= range.least && disparity + HERE <= range.most) {
        for (int i = 0; i < OFFSETS; i++) {
            differ[i] = (uint32_t)signatures_differ(left, right[HERE - i]);
        }
    } else {
        for (int i = 0; i < OFFSETS; i++) {
            differ[i] = (uint32_t)dissimilarity_or_chance(paper, x, disparity + i - HERE);
        }
    }
    return (struct beside){
        differ[0] | differ[1] << FIELD_BITS | differ[2] << 2 * FIELD_BITS,
        differ[3] | differ[4] << FIELD_BITS | 1u << 2 * FIELD_BITS,
    };
}

static void finish_border(const struct paper *paper, const struct finished *row, int begin,
                          int end) {
    for (int x = begin; x < end; x++) {
        row->disparity_q8[x] = DISPARITY_ONE * paper->first;
        row->confidence[x] = 0;
        row->reason[x] = REASON_BORDER;
    }
}

__attribute__((noinline)) static void finish_row(const struct paper *paper, int y) {
    const struct finished row = {image_i32_row(&paper->output->disparity_q8, y),
                                 image_u8_row(&paper->output->confidence, y),
                                 image_u8_row(&paper->output->reason, y)};
    // The columns with a disparity whose right pixel lies inside the span.
    const int begin = clamp(paper->first + paper->right.begin, paper->left.begin, paper->left.end);
    const int most = paper->right.begin < paper->right.end ? paper->last + paper->right.end : begin;
    const int end = clamp(most, begin, paper->left.end);
    INVARIANT(0 <= begin && begin <= end && end <= paper->width);
    struct column *column = paper->column;
    struct beside around = {0, 0};
    finish_border(paper, &row, 0, begin);
    for (int x = begin - TUNE_PAPER_AROUND_PX; x < end; x++) {
        const int next = x + TUNE_PAPER_AROUND_PX;
        const int gone = x - TUNE_PAPER_AROUND_PX - 1;
        if (next < end) {
            column[next].beside = (struct beside){0, 0};
            if (column[next].kept) {
                column[next].beside = compare_beside(paper, next);
            }
            around.least += column[next].beside.least;
            around.most += column[next].beside.most;
        }
        if (gone >= begin) {
            around.least -= column[gone].beside.least;
            around.most -= column[gone].beside.most;
        }
        if (x >= begin) {
            finish_pixel(paper, x, y, &around, &row);
        }
    }
    finish_border(paper, &row, end, paper->width);
}

static void match_row(void *shared, int y) {
    // Its own, on the stack of the row.
    struct paper paper = *(const struct paper *)shared;
    paper.left = span_of(paper.input->left_span, y, paper.width);
    paper.right = span_of(paper.input->right_span, y, paper.width);
    for (int i = 0; i < WALKS; i++) {
        walk(&paper, i);
    }
    join(&paper);
    finish_row(&paper, y);
}

// The signatures of the row whose neighbourhood ends with row `next`.
static void push_row(void *shared, int next) {
    const struct paper *paper = shared;
    const struct match_input *input = paper->input;
    push_samples(paper, &input->left, input->left_span, next, paper->left_signature);
    push_samples(paper, &input->right, input->right_span, next, paper->right_signature);
}

int match_paper_run(const struct match_input *input, const struct match_options *options,
                    match_progress *progress, void *progress_self, struct arena *arena,
                    struct match_output *output) {
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
    for (int y = -2 * SIGNATURE_REACH_ROWS; y < height && !cancelled; y++) {
        parallel_call(push_row, &paper, y + SIGNATURE_REACH_ROWS);
        if (y >= 0) {
            parallel_call(match_row, &paper, y);
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
