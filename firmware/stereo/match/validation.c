// SPDX-License-Identifier: Apache-2.0
// Validation of pixels by what is around them: expensive winners are accepted where many others
// are; blocks are rejected that have too little texture, or too few accepted pixels around; then
// pixels that an object hides.
// Rows needed: of the maps, for a block those of the blocks up to four away (2 SHARE_BLOCKS), of 8
// rows each, and all for the noise of the pair; of the left image, three above and below a block.
#include <string.h>

#include "core/error.h"
#include "core/invariant.h"
#include "stereo/match/checks.h"
#include "stereo/match/state.h"

enum {
    BLOCK = 8,       // pixels, both ways
    PAD = 2,         // columns before and after a smoothed row
    ROW_STEP = 2,    // distance between rows whose texture is measured
    SLOPE_ROWS = 3,  // smoothed rows in use
    MAX_PARTS = 8,
    BATCH_BLOCKS = 4,     // rows of blocks whose texture the threads share
    AROUND_ROWS = 3,      // rows of the image above and below a block
    NOISE_OF_SLOPE = 72,  // times the variance of a pixel: see add_slopes
    // Blocks to each side: of those with texture that are counted, and for the share of the pixels
    // that the checks of single pixels accepted.
    NEAR_BLOCKS = 1,
    FAR_BLOCKS = 3,
    SHARE_BLOCKS = 2,
};

struct sums {
    uint16_t textured, strong, seen, accepted;
};

// One thread's rows of blocks, and its memory.
struct part {
    int begin, end;
    uint16_t *smooth[SLOPE_ROWS];     // rows y - 2, y and y + 2, smoothed by (1 2 1) both ways
    uint8_t *near_depth_edge;         // whether a depth edge is near, by column
    struct sums *column;              // over some rows of blocks, by block of a row
    struct sums *near, *share, *far;  // over blocks around each of a row
};

struct block {
    uint8_t textured;  // whether there is texture along the row
    uint8_t sloped;    // whether slopes along the row are above noise
    uint8_t strong;    // whether they are far above noise
    uint8_t seen;      // pixels that both cameras may see
    uint8_t accepted;  // of these, by the checks of single pixels
};

// Of a block.
struct slopes {
    uint32_t along, upright;  // sums of squared slopes
    uint32_t count;
};

struct block_check {
    const struct match_input *input;
    struct match_output *output;
    const struct match_look *look;
    struct match_noise noise;
    uint32_t noise_q8;
    bool coarse;            // whether the texture is
    struct block *map;      // all rows of blocks
    struct slopes *slopes;  // the same
    int blocks, block_rows;
    struct match_accepted_range accepted;
    int lowest;  // disparity searched
    struct part part[MAX_PARTS];
    int parts;
};

static int clamped(int value, int end) {
    return value < 0 ? 0 : (value < end ? value : end - 1);
}

// Where the pixels of a block end in an image that is `size` pixels wide or high.
static int block_end(int block, int size) {
    return (block + 1) * BLOCK < size ? (block + 1) * BLOCK : size;
}

static inline uint16_t smoothed(const uint8_t *const row[3], int before, int x, int after) {
    return (uint16_t)(row[0][before] + 2 * row[0][x] + row[0][after] +
                      2 * (row[1][before] + 2 * row[1][x] + row[1][after]) + row[2][before] +
                      2 * row[2][x] + row[2][after]);
}

// Sixteen times row y of the left image, smoothed; beyond its valid pixels the ends are repeated.
static void smooth_row(const struct match_input *input, int y, uint16_t *smooth) {
    const int width = input->left.width;
    const int height = input->left.height;
    const uint8_t *row[3];
    int begin = 0;
    int end = width;
    for (int j = 0; j < 3; j++) {
        const int at = clamped(y + j - 1, height);
        row[j] = image_u8_row(&input->left, at);
        if (input->left_span != NULL) {
            begin = input->left_span[at].begin > begin ? input->left_span[at].begin : begin;
            end = input->left_span[at].end < end ? input->left_span[at].end : end;
        }
    }
    if (end - begin < 3) {
        memset(smooth, 0, (size_t)(width + 2 * PAD) * sizeof *smooth);
        return;
    }
    uint16_t *restrict to = smooth + PAD;
    to[begin] = smoothed(row, begin, begin, begin + 1);
    for (int x = begin + 1; x < end - 1; x++) {
        to[x] = smoothed(row, x - 1, x, x + 1);
    }
    to[end - 1] = smoothed(row, end - 2, end - 1, end - 1);
    for (int x = -PAD; x < begin; x++) {
        to[x] = to[begin];
    }
    for (int x = end; x < width + PAD; x++) {
        to[x] = to[end - 1];
    }
}

// Marks the columns of row y that are near a depth edge.
static void mark_depth_edges(const struct match_output *output, int y, uint8_t *near_depth_edge) {
    const int32_t *disparity_q8 = image_i32_row(&output->disparity_q8, y);
    const int width = output->reason.width;
    memset(near_depth_edge, 0, (size_t)width);
    for (int x = PAD; x < width - PAD; x++) {
        const int32_t step_q8 = disparity_q8[x + PAD] - disparity_q8[x - PAD];
        if (step_q8 > TUNE_DEPTH_EDGE_PX * DISPARITY_ONE ||
            step_q8 < -TUNE_DEPTH_EDGE_PX * DISPARITY_ONE) {
            const int begin = x > TUNE_DEPTH_EDGE_COLUMNS ? x - TUNE_DEPTH_EDGE_COLUMNS : 0;
            const int end =
                x + TUNE_DEPTH_EDGE_COLUMNS < width ? x + TUNE_DEPTH_EDGE_COLUMNS + 1 : width;
            memset(near_depth_edge + begin, 1, (size_t)(end - begin));
        }
    }
}

// Adds the squared slopes over four pixels, along row and column, of the middle row, of columns
// away from depth edges. Smoothing leaves 36 / 256 of the variance of the noise, a difference of
// two has twice that: 72 times that of a pixel, as the rows hold sixteen times the grey levels.
static void add_slopes(const struct block_check *check, const struct part *part,
                       struct slopes *sums) {
    const uint16_t *restrict above = part->smooth[0] + PAD;
    const uint16_t *restrict here = part->smooth[1] + PAD;
    const uint16_t *restrict below = part->smooth[2] + PAD;
    const int width = check->output->reason.width;
    for (int b = 0; b < check->blocks; b++) {
        const int x_end = block_end(b, width);
        uint32_t along = 0;
        uint32_t upright = 0;
        uint32_t slopes = 0;
        for (int x = b * BLOCK; x < x_end; x++) {
            const uint32_t counts = part->near_depth_edge[x] == 0;
            const int32_t slope_x = here[x + 2] - here[x - 2];
            const int32_t slope_y = below[x] - above[x];
            along += counts * (uint32_t)(slope_x * slope_x);
            upright += counts * (uint32_t)(slope_y * slope_y);
            slopes += counts;
        }
        sums[b].count += slopes;
        sums[b].along += along;
        sums[b].upright += upright;
    }
}

// Judges the slopes of three blocks in a row.
static void classify_texture(const struct block_check *check, const struct slopes *sums, int b,
                             struct block *block) {
    uint64_t along = 0;
    uint64_t upright = 0;
    uint64_t slopes = 0;
    for (int i = -1; i <= 1; i++) {
        const struct slopes *of = &sums[clamped(b + i, check->blocks)];
        along += of->along;
        upright += of->upright;
        slopes += of->count;
    }
    const uint64_t noise = slopes * NOISE_OF_SLOPE * check->noise_q8 / 256;
    const uint64_t signal_min = (TUNE_SIGNAL + 1) * noise;
    const uint64_t structure = upright > noise ? upright - noise : 0;
    block->sloped = slopes > 0 && along >= signal_min;
    block->textured = slopes > 0 && along >= signal_min + structure / TUNE_UPRIGHT;
    block->strong = slopes > 0 && along >= TUNE_STRONG_SIGNAL * noise;
}

_Static_assert(BLOCK == sizeof(uint64_t), "the pixels of a row of a block are read at once");
static const uint64_t EACH_BYTE = UINT64_MAX / UINT8_MAX;

// 1 in each of eight bytes that differs from `value`.
static uint64_t differing(uint64_t bytes, uint8_t value) {
    const uint64_t low = EACH_BYTE * 0x7f;
    const uint64_t difference = bytes ^ EACH_BYTE * value;
    return (((difference & low) + low) | difference) >> 7 & EACH_BYTE;
}

static uint8_t sum_of_bytes(uint64_t bytes) {
    return (uint8_t)(bytes * EACH_BYTE >> 56);
}

static struct block *block_row_of(const struct block_check *check, int block_row) {
    return check->map + (size_t)block_row * (size_t)check->blocks;
}

static void count_row(const struct block_check *check, int block_row) {
    INVARIANT(block_row >= 0 && block_row < check->block_rows);
    struct block *blocks = block_row_of(check, block_row);
    const struct image_u8 *reason = &check->output->reason;
    const int y_end = block_end(block_row, reason->height);
    for (int b = 0; b < check->blocks; b++) {
        const int columns = block_end(b, reason->width) - b * BLOCK;
        uint64_t seen = 0, accepted = 0;
        for (int y = block_row * BLOCK; y < y_end; y++) {
            const uint8_t *from = image_u8_row(reason, y) + b * BLOCK;
            uint64_t pixels = EACH_BYTE * REASON_BORDER;
            if (columns == BLOCK) {
                memcpy(&pixels, from, BLOCK);  // a single read
            } else {
                memcpy(&pixels, from, (size_t)columns);
            }
            seen += differing(pixels, REASON_BORDER);
            accepted += EACH_BYTE - differing(pixels, REASON_VALID);
        }
        blocks[b] = (struct block){.seen = sum_of_bytes(seen), .accepted = sum_of_bytes(accepted)};
    }
}

static struct slopes *slopes_of(const struct block_check *check, int block_row) {
    return check->slopes + (size_t)block_row * (size_t)check->blocks;
}

static void measure_row(const struct block_check *check, struct part *part, int block_row) {
    struct slopes *slopes = slopes_of(check, block_row);
    memset(slopes, 0, (size_t)check->blocks * sizeof *slopes);
    const int height = check->output->reason.height;
    const int begin = block_row * BLOCK;
    for (int y = begin; y < begin + BLOCK && y < height; y += ROW_STEP) {
        if (y == begin) {
            smooth_row(check->input, y - ROW_STEP, part->smooth[0]);
            smooth_row(check->input, y, part->smooth[1]);
        } else {
            uint16_t *oldest = part->smooth[0];
            part->smooth[0] = part->smooth[1];
            part->smooth[1] = part->smooth[2];
            part->smooth[2] = oldest;
        }
        smooth_row(check->input, y + ROW_STEP, part->smooth[2]);
        mark_depth_edges(check->output, y, part->near_depth_edge);
        add_slopes(check, part, slopes);
    }
}

// Sums over rows of blocks, from the first one on and below the second one, by column.
static void sum_columns(const struct block_check *check, int row_begin, int row_end,
                        struct sums *restrict column) {
    memset(column, 0, (size_t)check->blocks * sizeof *column);
    for (int r = row_begin; r < row_end; r++) {
        const struct block *restrict blocks = block_row_of(check, r);
        for (int b = 0; b < check->blocks; b++) {
            column[b].textured = (uint16_t)(column[b].textured + blocks[b].textured);
            column[b].strong = (uint16_t)(column[b].strong + blocks[b].strong);
            column[b].seen = (uint16_t)(column[b].seen + blocks[b].seen);
            column[b].accepted = (uint16_t)(column[b].accepted + blocks[b].accepted);
        }
    }
}

// Sums over each block of a row and those up to `far` away, both ways.
static void sum_around(const struct block_check *check, const struct part *part, int block_row,
                       int far, struct sums *around) {
    sum_columns(check, clamped(block_row - far, check->block_rows),
                clamped(block_row + far, check->block_rows) + 1, part->column);
    for (int b = 0; b < check->blocks; b++) {
        const int last = clamped(b + far, check->blocks);
        struct sums sums = {0};
        for (int i = clamped(b - far, check->blocks); i <= last; i++) {
            sums.textured = (uint16_t)(sums.textured + part->column[i].textured);
            sums.strong = (uint16_t)(sums.strong + part->column[i].strong);
            sums.seen = (uint16_t)(sums.seen + part->column[i].seen);
            sums.accepted = (uint16_t)(sums.accepted + part->column[i].accepted);
        }
        INVARIANT(sums.accepted <= sums.seen);
        around[b] = sums;
    }
}

// Accepted pixels, in 1/255 of those that both cameras may see.
static int share_of(int accepted, int seen) {
    return seen > 0 ? UINT8_MAX * accepted / seen : 0;
}

// Where texture is faint noise makes correct winners expensive, but others around are accepted.
static void accept_costly(const struct block_check *check, int block_row, int b,
                          const struct sums *around) {
    const struct block *itself = &block_row_of(check, block_row)[b];
    if (itself->accepted == itself->seen ||
        share_of(around->accepted, around->seen) < TUNE_SHARE_ANY_COST) {
        return;
    }
    struct match_output *output = check->output;
    const int x_end = block_end(b, output->reason.width);
    const int y_end = block_end(block_row, output->reason.height);
    for (int y = block_row * BLOCK; y < y_end; y++) {
        uint8_t *reason = image_u8_row(&output->reason, y);
        const uint8_t *margin = image_u8_row(&output->confidence, y);
        const int32_t *disparity_q8 = image_i32_row(&output->disparity_q8, y);
        for (int x = b * BLOCK; x < x_end; x++) {
            const int lane = match_whole_disparity(disparity_q8[x]) - check->lowest;
            if (reason[x] == match_rules[MATCH_COST].reason && lane >= check->accepted.first &&
                lane <= check->accepted.last && match_accepts(MATCH_MARGIN, margin[x])) {
                reason[x] = REASON_VALID;
            }
        }
    }
}

// The first rule that rejects a block, or MATCH_RULES. The sums of column b are those around it.
static enum match_measure failed_rule(const struct block_check *check, const struct part *part,
                                      int block_row, int b) {
    const struct sums *around = &part->share[b];
    const int share = share_of(around->accepted, around->seen);
    const bool near_texture = part->near[b].textured >= TUNE_TEXTURED_NEAR;
    const struct block *itself = &block_row_of(check, block_row)[b];
    const bool sloped = itself->sloped != 0;
    const int own = share_of(itself->accepted, itself->seen);
    const int edge_share = own > share ? own : share;
    const bool coarse = check->coarse && around->strong < TUNE_STRONG_COARSE;
    const int values[MATCH_RULES] = {
        [MATCH_TEXTURE] = part->far[b].textured,
        [MATCH_SHARE] = near_texture || sloped ? UINT8_MAX : share,
        [MATCH_SHARE_EDGE] = sloped && !near_texture ? edge_share : UINT8_MAX,
        [MATCH_SHARE_COARSE] = coarse ? share : UINT8_MAX,
    };
    for (int i = MATCH_TEXTURE; i <= MATCH_SHARE_COARSE; i++) {
        if (!match_accepts((enum match_measure)i, values[i])) {
            return (enum match_measure)i;
        }
    }
    return MATCH_RULES;
}

static void reject(const struct block_check *check, int block_row, int b, uint8_t why) {
    struct image_u8 *reason = &check->output->reason;
    const int x_end = block_end(b, reason->width);
    const int y_end = block_end(block_row, reason->height);
    for (int y = block_row * BLOCK; y < y_end; y++) {
        uint8_t *row = image_u8_row(reason, y);
        for (int x = b * BLOCK; x < x_end; x++) {
            row[x] = row[x] == REASON_VALID ? why : row[x];
        }
    }
}

static uint32_t slope_at(const uint16_t *smooth, int x) {
    const int32_t slope = smooth[x + PAD] - smooth[x - PAD];
    return (uint32_t)(slope * slope);
}

// Where the plain pixels from x on end at an outline; x if they do not.
static int hidden_end(const uint16_t *smooth, uint64_t noise, int width, int x) {
    INVARIANT(x >= 0 && x < width);
    const int end = x + TUNE_HIDDEN_MAX_PX < width ? x + TUNE_HIDDEN_MAX_PX : width;
    int at = x > TUNE_PLAIN_BEFORE_PX ? x - TUNE_PLAIN_BEFORE_PX : 0;
    while (at < end && slope_at(smooth, at) <= TUNE_PLAIN_SLOPE * noise) {
        at++;
    }
    uint32_t steepest = 0;
    for (int i = at; i < end && i < at + TUNE_OUTLINE_PX; i++) {
        const uint32_t slope = slope_at(smooth, i);
        steepest = slope > steepest ? slope : steepest;
    }
    if (at < x || steepest <= TUNE_OUTLINE_SLOPE * noise) {
        return x;
    }
    return at;
}

// Whether the next eight pixels are.
static bool are_accepted(const uint8_t *reason) {
    uint64_t pixels;
    memcpy(&pixels, reason, sizeof pixels);
    return pixels == EACH_BYTE * REASON_VALID;
}

// What an object hides has no match. Where it has no texture along the row either, the nearest
// contrast decides: the object's outline, which gives it the object's disparity.
void match_reject_hidden(const uint16_t *smooth, uint32_t noise_q8, int width, uint8_t *reason) {
    const uint64_t noise = (uint64_t)NOISE_OF_SLOPE * noise_q8 / 256;
    uint16_t occluded = 0;       // the 16 pixels before: a bit each, 1 if occluded
    bool after_accepted = true;  // keeps a hidden area from beginning at column 0
    int end = 0;
    for (int x = 0; x < width; x++) {
        // Nothing changes within accepted pixels that follow an accepted one.
        while (after_accepted && x >= end && width - x > BLOCK && are_accepted(reason + x)) {
            occluded = (uint16_t)(occluded << BLOCK);
            x += BLOCK;
        }
        const bool is_occluded = reason[x] == REASON_OCCLUDED;
        const bool accepted = reason[x] == REASON_VALID;
        if (accepted && !after_accepted && x >= end &&
            __builtin_popcount(occluded) >= TUNE_HIDDEN_BEFORE) {
            end = hidden_end(smooth, noise, width, x);
        }
        if (accepted && !match_accepts(MATCH_PLAIN, end - x)) {
            reason[x] = match_rules[MATCH_PLAIN].reason;
        }
        occluded = (uint16_t)(occluded << 1 | is_occluded);
        after_accepted = accepted;
    }
}

static void count_part(void *context, int index) {
    const struct block_check *check = context;
    for (int r = check->part[index].begin; r < check->part[index].end; r++) {
        count_row(check, r);
    }
}

static void accept_part(void *context, int index) {
    const struct block_check *check = context;
    const struct part *part = &check->part[index];
    for (int r = part->begin; r < part->end; r++) {
        sum_around(check, part, r, SHARE_BLOCKS, part->share);
        for (int b = 0; b < check->blocks; b++) {
            accept_costly(check, r, b, &part->share[b]);
        }
    }
}

static void measure_part(void *context, int index) {
    struct block_check *check = context;
    struct part *part = &check->part[index];
    for (int r = part->begin; r < part->end; r++) {
        measure_row(check, part, r);
    }
}

static void classify_part(void *context, int index) {
    const struct block_check *check = context;
    for (int r = check->part[index].begin; r < check->part[index].end; r++) {
        count_row(check, r);
        for (int b = 0; b < check->blocks; b++) {
            classify_texture(check, slopes_of(check, r), b, &block_row_of(check, r)[b]);
        }
    }
}

static void reject_part(void *context, int index) {
    const struct block_check *check = context;
    const struct part *part = &check->part[index];
    for (int r = part->begin; r < part->end; r++) {
        sum_around(check, part, r, SHARE_BLOCKS, part->share);
        sum_around(check, part, r, NEAR_BLOCKS, part->near);
        sum_around(check, part, r, FAR_BLOCKS, part->far);
        for (int b = 0; b < check->blocks; b++) {
            const enum match_measure failed = failed_rule(check, part, r, b);
            if (failed != MATCH_RULES) {
                reject(check, r, b, match_rules[failed].reason);
            }
        }
    }
}

static void hidden_part(void *context, int index) {
    const struct block_check *check = context;
    const struct part *part = &check->part[index];
    for (int r = part->begin; r < part->end; r++) {
        for (int y = r * BLOCK; y < (r + 1) * BLOCK && y < check->output->reason.height; y++) {
            uint16_t *smooth = part->smooth[0];
            smooth_row(check->input, y, smooth);
            match_reject_hidden(smooth + PAD, check->noise_q8, check->output->reason.width,
                                image_u8_row(&check->output->reason, y));
        }
    }
}

// Divides rows of blocks [begin, end) among the parts.
static void divide(struct block_check *check, int begin, int end) {
    for (int i = 0; i < check->parts; i++) {
        check->part[i].begin = begin + (end - begin) * i / check->parts;
        check->part[i].end = begin + (end - begin) * (i + 1) / check->parts;
    }
}

// Runs a part of the work on all rows of blocks in their order, as far as the image's rows are
// needed.
static void run_in_order(struct block_check *check, const struct parallel *parallel,
                         enum match_wanted wanted, void (*part)(void *context, int index)) {
    for (int begin = 0; begin < check->block_rows; begin += BATCH_BLOCKS) {
        const int end =
            begin + BATCH_BLOCKS < check->block_rows ? begin + BATCH_BLOCKS : check->block_rows;
        match_input_rows(check->input, wanted, begin * BLOCK - AROUND_ROWS,
                         end * BLOCK + AROUND_ROWS);
        divide(check, begin, end);
        parallel->run(parallel->self, part, check, check->parts);
        if (part == measure_part) {
            match_noise_add(&check->noise, check->input, check->look, check->output, end * BLOCK);
        }
    }
}

static int part_count(int threads) {
    return threads < MAX_PARTS ? threads : MAX_PARTS;
}

static size_t block_count(int pixels) {
    return ((size_t)pixels + BLOCK - 1) / BLOCK;
}

static void take_blocks(struct match_memory *memory, int width, int height,
                        struct block_check *check) {
    const size_t blocks = block_count(width);
    check->map = match_take(memory, blocks * block_count(height), sizeof *check->map);
    check->slopes = match_take(memory, blocks * block_count(height), sizeof *check->slopes);
    for (int i = 0; i < check->parts; i++) {
        struct part *part = &check->part[i];
        for (int j = 0; j < SLOPE_ROWS; j++) {
            part->smooth[j] = match_take(memory, (size_t)width + 2 * PAD, sizeof *part->smooth[j]);
        }
        part->near_depth_edge = match_take(memory, (size_t)width, 1);
        part->column = match_take(memory, blocks, sizeof *part->column);
        part->near = match_take(memory, blocks, sizeof *part->near);
        part->share = match_take(memory, blocks, sizeof *part->share);
        part->far = match_take(memory, blocks, sizeof *part->far);
    }
}

size_t match_check_blocks_need_bytes(int width, int height, int threads) {
    struct block_check check = {.parts = part_count(threads)};
    struct match_memory memory = {0};
    take_blocks(&memory, width, height, &check);
    return memory.need_bytes;
}

int match_check_blocks(const struct match_input *input, const struct match_options *options,
                       const struct match_look *look, const struct parallel *parallel,
                       struct arena *arena, struct match_output *output) {
    struct block_check check = {.input = input,
                                .output = output,
                                .look = look,
                                .accepted = match_accepted_range_of(options),
                                .lowest = match_searched_min(options),
                                .coarse = look->smoothing == TUNE_SMOOTHING_COARSE};
    const size_t mark = arena_mark(arena);
    check.blocks = (int)block_count(output->reason.width);
    check.block_rows = (int)block_count(output->reason.height);
    check.parts = part_count(parallel->threads);
    INVARIANT(check.parts >= 1);
    struct match_memory memory = {.arena = arena};
    take_blocks(&memory, output->reason.width, output->reason.height, &check);
    if (!memory.failed) {
        divide(&check, 0, check.block_rows);
        parallel->run(parallel->self, count_part, &check, check.parts);
        parallel->run(parallel->self, accept_part, &check, check.parts);
        run_in_order(&check, parallel, MATCH_WANTS_GREY, measure_part);
        check.noise_q8 = match_noise_q8(&check.noise);
        divide(&check, 0, check.block_rows);
        parallel->run(parallel->self, classify_part, &check, check.parts);
        parallel->run(parallel->self, reject_part, &check, check.parts);
        run_in_order(&check, parallel, MATCH_WANTS_LEFT, hidden_part);
    }
    arena_release(arena, mark);
    return memory.failed ? ERROR_MEMORY : ERROR_OK;
}
