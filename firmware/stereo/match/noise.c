// SPDX-License-Identifier: Apache-2.0
// Noise: of the images before matching, which decides how they are smoothed, and of the pair by
// what differs between pixels that match. Rows needed: of the pair, those of blocks of 8x8 pixels,
// 16 apart; of the images before, of every n-th row of blocks, of which LOOK_ROWS are enough.
#include <string.h>

#include "core/invariant.h"
#include "stereo/image/reason.h"
#include "stereo/match/checks.h"
#include "stereo/match/tuning.h"

enum {
    BLOCK = 8,  // pixels, both ways
    STEP = 16,  // pixels from block to block
    MIN_BLOCKS = 8,
    LOOK_ROWS = 48,  // rows of blocks that the first look takes, at least where there are so many
    BINS = MATCH_NOISE_BINS,
    BIN = 8,
    PAIR_BIN = 16,
    // Normal noise of sigma grey levels has a mean |second derivative| of 4.8 sigma, and the lowest
    // fiftieth of the blocks ends 24 % below: at 233 sigma a block.
    FLOOR_OF_SIGMA = 233,
    // Slopes over 2 and over 8 pixels of the row. Where the shorter ones have a small share of the
    // squares, more smoothing loses no detail: out of focus, or enlarged by the lens.
    NEAR = 1,
    FAR = 4,
    SHARES = 64,           // value of a share of 1
    QUANTIZATION_Q8 = 21,  // variance of rounding to whole grey levels
};

static struct rectify_span span_of(const struct image_u8 *image, const struct rectify_span *spans,
                                   int y) {
    return spans == NULL ? (struct rectify_span){0, (int16_t)image->width} : spans[y];
}

// Rows from one row of blocks that the first look takes to the next.
static int look_step(int height) {
    const int block_rows = height / STEP;
    return block_rows < 2 * LOOK_ROWS ? STEP : block_rows / LOOK_ROWS * STEP;
}

static void look_at_row(const struct image_u8 *image, const struct rectify_span *spans, int y,
                        struct match_limits *limits) {
    const uint8_t *restrict row = image_u8_row(image, y);
    const struct rectify_span span = span_of(image, spans, y);
    uint8_t darkest = UINT8_MAX;
    uint8_t brightest = 0;
    for (int x = span.begin; x < span.end; x++) {
        darkest = row[x] < darkest ? row[x] : darkest;
        brightest = row[x] > brightest ? row[x] : brightest;
    }
    limits->darkest = darkest < limits->darkest ? darkest : limits->darkest;
    limits->brightest = brightest > limits->brightest ? brightest : limits->brightest;
}

// Whether any pixel is coloured.
static bool has_colour(const struct image_rgb8 *image, int y) {
    const uint8_t *row = image_rgb8_row(image, y);
    for (int x = 0; x < image->width; x++) {
        if (row[3 * x] != row[3 * x + 1] || row[3 * x] != row[3 * x + 2]) {
            return true;
        }
    }
    return false;
}

// Grey levels and colour, of all rows around the blocks.
static void look_at_levels(const struct match_input *input, struct match_look *look) {
    const struct image_rgb8 *colour[2] = {&input->left_colour, &input->right_colour};
    const int height = input->left.height;
    for (int i = 0; i < 2; i++) {
        look->limits[i] = (struct match_limits){UINT8_MAX, 0};
        look->coloured[i] = false;
    }
    for (int begin = 0; begin < height; begin += look_step(height)) {
        const int end = begin + STEP < height ? begin + STEP : height;
        match_input_rows(input, MATCH_WANTS_COLOUR, begin, end);
        for (int y = begin; y < end; y++) {
            look_at_row(&input->left, input->left_span, y, &look->limits[0]);
            look_at_row(&input->right, input->right_span, y, &look->limits[1]);
            for (int i = 0; i < 2; i++) {
                look->coloured[i] =
                    look->coloured[i] || (colour[i]->data != NULL && has_colour(colour[i], y));
            }
        }
    }
}

// A block of 8x8 grey levels, or of differences, and the pixels around.
struct patch {
    int16_t at[BLOCK + 2][BLOCK + 2];
};

// Adds a block of an image, times `sign`. Whether no pixel can be clipped. Not inlined: unrolled
// code of three callers is too much for the smallest image.
static __attribute__((noinline)) bool add_patch(const struct image_u8 *image, int x, int y,
                                                struct match_limits limits, int sign,
                                                struct patch *patch) {
    INVARIANT(x > 0 && x + BLOCK < image->width && y > 0 && y + BLOCK < image->height);
    uint8_t clipped = 0;
    for (int j = 0; j < BLOCK + 2; j++) {
        const uint8_t *restrict row = image_u8_row(image, y + j - 1) + x - 1;
        int16_t *restrict at = patch->at[j];
        for (int i = 0; i < BLOCK + 2; i++) {
            at[i] = (int16_t)(at[i] + sign * row[i]);
        }
        for (int i = 1; i <= BLOCK; i++) {
            clipped |= (row[i] == limits.darkest) | (row[i] == limits.brightest);
        }
    }
    return clipped == 0;
}

// Sum of |second derivative along row and column| of a block, source of the mask: J. Immerkaer,
// "Fast noise variance estimation", CVIU 64(2), 1996.
static int second_derivatives(const struct patch *patch) {
    int16_t along[BLOCK + 2][BLOCK];
    for (int j = 0; j < BLOCK + 2; j++) {
        const int16_t *row = patch->at[j];
        for (int i = 0; i < BLOCK; i++) {
            along[j][i] = (int16_t)(row[i] - 2 * row[i + 1] + row[i + 2]);
        }
    }
    int sum = 0;
    for (int j = 1; j <= BLOCK; j++) {
        for (int i = 0; i < BLOCK; i++) {
            const int second = along[j - 1][i] - 2 * along[j][i] + along[j + 1][i];
            sum += second < 0 ? -second : second;
        }
    }
    return sum;
}

// -1 if a pixel may be clipped.
static int roughness(const struct image_u8 *image, int x, int y, struct match_limits limits) {
    struct patch patch = {0};
    return add_patch(image, x, y, limits, 1, &patch) ? second_derivatives(&patch) : -1;
}

// Columns that are valid in all rows of the blocks at y.
static struct rectify_span common_span(const struct image_u8 *image,
                                       const struct rectify_span *spans, int y) {
    struct rectify_span common = {0, (int16_t)image->width};
    for (int j = y - 1; j <= y + BLOCK; j++) {
        const struct rectify_span span = span_of(image, spans, j);
        common.begin = span.begin > common.begin ? span.begin : common.begin;
        common.end = span.end < common.end ? span.end : common.end;
    }
    return common;
}

// The bin that ends above a share of the blocks.
static int bin_above(const uint32_t count[BINS], uint32_t blocks) {
    uint32_t below = 0;
    int bin = 0;
    while (below + count[bin] <= blocks) {
        below += count[bin++];
        INVARIANT(bin < BINS);
    }
    return bin;
}

static void add_block(struct match_noise *histogram, int bin) {
    histogram->count[bin < BINS ? bin : BINS - 1]++;
    histogram->blocks++;
}

static void add_roughness(const struct image_u8 *image, const struct rectify_span *spans, int y,
                          struct match_limits limits, struct match_noise *histogram) {
    const struct rectify_span span = common_span(image, spans, y);
    for (int x = span.begin + 1; x + BLOCK < span.end; x += STEP) {
        const int sum = roughness(image, x, y, limits);
        if (sum >= 0) {
            add_block(histogram, sum / BIN);
        }
    }
}

// What the blocks of an image have: the smoothest ones, and half of them. 0 if there are too few.
struct roughnesses {
    int noise, usual;
};

static struct roughnesses roughnesses_of(const struct match_noise *histogram) {
    if (histogram->blocks < MIN_BLOCKS) {
        return (struct roughnesses){0, 0};
    }
    return (struct roughnesses){
        BIN * bin_above(histogram->count, histogram->blocks / TUNE_NOISE_FLOOR_SHARE),
        BIN * bin_above(histogram->count, histogram->blocks / 2)};
}

// Sum of the squared slopes over 2 `reach` pixels along the row, of a block.
static int slopes_over(const struct image_u8 *image, int x, int y, int reach) {
    int sum = 0;
    for (int j = 0; j < BLOCK; j++) {
        const uint8_t *row = image_u8_row(image, y + j) + x;
        for (int i = 0; i < BLOCK; i++) {
            const int slope = row[i + reach] - row[i - reach];
            sum += slope * slope;
        }
    }
    return sum;
}

// The share of the slopes over 8 pixels that is in those over 2, without noise, of the blocks at y.
static void add_fine_share(const struct image_u8 *image, const struct rectify_span *spans, int y,
                           int noise, struct match_noise *histogram) {
    INVARIANT(noise < 2 * TUNE_NOISE_STRONG);
    const int of_noise = 2 * BLOCK * BLOCK * noise * noise / (FLOOR_OF_SIGMA * FLOOR_OF_SIGMA);
    const struct rectify_span span = common_span(image, spans, y);
    for (int x = span.begin + FAR; x + BLOCK + FAR <= span.end; x += STEP) {
        const int far = slopes_over(image, x, y, FAR) - of_noise;
        if (far > TUNE_COARSE_SIGNAL * of_noise) {
            const int near = slopes_over(image, x, y, NEAR) - of_noise;
            const int share = near > 0 ? (int)((int64_t)SHARES * near / far) : 0;
            add_block(histogram, share < SHARES ? share : SHARES);
        }
    }
}

// Of half of the blocks; all if there are too few.
static int fine_share_of(const struct match_noise *histogram) {
    return histogram->blocks < MIN_BLOCKS ? SHARES
                                          : bin_above(histogram->count, histogram->blocks / 2);
}

static int coarseness_smoothing(const struct match_input *input, int left_noise, int right_noise) {
    const int height = input->left.height;
    struct match_noise left = {.blocks = 0}, right = {.blocks = 0};
    for (int y = 1; y + BLOCK < height; y += look_step(height)) {
        match_input_rows(input, MATCH_WANTS_COLOUR, y - 1, y + BLOCK + 1);
        add_fine_share(&input->left, input->left_span, y, left_noise, &left);
        add_fine_share(&input->right, input->right_span, y, right_noise, &right);
    }
    const int share = (fine_share_of(&left) + fine_share_of(&right)) / 2;
    return share > TUNE_COARSE_SHARE ? TUNE_SMOOTHING_WEAK : TUNE_SMOOTHING_COARSE;
}

static int smoothing_of(const struct match_input *input, const struct match_look *look) {
    const int height = input->left.height;
    struct match_noise histogram[2] = {{.blocks = 0}, {.blocks = 0}};
    for (int y = 1; y + BLOCK < height; y += look_step(height)) {
        match_input_rows(input, MATCH_WANTS_COLOUR, y - 1, y + BLOCK + 1);
        add_roughness(&input->left, input->left_span, y, look->limits[0], &histogram[0]);
        add_roughness(&input->right, input->right_span, y, look->limits[1], &histogram[1]);
    }
    const struct roughnesses left = roughnesses_of(&histogram[0]);
    const struct roughnesses right = roughnesses_of(&histogram[1]);
    const int noise = (left.noise + right.noise) / 2;
    const int usual = (left.usual + right.usual) / 2;
    if (noise < TUNE_NOISE_WEAK || usual > TUNE_FINE_TEXTURE * noise) {
        return 0;
    }
    return noise >= TUNE_NOISE_STRONG ? TUNE_SMOOTHING_STRONG
                                      : coarseness_smoothing(input, left.noise, right.noise);
}

void match_look_at(const struct match_input *input, struct match_look *look) {
    look_at_levels(input, look);
    look->smoothing = smoothing_of(input, look);
}

// Second derivatives of the difference of a block of the left image and the same block, `disparity`
// to the left, of the right one. They contain noise, but hardly any texture. -1 if a pixel may be
// clipped.
static int difference_of(const struct match_input *input, const struct match_limits limits[2],
                         int x, int y, int disparity) {
    struct patch patch = {0};
    return add_patch(&input->left, x, y, limits[0], 1, &patch) &&
                   add_patch(&input->right, x - disparity, y, limits[1], -1, &patch)
               ? second_derivatives(&patch)
               : -1;
}

// Adds what differs between the pixels of the blocks at y and those that they match.
static void add_differences(const struct match_input *input, const struct match_look *look,
                            const struct match_output *output, int y,
                            struct match_noise *histogram) {
    const int width = output->reason.width;
    const uint8_t *reason = image_u8_row(&output->reason, y + BLOCK / 2);
    const int32_t *disparity_q8 = image_i32_row(&output->disparity_q8, y + BLOCK / 2);
    for (int x = 1; x + BLOCK < width; x += STEP) {
        const int disparity = match_whole_disparity(disparity_q8[x + BLOCK / 2]);
        if (reason[x + BLOCK / 2] != REASON_VALID || x - 1 - disparity < 0 ||
            x + BLOCK - disparity >= width) {
            continue;
        }
        const int sum = difference_of(input, look->limits, x, y, disparity);
        if (sum >= 0) {
            add_block(histogram, sum / PAIR_BIN);
        }
    }
}

void match_noise_add(struct match_noise *noise, const struct match_input *input,
                     const struct match_look *look, const struct match_output *output, int rows) {
    const int height = output->reason.height;
    for (; noise->rows + BLOCK < (rows < height ? rows : height); noise->rows += STEP) {
        const int y = noise->rows + 1;
        if (y + BLOCK < height) {
            add_differences(input, look, output, y, noise);
        }
    }
}

uint32_t match_noise_q8(const struct match_noise *noise) {
    if (noise->blocks == 0) {
        return QUANTIZATION_Q8;
    }
    // For two images' normal noise of sigma the mean of |second derivative| is 6.77 sigma, and the
    // lowest tenth of the blocks ends 15 % below.
    const uint32_t sum =
        (uint32_t)bin_above(noise->count, noise->blocks / TUNE_PAIR_NOISE_SHARE) * PAIR_BIN +
        PAIR_BIN / 2;
    const uint32_t variance_q8 = (uint32_t)((uint64_t)sum * sum / 530);
    return variance_q8 > QUANTIZATION_Q8 ? variance_q8 : QUANTIZATION_Q8;
}
