// SPDX-License-Identifier: Apache-2.0
#include "stereo/match/match_validity.h"

#include <string.h>

#include "core/error.h"
#include "stereo/image/reason.h"
#include "stereo/match/match_state.h"

enum {
    BLOCK = 8,        // pixels, both ways
    NOISE_STEP = 16,  // between blocks that noise is estimated from
    NOISE_MIN_BLOCKS = 8,
    NOISE_SHARE = 10,  // the estimate is the highest of the lowest 1/10 of the blocks
    NOISE_BINS = 1024,
    NOISE_BIN = 16,
    PAD = 2,             // columns before and after a smoothed row
    ROW_STEP = 2,        // between rows whose texture is measured
    SLOPE_ROWS = 3,      // smoothed rows in use
    AROUND_COLUMNS = 1,  // blocks that a block with texture supports, to each side
    MAX_PARTS = 8,
    NOISE_OF_SLOPE = 72,  // times the variance of a pixel: see slopes_of
    // The disparity changes by more than this over four columns at a depth edge, and slopes as near
    // to one may be the edge itself: where a curved object ends, both cameras see different points.
    RIM_STEP_Q8 = 8 * 256,
    RIM_COLUMNS = 3,
    // Limits (see match.md). Slopes along the row have this many times the energy of noise, and
    // this share of the energy of the slopes along the column: a misalignment of the rows by a
    // tenth of a pixel moves such structure by a third of a pixel.
    SIGNAL_MIN = 3,
    UPRIGHT_SHARE = 10,
    // A pixel is joined to the surface around it if this many of the 45 pixels of the window are on
    // it: half if only its cost rejected it, two thirds if it had a rival.
    JOIN_COLUMNS = 4,
    JOIN_ROWS = 2,
    JOIN_COST_MIN = 23,
    JOIN_RIVAL_MIN = 30,
    JOIN_STEP_Q8 = 384,
    MARK_JOINED = 0x40,
};

// No sum here can overflow.
bool match_range_is_legal(const struct match_options *options) {
    return options->disparity_count >= 1 && options->disparity_count <= MATCH_MAX_DISPARITIES &&
           options->extra_below >= 0 && options->extra_below <= MATCH_MAX_DISPARITIES &&
           options->extra_above >= 0 && options->extra_above <= MATCH_MAX_DISPARITIES &&
           match_searched_count(options) <= MATCH_MAX_DISPARITIES &&
           options->disparity_min >= -MATCH_DISPARITY_LIMIT + options->extra_below &&
           match_searched_count(options) - options->extra_below <=
               MATCH_DISPARITY_LIMIT - options->disparity_min;
}

static bool is_size_of_colour(const struct image_rgb8 *colour, int width, int height) {
    return colour->data == NULL || (colour->width == width && colour->height == height);
}

static bool sizes_agree(const struct match_input *input, const struct match_output *output) {
    const int width = input->left.width, height = input->left.height;
    return input->right.width == width && input->right.height == height &&
           is_size_of_colour(&input->left_colour, width, height) &&
           is_size_of_colour(&input->right_colour, width, height) &&
           output->disparity_q8.width == width && output->disparity_q8.height == height &&
           output->reason.width == width && output->reason.height == height &&
           output->confidence.width == width && output->confidence.height == height;
}

int match_check(const struct match_input *input, const struct match_options *options,
                const struct match_output *output) {
    const struct image_u8 *left = &input->left;
    if (!sizes_agree(input, output)) {
        return ERROR_SIZE_MISMATCH;
    }
    if (left->width > IMAGE_MAX_SIDE_PX || left->height > IMAGE_MAX_SIDE_PX) {
        return ERROR_TOO_LARGE;
    }
    if (left->width < MATCH_MIN_WIDTH_PX || left->height < MATCH_MIN_HEIGHT_PX) {
        return ERROR_TOO_SMALL;
    }
    if (!match_range_is_legal(options)) {
        return ERROR_DISPARITY_RANGE;
    }
    const bool legal = options->speckle_px >= 0 && (unsigned)options->preset < MATCH_PRESET_COUNT;
    return legal ? ERROR_OK : ERROR_ARGUMENT;
}

// Sum of |second derivative along row and column| of the difference of a block of the left image
// and the same block, `disparity` to the left, of the right one. It contains noise, but hardly any
// texture: source of the mask: J. Immerkaer, "Fast noise variance estimation", CVIU 64(2), 1996.
static uint32_t difference_of(const struct match_input *input, int x, int y, int disparity) {
    int16_t cross[BLOCK + 2][BLOCK];
    for (int j = 0; j < BLOCK + 2; j++) {
        const uint8_t *left = image_u8_row(&input->left, y + j - 1) + x;
        const uint8_t *right = image_u8_row(&input->right, y + j - 1) + x - disparity;
        for (int i = 0; i < BLOCK; i++) {
            cross[j][i] = (int16_t)(left[i - 1] - 2 * left[i] + left[i + 1] - right[i - 1] +
                                    2 * right[i] - right[i + 1]);
        }
    }
    uint32_t sum = 0;
    for (int j = 1; j <= BLOCK; j++) {
        for (int i = 0; i < BLOCK; i++) {
            const int second = cross[j - 1][i] - 2 * cross[j][i] + cross[j + 1][i];
            sum += (uint32_t)(second < 0 ? -second : second);
        }
    }
    return sum;
}

// The nearest whole disparity.
static int whole_disparity(int32_t disparity_q8) {
    return (disparity_q8 + 128) >> 8;
}

// Variance of the noise of a pixel in 1/256 of a squared grey level; 0 if too little was matched.
static uint32_t noise_q8(const struct match_input *input, const struct match_output *output) {
    enum { QUANTIZATION_Q8 = 21 };  // of whole grey levels
    const int width = output->reason.width;
    const int height = output->reason.height;
    uint32_t count[NOISE_BINS] = {0};
    uint32_t blocks = 0;
    for (int y = 1; y + BLOCK < height; y += NOISE_STEP) {
        const uint8_t *reason = image_u8_row(&output->reason, y + BLOCK / 2);
        const int32_t *disparity_q8 = image_i32_row(&output->disparity_q8, y + BLOCK / 2);
        for (int x = 1; x + BLOCK < width; x += NOISE_STEP) {
            const int disparity = whole_disparity(disparity_q8[x + BLOCK / 2]);
            if (reason[x + BLOCK / 2] != REASON_VALID || x - 1 - disparity < 0 ||
                x + BLOCK - disparity >= width) {
                continue;
            }
            const uint32_t bin = difference_of(input, x, y, disparity) / NOISE_BIN;
            count[bin < NOISE_BINS ? bin : NOISE_BINS - 1]++;
            blocks++;
        }
    }
    if (blocks < NOISE_MIN_BLOCKS) {
        return 0;
    }
    uint32_t below = 0;
    uint32_t bin = 0;
    while (below + count[bin] <= blocks / NOISE_SHARE) {
        below += count[bin++];
    }
    // For two images' normal noise of sigma the mean of |second derivative| is 6.77 sigma, and the
    // lowest tenth of the blocks ends 15 % below.
    const uint32_t sum = bin * NOISE_BIN + NOISE_BIN / 2;
    const uint32_t variance_q8 = (uint32_t)((uint64_t)sum * sum / 530);
    return variance_q8 > QUANTIZATION_Q8 ? variance_q8 : QUANTIZATION_Q8;
}

// One thread's rows of blocks, and its memory.
struct part {
    int begin, end;
    uint16_t *smooth[SLOPE_ROWS];  // rows y - 2, y and y + 2, smoothed by (1 2 1) both ways
    uint8_t *at_rim;               // by column: whether a depth edge is near
    uint32_t *along, *upright;     // by block of a row: squared slopes
    uint32_t *slopes;              // and their number
    uint8_t *has[3];               // by block: whether there is texture along the row; of row b in
                                   // b % 3
};

struct evidence {
    const struct match_input *input;
    struct match_output *output;
    uint32_t noise_q8;
    int blocks, block_rows;
    struct part part[MAX_PARTS];
    int parts;
};

static int clamped(int value, int end) {
    return value < 0 ? 0 : (value < end ? value : end - 1);
}

// Sixteen times row y of the left image, smoothed; beyond its valid pixels the ends are repeated.
static void smooth_row(const struct match_input *input, int y, uint16_t *smooth) {
    const int width = input->left.width;
    const int height = input->left.height;
    const uint8_t *restrict row[3];
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
    memset(smooth, 0, (size_t)(width + 2 * PAD) * sizeof *smooth);
    if (end - begin < 3) {
        return;
    }
    uint16_t *restrict to = smooth + PAD;
    for (int x = begin; x < end; x++) {
        to[x] = (uint16_t)(row[0][x] + 2 * row[1][x] + row[2][x]);
    }
    uint16_t before = to[begin];
    for (int x = begin; x < end; x++) {
        const uint16_t here = to[x];
        const uint16_t after = x + 1 < end ? to[x + 1] : here;
        to[x] = (uint16_t)(before + 2 * here + after);
        before = here;
    }
    for (int x = -PAD; x < begin; x++) {
        to[x] = to[begin];
    }
    for (int x = end; x < width + PAD; x++) {
        to[x] = to[end - 1];
    }
}

// Marks the columns of row y that are near a depth edge.
static void mark_rims(const struct match_output *output, int y, uint8_t *at_rim) {
    const int32_t *disparity_q8 = image_i32_row(&output->disparity_q8, y);
    const int width = output->reason.width;
    memset(at_rim, 0, (size_t)width);
    for (int x = PAD; x < width - PAD; x++) {
        const int32_t step_q8 = disparity_q8[x + PAD] - disparity_q8[x - PAD];
        if (step_q8 > RIM_STEP_Q8 || step_q8 < -RIM_STEP_Q8) {
            const int begin = x > RIM_COLUMNS ? x - RIM_COLUMNS : 0;
            const int end = x + RIM_COLUMNS < width ? x + RIM_COLUMNS + 1 : width;
            memset(at_rim + begin, 1, (size_t)(end - begin));
        }
    }
}

// Adds the squared slopes over four pixels, along row and column, of the middle row, of columns
// away from depth edges. Smoothing
// leaves 36 / 256 of the variance of the noise, a difference of two has twice that: 72 times the
// variance of a pixel, as the rows hold sixteen times the grey levels.
static void slopes_of(const struct evidence *of, const struct part *part) {
    const uint16_t *restrict above = part->smooth[0] + PAD;
    const uint16_t *restrict here = part->smooth[1] + PAD;
    const uint16_t *restrict below = part->smooth[2] + PAD;
    const int width = of->output->reason.width;
    for (int b = 0; b < of->blocks; b++) {
        const int x_end = (b + 1) * BLOCK < width ? (b + 1) * BLOCK : width;
        uint32_t along = 0;
        uint32_t upright = 0;
        uint32_t slopes = 0;
        for (int x = b * BLOCK; x < x_end; x++) {
            const uint32_t counts = part->at_rim[x] == 0;
            const int32_t slope_x = here[x + 2] - here[x - 2];
            const int32_t slope_y = below[x] - above[x];
            along += counts * (uint32_t)(slope_x * slope_x);
            upright += counts * (uint32_t)(slope_y * slope_y);
            slopes += counts;
        }
        part->slopes[b] += slopes;
        part->along[b] += along;
        part->upright[b] += upright;
    }
}

// Whether three blocks in a row have enough texture along it.
static bool has_texture(const struct evidence *of, const struct part *part, int b) {
    uint64_t along = 0;
    uint64_t upright = 0;
    uint64_t slopes = 0;
    for (int i = -1; i <= 1; i++) {
        along += part->along[clamped(b + i, of->blocks)];
        upright += part->upright[clamped(b + i, of->blocks)];
        slopes += part->slopes[clamped(b + i, of->blocks)];
    }
    const uint64_t noise = slopes * NOISE_OF_SLOPE * of->noise_q8 / 256;
    const uint64_t structure = upright > noise ? upright - noise : 0;
    return slopes > 0 && along >= (SIGNAL_MIN + 1) * noise + structure / UPRIGHT_SHARE;
}

static void measure_row(const struct evidence *of, struct part *part, int block_row) {
    uint8_t *has = part->has[block_row % 3];
    memset(part->along, 0, (size_t)of->blocks * sizeof *part->along);
    memset(part->upright, 0, (size_t)of->blocks * sizeof *part->upright);
    memset(part->slopes, 0, (size_t)of->blocks * sizeof *part->slopes);
    const int height = of->output->reason.height;
    for (int y = block_row * BLOCK; y < (block_row + 1) * BLOCK && y < height; y += ROW_STEP) {
        if (y == block_row * BLOCK) {
            smooth_row(of->input, y - ROW_STEP, part->smooth[0]);
            smooth_row(of->input, y, part->smooth[1]);
        } else {
            uint16_t *oldest = part->smooth[0];
            part->smooth[0] = part->smooth[1];
            part->smooth[1] = part->smooth[2];
            part->smooth[2] = oldest;
        }
        smooth_row(of->input, y + ROW_STEP, part->smooth[2]);
        mark_rims(of->output, y, part->at_rim);
        slopes_of(of, part);
    }
    for (int b = 0; b < of->blocks; b++) {
        has[b] = has_texture(of, part, b);
    }
}

static bool is_supported(const struct evidence *of, const struct part *part, int block_row, int b) {
    for (int r = block_row - 1; r <= block_row + 1; r++) {
        for (int i = b - AROUND_COLUMNS; r >= 0 && r < of->block_rows && i <= b + AROUND_COLUMNS;
             i++) {
            if (i >= 0 && i < of->blocks && part->has[r % 3][i] != 0) {
                return true;
            }
        }
    }
    return false;
}

static void reject(const struct evidence *of, int block_row, int b) {
    struct image_u8 *reason = &of->output->reason;
    const int x_end = (b + 1) * BLOCK < reason->width ? (b + 1) * BLOCK : reason->width;
    const int y_end =
        (block_row + 1) * BLOCK < reason->height ? (block_row + 1) * BLOCK : reason->height;
    for (int y = block_row * BLOCK; y < y_end; y++) {
        uint8_t *row = image_u8_row(reason, y);
        for (int x = b * BLOCK; x < x_end; x++) {
            row[x] = row[x] == REASON_VALID ? (uint8_t)REASON_NO_TEXTURE : row[x];
        }
    }
}

static void evidence_part(void *context, int index) {
    struct evidence *of = context;
    struct part *part = &of->part[index];
    if (part->begin == part->end) {
        return;
    }
    for (int r = part->begin > 0 ? part->begin - 1 : 0; r < part->begin + 1; r++) {
        measure_row(of, part, r);
    }
    for (int r = part->begin; r < part->end; r++) {
        if (r + 1 < of->block_rows) {
            measure_row(of, part, r + 1);
        }
        for (int b = 0; b < of->blocks; b++) {
            if (!is_supported(of, part, r, b)) {
                reject(of, r, b);
            }
        }
    }
}

static int part_count(int threads) {
    return threads < MAX_PARTS ? threads : MAX_PARTS;
}

static size_t block_count(int width) {
    return ((size_t)width + BLOCK - 1) / BLOCK;
}

size_t match_evidence_need_bytes(int width, int threads) {
    const size_t part = SLOPE_ROWS * arena_need_bytes((size_t)width + 2 * PAD, sizeof(uint16_t)) +
                        arena_need_bytes((size_t)width, 1) +
                        3 * arena_need_bytes(block_count(width), sizeof(uint32_t)) +
                        3 * arena_need_bytes(block_count(width), 1);
    return (size_t)part_count(threads) * part;
}

static bool take_part(struct arena *arena, int width, struct part *part) {
    bool taken = true;
    for (int i = 0; i < SLOPE_ROWS; i++) {
        part->smooth[i] = arena_take(arena, (size_t)width + 2 * PAD, sizeof(uint16_t));
        taken = taken && part->smooth[i] != NULL;
    }
    part->at_rim = arena_take(arena, (size_t)width, 1);
    part->along = arena_take(arena, block_count(width), sizeof *part->along);
    part->upright = arena_take(arena, block_count(width), sizeof *part->upright);
    part->slopes = arena_take(arena, block_count(width), sizeof *part->slopes);
    for (int i = 0; i < 3; i++) {
        part->has[i] = arena_take(arena, block_count(width), 1);
        taken = taken && part->has[i] != NULL;
    }
    return taken && part->at_rim != NULL && part->along != NULL && part->upright != NULL &&
           part->slopes != NULL;
}

// Number of accepted pixels around (x, y) that continue its surface.
static int companions(const struct match_output *output, int x, int y) {
    const int32_t here_q8 = image_i32_row(&output->disparity_q8, y)[x];
    const int x_begin = x > JOIN_COLUMNS ? x - JOIN_COLUMNS : 0;
    const int y_begin = y > JOIN_ROWS ? y - JOIN_ROWS : 0;
    const int width = output->reason.width;
    const int x_end = x + JOIN_COLUMNS < width ? x + JOIN_COLUMNS + 1 : width;
    const int height = output->reason.height;
    const int y_end = y + JOIN_ROWS < height ? y + JOIN_ROWS + 1 : height;
    int count = 0;
    for (int j = y_begin; j < y_end; j++) {
        const uint8_t *restrict reason = image_u8_row(&output->reason, j);
        const int32_t *restrict disparity_q8 = image_i32_row(&output->disparity_q8, j);
        for (int i = x_begin; i < x_end; i++) {
            const int32_t step_q8 = disparity_q8[i] - here_q8;
            count += (reason[i] == REASON_VALID) & (step_q8 <= JOIN_STEP_Q8) &
                     (step_q8 >= -JOIN_STEP_Q8);
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

// The cost of a winner grows with the slope of its surface and with differences of the lenses, and
// its margin shrinks, so that limits alone reject correct ones: those that continue a surface are
// kept.
static void join(const struct match_options *options, struct match_output *output) {
    const struct match_believed believed = match_believed_of(options);
    const int lowest = match_searched_min(options);
    const int width = output->reason.width;
    for (int y = 0; y < output->reason.height; y++) {
        uint8_t *reason = image_u8_row(&output->reason, y);
        const uint8_t *confidence = image_u8_row(&output->confidence, y);
        const int32_t *disparity_q8 = image_i32_row(&output->disparity_q8, y);
        for (int x = 0; x < width; x++) {
            const int index = whole_disparity(disparity_q8[x]) - lowest;
            const int min = reason[x] == REASON_AMBIGUOUS ? JOIN_RIVAL_MIN : JOIN_COST_MIN;
            if (is_doubtful(&believed, index, reason[x], confidence[x]) &&
                companions(output, x, y) >= min) {
                reason[x] = MARK_JOINED;
            }
        }
    }
    for (int y = 0; y < output->reason.height; y++) {
        uint8_t *reason = image_u8_row(&output->reason, y);
        for (int x = 0; x < width; x++) {
            reason[x] = reason[x] == MARK_JOINED ? (uint8_t)REASON_VALID : reason[x];
        }
    }
}

static int reject_unsupported(const struct match_input *input, const struct parallel *parallel,
                              struct arena *arena, struct match_output *output) {
    struct evidence of = {.input = input, .output = output, .noise_q8 = noise_q8(input, output)};
    if (of.noise_q8 == 0) {
        return ERROR_OK;
    }
    const size_t mark = arena_mark(arena);
    of.blocks = (int)block_count(output->reason.width);
    of.block_rows = (output->reason.height + BLOCK - 1) / BLOCK;
    of.parts = part_count(parallel->threads);
    for (int i = 0; i < of.parts; i++) {
        of.part[i].begin = of.block_rows * i / of.parts;
        of.part[i].end = of.block_rows * (i + 1) / of.parts;
        if (!take_part(arena, output->reason.width, &of.part[i])) {
            arena_release(arena, mark);
            return ERROR_MEMORY;
        }
    }
    parallel->run(parallel->self, evidence_part, &of, of.parts);
    arena_release(arena, mark);
    return ERROR_OK;
}

int match_evidence_run(const struct match_input *input, const struct match_options *options,
                       const struct parallel *parallel, struct arena *arena,
                       struct match_output *output) {
    const int error = reject_unsupported(input, parallel, arena, output);
    if (error == ERROR_OK) {
        join(options, output);
    }
    return error;
}
