// SPDX-License-Identifier: Apache-2.0
#include "stereo/fill.h"

#include <math.h>
#include <stdbool.h>

#include "core/error.h"
#include "core/invariant.h"
#include "stereo/image/reason.h"

enum {
    MARGIN_PX = 4,      // a tile's plane is fitted to this much more around it
    PLANE_PIXELS = 24,  // minimum number of pixels that determine a plane
    STEP_MAX_Q8 = 768,  // larger steps between neighbours are edges
    INLIER_Q8 = 256,    // distance of a plane's pixels
    SEEDS_A_SIDE = 3,   // pixels in a row and column of a tile that are tried as the plane's
    DIRECTIONS = 8,     // opposite ones are four apart
    SUPPORTS_MIN = 2,   // minimum number of supports of a filled pixel
    SAME_Q8 = 256,      // largest difference of the continuations of one surface
    SAME_A_PX_Q8 = 4,   // additional difference for each pixel of distance
    CONTRAST = 16,      // grey levels: of an edge
    FIT_ROUNDS = 2,
    ENCLOSED = 3,  // pairs of opposite supports, of four, around a pixel within a surface
    HOLD_PX = 4,   // how far a slope is continued with supports on one side only
    SLOPE_ONE_Q16 = 65536,
    TO_FILL = 1,  // mark in sigma
};

// The disparity at the centre of a tile, and its growth per pixel.
struct plane {
    int32_t centre_q8;  // unusable if there are too few pixels
    int32_t slope_q16[2];
    int32_t pixels;
};

struct fill {
    const struct fill_input *input;
    struct match_output *output;
    struct plane *planes;
    int columns, rows;  // tiles across and down
};

// A valid match seen from a rejected pixel.
struct support {
    int32_t value_q8;  // disparity of its surface, continued to the rejected pixel
    int32_t near_q8;   // the same, but level from HOLD_PX on
    int32_t found_q8;  // disparity of the match
    int distance;
    int contrast;  // largest difference of colour on the way
    bool found;
};

static const int directions[DIRECTIONS][2] = {{1, 0},  {1, 1},   {0, 1},  {-1, 1},
                                              {-1, 0}, {-1, -1}, {0, -1}, {1, -1}};

static int smaller(int a, int b) {
    return a < b ? a : b;
}

static int larger(int a, int b) {
    return a > b ? a : b;
}

static int64_t magnitude(int64_t value) {
    return value < 0 ? -value : value;
}

size_t fill_need_bytes(int width, int height) {
    const size_t columns = (size_t)(width + FILL_TILE_PX - 1) / FILL_TILE_PX;
    const size_t rows = (size_t)(height + FILL_TILE_PX - 1) / FILL_TILE_PX;
    return arena_need_bytes(columns * rows, sizeof(struct plane));
}

// ---- planes of the tiles

// The pixels that a tile's plane is fitted to.
struct window {
    const struct match_output *output;
    int left, top, right, bottom;
    int x, y;  // the tile's centre
};

static bool is_valid(const struct match_output *output, int x, int y) {
    return image_u8_row(&output->reason, y)[x] == REASON_VALID;
}

static int32_t disparity_at(const struct match_output *output, int x, int y) {
    return image_i32_row(&output->disparity_q8, y)[x];
}

static int64_t plane_at(const struct plane *plane, int dx, int dy) {
    const int64_t rise_q16 = (int64_t)plane->slope_q16[0] * dx + (int64_t)plane->slope_q16[1] * dy;
    return plane->centre_q8 + (rise_q16 + (rise_q16 < 0 ? -128 : 128)) / 256;
}

static int64_t residual_at(const struct window *window, const struct plane *plane, int x, int y) {
    return disparity_at(window->output, x, y) - plane_at(plane, x - window->x, y - window->y);
}

// Mean growth between neighbours, without edges.
static int32_t mean_slope_q16(const struct window *window, int dx, int dy) {
    int64_t sum_q8 = 0, count = 0;
    for (int y = window->top; y < window->bottom - dy; y++) {
        for (int x = window->left; x < window->right - dx; x++) {
            if (is_valid(window->output, x, y) && is_valid(window->output, x + dx, y + dy)) {
                const int64_t step_q8 = (int64_t)disparity_at(window->output, x + dx, y + dy) -
                                        disparity_at(window->output, x, y);
                sum_q8 += magnitude(step_q8) <= STEP_MAX_Q8 ? step_q8 : 0;
                count += magnitude(step_q8) <= STEP_MAX_Q8;
            }
        }
    }
    return count > 0 ? (int32_t)(256 * sum_q8 / count) : 0;
}

static int count_inliers(const struct window *window, const struct plane *plane) {
    int count = 0;
    for (int y = window->top; y < window->bottom; y++) {
        for (int x = window->left; x < window->right; x++) {
            count += is_valid(window->output, x, y) &&
                     magnitude(residual_at(window, plane, x, y)) <= INLIER_Q8;
        }
    }
    return count;
}

// Of planes through some of the pixels the one with the most others: where the window shows two
// surfaces, the larger.
static struct plane best_seed(const struct window *window) {
    const int32_t slope_x_q16 = mean_slope_q16(window, 1, 0);
    const int32_t slope_y_q16 = mean_slope_q16(window, 0, 1);
    struct plane best = {.pixels = 0};
    INVARIANT(window->left < window->right && window->top < window->bottom);
    for (int i = 0; i < SEEDS_A_SIDE * SEEDS_A_SIDE; i++) {
        const int columns = window->right - window->left, rows = window->bottom - window->top;
        const int x = window->left + columns * (2 * (i % SEEDS_A_SIDE) + 1) / (2 * SEEDS_A_SIDE);
        const int y = window->top + rows * (2 * (i / SEEDS_A_SIDE) + 1) / (2 * SEEDS_A_SIDE);
        if (!is_valid(window->output, x, y)) {
            continue;
        }
        struct plane plane = {.slope_q16 = {slope_x_q16, slope_y_q16}};
        plane.centre_q8 = (int32_t)residual_at(window, &plane, x, y);
        plane.pixels = count_inliers(window, &plane);
        best = plane.pixels > best.pixels ? plane : best;
    }
    return best;
}

// Least squares over the inliers.
static struct plane fitted(const struct window *window, const struct plane *seed) {
    int64_t n = 0, sx = 0, sy = 0, sr = 0, sxx = 0, sxy = 0, syy = 0, sxr = 0, syr = 0;
    for (int y = window->top; y < window->bottom; y++) {
        for (int x = window->left; x < window->right; x++) {
            if (!is_valid(window->output, x, y)) {
                continue;
            }
            const int64_t r = residual_at(window, seed, x, y);
            const int64_t dx = x - window->x, dy = y - window->y;
            if (magnitude(r) <= INLIER_Q8) {
                n++, sx += dx, sy += dy, sr += r;
                sxx += dx * dx, sxy += dx * dy, syy += dy * dy, sxr += dx * r, syr += dy * r;
            }
        }
    }
    INVARIANT(n <= (FILL_TILE_PX + 2 * MARGIN_PX) * (FILL_TILE_PX + 2 * MARGIN_PX));
    // Moments about the mean, times n, in integers; a line of pixels has no plane.
    const int64_t xx = n * sxx - sx * sx, xy = n * sxy - sx * sy, yy = n * syy - sy * sy;
    const int64_t xr = n * sxr - sx * sr, yr = n * syr - sy * sr;
    const double determinant = (double)xx * (double)yy - (double)xy * (double)xy;
    struct plane plane = {.pixels = 0};
    if (n < PLANE_PIXELS || determinant < (double)n * (double)n * (double)n * (double)n) {
        return plane;
    }
    const double slope_x = ((double)xr * (double)yy - (double)yr * (double)xy) / determinant;
    const double slope_y = ((double)yr * (double)xx - (double)xr * (double)xy) / determinant;
    const double centre = ((double)sr - slope_x * (double)sx - slope_y * (double)sy) / (double)n;
    INVARIANT(fabs(centre) < 1e6);
    plane.centre_q8 = seed->centre_q8 + (int32_t)(centre < 0 ? centre - 0.5 : centre + 0.5);
    plane.slope_q16[0] = seed->slope_q16[0] + (int32_t)(slope_x * 256);
    plane.slope_q16[1] = seed->slope_q16[1] + (int32_t)(slope_y * 256);
    plane.pixels = (int32_t)n;
    return plane;
}

static struct plane plane_of_tile(const struct match_output *output, int column, int row) {
    const int x = column * FILL_TILE_PX, y = row * FILL_TILE_PX;
    const struct window window = {
        .output = output,
        .left = larger(x - MARGIN_PX, 0),
        .top = larger(y - MARGIN_PX, 0),
        .right = smaller(x + FILL_TILE_PX + MARGIN_PX, output->reason.width),
        .bottom = smaller(y + FILL_TILE_PX + MARGIN_PX, output->reason.height),
        .x = x + FILL_TILE_PX / 2,
        .y = y + FILL_TILE_PX / 2,
    };
    struct plane plane = best_seed(&window);
    for (int round = 0; round < FIT_ROUNDS && plane.pixels >= PLANE_PIXELS; round++) {
        plane = fitted(&window, &plane);
    }
    const int32_t steepest_q16 = STEP_MAX_Q8 / 256 * SLOPE_ONE_Q16;
    if (magnitude(plane.slope_q16[0]) > steepest_q16 ||
        magnitude(plane.slope_q16[1]) > steepest_q16) {
        plane.pixels = 0;
    }
    return plane;
}

static void fit_tiles(void *context, int row) {
    const struct fill *fill = context;
    for (int column = 0; column < fill->columns; column++) {
        fill->planes[row * fill->columns + column] = plane_of_tile(fill->output, column, row);
    }
}

// ---- pixels

// The plane of the tiles around that fits a valid pixel best; NULL: none does, and the pixel is no
// support.
static const struct plane *plane_through(const struct fill *fill, int x, int y) {
    const int column = x / FILL_TILE_PX, row = y / FILL_TILE_PX;
    INVARIANT(column >= 0 && column < fill->columns && row >= 0 && row < fill->rows);
    const struct plane *best = NULL;
    int64_t smallest_q8 = INLIER_Q8;
    for (int j = larger(row - 1, 0); j <= smaller(row + 1, fill->rows - 1); j++) {
        for (int i = larger(column - 1, 0); i <= smaller(column + 1, fill->columns - 1); i++) {
            const struct plane *plane = &fill->planes[j * fill->columns + i];
            if (plane->pixels < PLANE_PIXELS) {
                continue;
            }
            const int dx = x - i * FILL_TILE_PX - FILL_TILE_PX / 2;
            const int dy = y - j * FILL_TILE_PX - FILL_TILE_PX / 2;
            const int64_t off_q8 =
                magnitude(disparity_at(fill->output, x, y) - plane_at(plane, dx, dy));
            if (off_q8 < smallest_q8) {
                smallest_q8 = off_q8;
                best = plane;
            }
        }
    }
    return best;
}

static int contrast_of(const uint8_t *a, const uint8_t *b) {
    int greatest = 0;
    for (int i = 0; i < 3; i++) {
        greatest = larger(greatest, a[i] > b[i] ? a[i] - b[i] : b[i] - a[i]);
    }
    return greatest;
}

static struct support find_support(const struct fill *fill, int x, int y, const int step[2]) {
    const struct match_output *output = fill->output;
    const struct image_rgb8 *colour = fill->input->colour;
    const uint8_t *own = image_rgb8_row(colour, y) + (ptrdiff_t)3 * x;
    struct support support = {.found = false};
    for (int t = 1; t <= FILL_REACH_PX; t++) {
        const int u = x + t * step[0], v = y + t * step[1];
        if (u < 0 || u >= output->reason.width || v < 0 || v >= output->reason.height) {
            break;
        }
        support.contrast = larger(support.contrast,
                                  contrast_of(own, image_rgb8_row(colour, v) + (ptrdiff_t)3 * u));
        const struct plane *plane = is_valid(output, u, v) ? plane_through(fill, u, v) : NULL;
        if (plane != NULL) {
            const struct plane here = {.centre_q8 = disparity_at(output, u, v),
                                       .slope_q16 = {plane->slope_q16[0], plane->slope_q16[1]}};
            support.found_q8 = here.centre_q8;
            const int held = smaller(t, HOLD_PX);
            support.value_q8 = (int32_t)plane_at(&here, x - u, y - v);
            support.near_q8 = (int32_t)plane_at(&here, -held * step[0], -held * step[1]);
            support.distance = t;
            support.found = true;
            break;
        }
    }
    return support;
}

static bool is_same_surface(const struct support *a, const struct support *b) {
    return magnitude((int64_t)a->value_q8 - b->value_q8) <=
           SAME_Q8 + SAME_A_PX_Q8 * larger(a->distance, b->distance);
}

// The supports of one surface, as bits: what can be reached from the farthest of `left` in steps
// from support to support.
static unsigned farthest_surface(const struct support *supports, unsigned left) {
    INVARIANT(left != 0);
    int first = -1;
    for (int i = 0; i < DIRECTIONS; i++) {
        if ((left >> i & 1) != 0 &&
            (first < 0 || supports[i].value_q8 < supports[first].value_q8)) {
            first = i;
        }
    }
    unsigned surface = 1u << first;
    for (unsigned before = 0; before != surface;) {
        before = surface;
        for (int i = 0; i < DIRECTIONS * DIRECTIONS; i++) {
            const int from = i / DIRECTIONS, to = i % DIRECTIONS;
            if ((surface >> from & 1) != 0 && (left >> to & 1) != 0 &&
                is_same_surface(&supports[from], &supports[to])) {
                surface |= 1u << to;
            }
        }
    }
    return surface;
}

// Pairs of opposite directions, of four.
static int count_opposite(unsigned surface) {
    int count = 0;
    for (int i = 0; i < DIRECTIONS / 2; i++) {
        count += (surface >> i & 1) != 0 && (surface >> (i + DIRECTIONS / 2) & 1) != 0;
    }
    return count;
}

static int smallest_contrast(const struct support *supports, unsigned surface) {
    int smallest = 255;
    for (int i = 0; i < DIRECTIONS; i++) {
        if ((surface >> i & 1) != 0) {
            smallest = smaller(smallest, supports[i].contrast);
        }
    }
    return smallest;
}

// The farthest surface, unless a nearer one encloses the pixel or alone has its colour.
static unsigned choose_surface(const struct support *supports, unsigned found) {
    unsigned chosen = farthest_surface(supports, found);
    INVARIANT((chosen & ~found) == 0);
    for (unsigned left = found & ~chosen; left != 0;) {
        const unsigned nearer = farthest_surface(supports, left);
        left &= ~nearer;
        const bool encloses = count_opposite(nearer) >= ENCLOSED && count_opposite(chosen) == 0;
        const bool alone_has_colour =
            smallest_contrast(supports, nearer) + CONTRAST <= smallest_contrast(supports, chosen);
        if (encloses || alone_has_colour) {
            chosen = nearer;
        }
    }
    return chosen;
}

static double weight_of(const struct support *support, int direction) {
    INVARIANT(support->found && support->distance > 0);
    // A diagonal step is longer.
    const double distance = support->distance * (direction % 2 == 0 ? 1 : 1.414);
    const double fall = 1 + support->contrast / (double)CONTRAST;
    return 1 / (distance * fall * fall);
}

// Between opposite supports along the line through both, beyond supports along their slopes, whose
// errors grow with the distance. Near supports count more, and those behind an edge less.
static int32_t mean_value_q8(const struct support *supports, unsigned surface) {
    const bool is_between = count_opposite(surface) > 0;
    double sum = 0, weights = 0;
    for (int i = 0; i < DIRECTIONS; i++) {
        const int j = (i + DIRECTIONS / 2) % DIRECTIONS;
        if ((surface >> i & 1) == 0 || (is_between && (surface >> j & 1) == 0)) {
            continue;
        }
        const struct support *one = &supports[i], *other = &supports[j];
        double weight = weight_of(one, i), value = one->near_q8;
        if (is_between) {
            // Each pair is met twice, with the same value.
            weight = 1 / (1 / weight + 1 / weight_of(other, j));
            value = ((double)one->found_q8 * other->distance +
                     (double)other->found_q8 * one->distance) /
                    (one->distance + other->distance);
        }
        sum += weight * value;
        weights += weight;
    }
    INVARIANT(weights > 0);
    const double mean = sum / weights;
    return (int32_t)(mean < 0 ? mean - 0.5 : mean + 0.5);
}

static bool fill_pixel(const struct fill *fill, int x, int y) {
    struct support supports[DIRECTIONS];
    unsigned found = 0;
    int count = 0;
    for (int i = 0; i < DIRECTIONS; i++) {
        supports[i] = find_support(fill, x, y, directions[i]);
        found |= (unsigned)supports[i].found << i;
        count += supports[i].found;
    }
    if (count < SUPPORTS_MIN) {
        return false;
    }
    image_i32_row(&fill->output->disparity_q8, y)[x] =
        mean_value_q8(supports, choose_surface(supports, found));
    return true;
}

// Other rows read this one's reasons, so a mark beside them decides.
static void fill_row(void *context, int y) {
    const struct fill *fill = context;
    const struct rectify_span *span = fill->input->left_span;
    const int begin = span != NULL ? span[y].begin : 0;
    const int end = span != NULL ? span[y].end : fill->output->reason.width;
    uint8_t *mark = image_u8_row(fill->input->sigma, y);
    INVARIANT(begin >= 0 && end <= fill->output->reason.width);
    for (int x = begin; x < end; x++) {
        const uint8_t reason = image_u8_row(&fill->output->reason, y)[x];
        if (reason != REASON_VALID && reason != REASON_BORDER) {
            mark[x] = fill_pixel(fill, x, y) ? TO_FILL : 0;
        }
    }
}

static void finish_row(void *context, int y) {
    const struct fill *fill = context;
    uint8_t *reason = image_u8_row(&fill->output->reason, y);
    uint8_t *mark = image_u8_row(fill->input->sigma, y);
    for (int x = 0; x < fill->output->reason.width; x++) {
        if (reason[x] != REASON_VALID) {
            reason[x] = mark[x] == TO_FILL ? REASON_FILLED : reason[x];
            mark[x] = 0;
        }
    }
}

int fill_run(const struct fill_input *input, const struct parallel *parallel, struct arena *arena,
             struct match_output *output) {
    const int width = output->reason.width, height = output->reason.height;
    INVARIANT(input->colour->width == width && input->colour->height == height);
    INVARIANT(input->sigma->width == width && input->sigma->height == height);
    const size_t before = arena_mark(arena);
    struct fill fill = {.input = input,
                        .output = output,
                        .columns = (width + FILL_TILE_PX - 1) / FILL_TILE_PX,
                        .rows = (height + FILL_TILE_PX - 1) / FILL_TILE_PX};
    fill.planes = arena_take(arena, (size_t)fill.columns * (size_t)fill.rows, sizeof *fill.planes);
    if (fill.planes == NULL) {
        return ERROR_MEMORY;
    }
    parallel->run(parallel->self, fit_tiles, &fill, fill.rows);
    parallel->run(parallel->self, fill_row, &fill, height);
    parallel->run(parallel->self, finish_row, &fill, height);
    arena_release(arena, before);
    return ERROR_OK;
}
