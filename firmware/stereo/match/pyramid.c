// SPDX-License-Identifier: Apache-2.0
// The levels of a pair, and what a coarser one chooses for the next: the window of disparities that
// each tile of a band searches, and the slope of the surface that it follows.
// Rows needed: those of the coarser level's surface that show the band, and around_rows or
// slope_rows more above and below.
#include <string.h>

#include "core/invariant.h"
#include "stereo/match/state.h"
#if defined(__bfin__)
#include "stereo/bfin/pairs.h"
#endif

static int padded_lanes(int disparity_count) {
    return (disparity_count + MATCH_LANES - 1) / MATCH_LANES * MATCH_LANES;
}

static int scaled_down(int value, int shift) {
    const int rest = value & ((1 << shift) - 1);
    return (value - rest) / (1 << shift);
}

static void set_level(struct match_level *level, int width, int height, int disparity_min,
                      int disparity_count) {
    level->width = width;
    level->height = height;
    level->tiles = (width + MATCH_TILE_COLUMNS - 1) / MATCH_TILE_COLUMNS;
    level->disparity_min = disparity_min;
    level->disparity_count = disparity_count;
    const int ends = match_range_ends(disparity_count);
    level->accepted = (struct match_accepted_range){ends, disparity_count - 1 - ends};
    level->lanes = padded_lanes(disparity_count);
    const int front = -disparity_min;
    const int behind = disparity_min + level->lanes;
    level->right_pad = front > 0 ? front : 0;
    level->right_length = width + level->right_pad + (behind > 0 ? behind : 0);
}

int match_mean_lanes(const struct match_level *level) {
    const struct match_method *method = level->state->method;
    const bool all =
        match_searches_everything(level) || method->whole_range || level->lanes < method->lanes;
    return all ? level->lanes : method->lanes;
}

// Number of lanes a column for which a level has memory. Windows at small objects far in front need
// many, the more disparities there are.
static int lanes_in_memory(const struct match_level *level) {
    const int mean = match_mean_lanes(level);
    const int wide = padded_lanes(TUNE_WINDOW_MEMORY * level->lanes / 8);
    const int most = TUNE_WINDOW_MEAN * level->state->method->lanes;
    const int part = match_searches_everything(level) || wide < most ? wide : most;
    return part > mean ? part : mean;
}

// Number of halvings of a level's columns and disparities to those of the next one. Below the
// finest level each follows the slopes of the next, so that steeper surfaces are found from level
// to level.
static int halvings_below(const struct match_level *level) {
    return match_is_finest(level) ? level->state->method->halvings : 1;
}

// Whether a level gets a coarser one: it has many disparities, and enough columns remain.
static bool is_halved(const struct match_level *level) {
    const struct match_method *method = level->state->method;
    return method->coarse_disparities > 0 && level->disparity_count > method->coarse_disparities &&
           level->width >> halvings_below(level) >= MATCH_MIN_WIDTH_PX;
}

void match_set_levels(struct match_state *state, int width, int height) {
    const struct match_method *method = state->method;
    state->level[0] = (struct match_level){.state = state, .shift_y = method->halved_rows};
    set_level(&state->level[0], width, height >> method->halved_rows,
              match_searched_min(&state->options), match_searched_count(&state->options));
    state->level[0].accepted = match_accepted_range_of(&state->options);
    state->levels = 1;
    while (state->levels < MATCH_MAX_LEVELS && is_halved(&state->level[state->levels - 1])) {
        struct match_level *finer = &state->level[state->levels - 1];
        struct match_level *level = &state->level[state->levels];
        const int halvings = halvings_below(finer);
        const int shift = finer->shift_x + halvings;
        // Rows are halved once, so that a floor gains fewer disparities a row than on the finer
        // level. A low image keeps its rows: the memory requirement does not depend on the height.
        const int more = height >> (finer->shift_y + 1) >= MATCH_MIN_HEIGHT_PX ? 1 : 0;
        const int shift_y = finer->shift_y + more;
        *level = (struct match_level){.state = state, .shift_x = shift, .shift_y = shift_y};
        const int lowest = scaled_down(finer->disparity_min, halvings);
        const int highest =
            scaled_down(finer->disparity_min + finer->disparity_count - 1, halvings);
        set_level(level, width >> shift, height >> shift_y, lowest, highest - lowest + 1);
        finer->coarser = level;
        state->levels++;
    }
    for (int i = 0; i < state->levels; i++) {
        struct match_level *level = &state->level[i];
        level->row_bytes =
            (size_t)level->tiles * MATCH_TILE_COLUMNS * (size_t)lanes_in_memory(level);
    }
}

// Lowest and highest index that the coarser level found near a tile; low > high: none was found.
// `default_value`: roughly where most of them are.
struct search_bounds {
    int low, high, default_value;
    bool doubtful;  // most have a rival
};

static const struct search_bounds NOT_FOUND = {UINT16_MAX, -1, 0, false};

enum {
    DIFFERENCE_MAX = MATCH_SLOPE_MAX * TUNE_SLOPE_STEP * MATCH_SURFACE_ONE / MATCH_SLOPE_ONE,
    DIFFERENCES_MAX = (MATCH_TILE_COLUMNS / 2 + 2 * TUNE_SLOPE_AROUND) *
                      (MATCH_BAND_ROWS / 2 + 2 * TUNE_SLOPE_AROUND),
    SLOPE_UNKNOWN = INT16_MIN,
    SLOPE_MIXED = INT16_MIN + 1,  // slopes of several surfaces
    TILES_MAX = IMAGE_MAX_SIDE_PX / MATCH_TILE_COLUMNS,
};

// Number of halvings between this level and the coarser one.
static int halvings_x(const struct match_level *level) {
    return level->coarser->shift_x - level->shift_x;
}

static int halvings_y(const struct match_level *level) {
    return level->coarser->shift_y - level->shift_y;
}

// The coarser level's rows of a band and `around` more: those from the first one on, and below the
// second one.
static int first_row(const struct match_level *level, int band_begin, int around) {
    const int row = (band_begin >> halvings_y(level)) - around;
    return row > 0 ? row : 0;
}

static int beyond_row(const struct match_level *level, int band_begin, int around) {
    const int row = ((band_begin + MATCH_BAND_ROWS) >> halvings_y(level)) + around;
    return row < level->coarser->height ? row : level->coarser->height;
}

// Rows of the coarser level that cover as many of the finest one's as TUNE_SLOPE_AROUND columns do.
static int slope_rows(const struct match_level *level) {
    return TUNE_SLOPE_AROUND << (halvings_x(level) - halvings_y(level));
}

int match_window_rows(const struct match_level *level, int band_begin) {
    const int around = level->state->method->around_rows;
    const int slopes = slope_rows(level);
    return beyond_row(level, band_begin, around > slopes ? around : slopes);
}

// The index of a position of the coarser surface, whose pixels are larger.
static int finer_index(const struct match_level *level, int position) {
    const int disparity = level->coarser->disparity_min + position / MATCH_SURFACE_ONE;
    const int index = disparity * (1 << halvings_x(level)) - level->disparity_min;
    return index > 0 ? index : 0;
}

// Findings of the coarser level near the band, by its columns.
struct columns_found {
    uint16_t *lowest;
    int16_t *highest;
    int16_t *doubts;  // number of places with a rival minus number without
};

// -1 (not found) is the highest unsigned number, so that it never lowers a minimum.
static void search_columns(const struct match_level *level, int band_begin,
                           const struct columns_found *found) {
    const struct match_level *coarser = level->coarser;
    const int width = coarser->width;
    uint16_t *restrict lowest = found->lowest;
    int16_t *restrict highest = found->highest;
    int16_t *restrict doubts = found->doubts;
    for (int x = 0; x < width; x++) {
        lowest[x] = UINT16_MAX;
        highest[x] = -1;
        doubts[x] = 0;
    }
    const int around = level->state->method->around_rows;
    const int begin = first_row(level, band_begin, around);
    const int end = beyond_row(level, band_begin, around);
    INVARIANT(coarser->rows_done >= end && coarser->rows_done - begin <= coarser->surface_rows);
    for (int y = begin; y < end; y++) {
        const int16_t *restrict surface = coarser->surface[y % coarser->surface_rows];
        for (int x = 0; x < width; x++) {
            const int16_t doubtful = surface[x] >= MATCH_DOUBTFUL ? MATCH_DOUBTFUL : 0;
            const int16_t position = (int16_t)(surface[x] - doubtful);
            lowest[x] = (uint16_t)position < lowest[x] ? (uint16_t)position : lowest[x];
            highest[x] = position > highest[x] ? position : highest[x];
            const int16_t sure = position >= 0 ? -1 : 0;
            doubts[x] = (int16_t)(doubts[x] + (doubtful != 0 ? 1 : sure));
        }
    }
    for (int x = 0; x < width; x++) {
        if (highest[x] >= 0) {
            lowest[x] = (uint16_t)finer_index(level, lowest[x]);
            highest[x] = (int16_t)finer_index(level, highest[x]);
        }
    }
}

static struct search_bounds bounds_of_tile(const struct match_level *level, int t,
                                           const struct columns_found *found) {
    const uint16_t *lowest = found->lowest;
    const int16_t *highest = found->highest;
    const int width = level->coarser->width;
    const int around = level->state->method->around_columns;
    int begin = (t * MATCH_TILE_COLUMNS >> halvings_x(level)) - around;
    int end = ((t + 1) * MATCH_TILE_COLUMNS >> halvings_x(level)) + around;
    begin = begin > 0 ? begin : 0;
    end = end < width ? end : width;
    struct search_bounds bounds = NOT_FOUND;
    int sum = 0;
    int count = 0;
    int doubts = 0;
    for (int x = begin; x < end; x++) {
        bounds.low = lowest[x] < bounds.low ? lowest[x] : bounds.low;
        bounds.high = highest[x] > bounds.high ? highest[x] : bounds.high;
        doubts += found->doubts[x];
        if (highest[x] >= 0) {
            sum += lowest[x] + highest[x];
            count += 2;
        }
    }
    bounds.default_value = count > 0 ? sum / count : 0;
    bounds.doubtful = doubts > 0;
    return bounds;
}

static int clamp(int value, int low, int high) {
    return value < low ? low : (value > high ? high : value);
}

bool match_searches_whole_range(const struct match_level *level) {
    return level->state->method->whole_range && match_is_finest(level);
}

// The window around a bounds. Where rounding allows it, it keeps the position of the tile above,
// so that cells need not be moved between windows.
static void set_window(const struct match_level *level, struct search_bounds bounds, int max_lanes,
                       int base_above, struct match_tile *tile) {
    const int count = level->disparity_count;
    const int margin = level->state->method->margin;
    const bool whole_range = match_searches_whole_range(level);
    int low = clamp(bounds.low - margin, 0, count - 1);
    int high = clamp(bounds.high + margin, low, count - 1);
    if (whole_range) {
        const int first = level->state->options.extra_below;
        const int last = count - 1 - level->state->options.extra_above;
        low = low < first ? low : first;
        high = high > last ? high : last;
    }
    int lanes = (high - low + MATCH_LANES) / MATCH_LANES * MATCH_LANES;
    int lowest_base = high + 1 - lanes;
    int highest_base = low;
    if (lanes > max_lanes) {
        // Not enough memory: keep the end with the majority.
        lanes = max_lanes;
        lowest_base = highest_base =
            bounds.default_value - low < high - bounds.default_value ? low : high + 1 - lanes;
    }
    lowest_base = clamp(lowest_base, 0, level->lanes - lanes);
    highest_base = clamp(highest_base, lowest_base, level->lanes - lanes);
    tile->base = (int16_t)clamp(base_above, lowest_base, highest_base);
    tile->lanes = (int16_t)lanes;
    tile->doubtful = bounds.doubtful && !whole_range;
    INVARIANT(lanes > 0 && tile->base >= 0 && tile->base + lanes <= level->lanes);
}

// Tiles without findings of the coarser level lie between their neighbours' surfaces.
static void close_gaps(const struct match_level *level, struct search_bounds *bounds) {
    const struct search_bounds all = {0, level->disparity_count - 1, level->disparity_count / 2,
                                      false};
    struct search_bounds before = NOT_FOUND;
    for (int t = 0; t < level->tiles; t++) {
        if (bounds[t].low <= bounds[t].high) {
            before = bounds[t];
            continue;
        }
        int after = t;
        while (after < level->tiles && bounds[after].low > bounds[after].high) {
            after++;
        }
        struct search_bounds joined = before;
        if (after < level->tiles) {
            const struct search_bounds *other = &bounds[after];
            joined.low = other->low < joined.low ? other->low : joined.low;
            joined.high = other->high > joined.high ? other->high : joined.high;
        }
        joined = joined.low <= joined.high ? joined : all;
        for (; t < after; t++) {
            bounds[t] = joined;
        }
        t--;
    }
}

// Pixels [x_begin, x_end) of every row_step-th one of the rows [y_begin, y_end) of a level.
struct area {
    int x_begin, x_end, y_begin, y_end, row_step;
};

static struct area area_of_tile(const struct match_level *level, int band_begin, int t) {
    const int width = level->coarser->width;
    const int begin = (t * MATCH_TILE_COLUMNS >> halvings_x(level)) - TUNE_SLOPE_AROUND;
    const int end = ((t + 1) * MATCH_TILE_COLUMNS >> halvings_x(level)) + TUNE_SLOPE_AROUND;
    return (struct area){begin > 0 ? begin : 0, end < width ? end : width,
                         first_row(level, band_begin, slope_rows(level)),
                         beyond_row(level, band_begin, slope_rows(level)),
                         slope_rows(level) / TUNE_SLOPE_AROUND};
}

// Differences of a level's surface over some columns or rows, in 1/MATCH_SURFACE_ONE and limited to
// DIFFERENCE_MAX. Those that are not known are INT16_MAX.
struct differences {
    int known, all;
    int16_t value[DIFFERENCES_MAX + 1];
};

static inline int16_t limited(int16_t difference) {
    const int16_t low = difference > -DIFFERENCE_MAX ? difference : (int16_t)-DIFFERENCE_MAX;
    return low < DIFFERENCE_MAX ? low : (int16_t)DIFFERENCE_MAX;
}

static void take_differences(const struct match_level *level, const struct area *area, int dx,
                             int dy, struct differences *taken) {
    INVARIANT(level->rows_done >= area->y_end &&
              level->rows_done - area->y_begin <= level->surface_rows);
    const int columns = area->x_end - area->x_begin - dx;
    taken->known = taken->all = 0;
    // Slots of the surface's ring, in which a row is less than a turn ahead of the one before.
    const int turn = level->surface_rows;
    INVARIANT(area->row_step <= turn);
    int slot = area->y_begin % turn, slot_to = (area->y_begin + dy) % turn;
    for (int y = area->y_begin; y < area->y_end - dy && columns > 0; y += area->row_step) {
        INVARIANT(taken->all + columns <= DIFFERENCES_MAX);
        const int16_t *restrict from = level->surface[slot] + area->x_begin;
        const int16_t *restrict to = level->surface[slot_to] + area->x_begin + dx;
        slot += area->row_step < turn - slot ? area->row_step : area->row_step - turn;
        slot_to += area->row_step < turn - slot_to ? area->row_step : area->row_step - turn;
        int16_t *restrict value = taken->value + taken->all;
        int16_t known = 0;
        for (int x = 0; x < columns; x++) {
            const int16_t before = from[x];
            const int16_t after = to[x];
            const int16_t difference = limited(
                (int16_t)((after & (MATCH_DOUBTFUL - 1)) - (before & (MATCH_DOUBTFUL - 1))));
            const int16_t is_known = (before >= 0) & (after >= 0);
            value[x] = is_known != 0 ? difference : INT16_MAX;
            known = (int16_t)(known + is_known);
        }
        taken->known += known;
        taken->all += columns;
    }
}

// The number of differences below a candidate.
static int count_below(struct differences *taken, int16_t candidate) {
    int16_t *value = taken->value;
    const int count = taken->all;
    INVARIANT(count <= DIFFERENCES_MAX && candidate >= -DIFFERENCE_MAX);
#if defined(__bfin__)
    value[count] = INT16_MAX;
    pair16 below = pair_of(0);
    for (int i = 0; i < count; i += 2) {
        // What is not known is too large to subtract from.
        below -=
            pair_sign(pair_min(pair_load(value, i), pair_of(DIFFERENCE_MAX)) - pair_of(candidate));
    }
    return below[0] + below[1];
#else
    int16_t below = 0;
    for (int i = 0; i < count; i++) {
        below = (int16_t)(below + (value[i] < candidate));
    }
    return below;
#endif
}

// The lowest value that more than half of the known differences do not exceed, by bisection.
static int median_of(struct differences *taken) {
    int16_t median = -DIFFERENCE_MAX;
    for (int16_t step = DIFFERENCE_MAX; step > 0; step /= 2) {
        const int16_t candidate = (int16_t)(median + step);
        const int below = count_below(taken, candidate);
        median = below <= taken->known / 2 ? candidate : median;
    }
    return median;
}

// The number of differences near `middle`, and their sum.
static int near_differences(const struct differences *taken, int middle, int *sum) {
    const int16_t low = (int16_t)(middle - TUNE_SLOPE_TOLERANCE);
    const int16_t high = (int16_t)(middle + TUNE_SLOPE_TOLERANCE);
    int near = 0;
    *sum = 0;
    for (int i = 0; i < taken->all; i++) {
        const int is_near = (taken->value[i] >= low) & (taken->value[i] <= high);
        near += is_near;
        *sum += taken->value[i] & -is_near;
    }
    return near;
}

// Whether a slope is also that of most differences over so many columns or rows.
static bool holds_over(const struct match_level *level, const struct area *area, int dx, int dy,
                       int slope) {
    struct differences taken;
    take_differences(level, area, dx, dy, &taken);
    int sum;
    const int middle = slope * (dx + dy) / (MATCH_SLOPE_ONE / MATCH_SURFACE_ONE);
    return near_differences(&taken, middle, &sum) * 100 >= taken.known * TUNE_SLOPE_SHARE_HALF;
}

// The slope of a level's surface over `dx` columns or `dy` rows: the mean of the differences near
// their median, if these are most. `any_steep`: a steep one, however few.
static int slope_of(const struct match_level *level, const struct area *area, int dx, int dy,
                    int share_min, bool any_steep) {
    struct differences taken;
    take_differences(level, area, dx, dy, &taken);
    const int known = taken.known;
    const int all =
        (area->x_end - area->x_begin - dx) * (area->y_end - area->y_begin - dy) / area->row_step;
    if (known < TUNE_SLOPE_PIXELS || known < all * TUNE_SLOPE_KNOWN / 100) {
        return SLOPE_UNKNOWN;
    }
    int sum;
    const int near = near_differences(&taken, median_of(&taken), &sum);
    INVARIANT(near > 0);
    const int slope = sum * (MATCH_SLOPE_ONE / MATCH_SURFACE_ONE) / (near * (dx + dy));
    if (near * 100 >= known * share_min) {
        return slope;
    }
    const bool steep = slope >= TUNE_SLOPE_STEEP || slope <= -TUNE_SLOPE_STEEP;
    return steep && (any_steep || holds_over(level, area, dx / 2, dy / 2, slope)) ? slope
                                                                                  : SLOPE_MIXED;
}

// The slope of the nearest tile in a direction, if it is not too far.
static int slope_beside(const int16_t *slopes, int tiles, int t, int direction) {
    int i = 1;
    while (i < TUNE_SLOPE_REACH && t + i * direction >= 0 && t + i * direction < tiles &&
           slopes[t + i * direction] == SLOPE_UNKNOWN) {
        i++;
    }
    const int other = t + i * direction;
    return other >= 0 && other < tiles && slopes[other] != SLOPE_MIXED ? slopes[other]
                                                                       : SLOPE_UNKNOWN;
}

// The slope of a tile without one.
static int slope_between(const int16_t *slopes, int tiles, int t) {
    const int left = slope_beside(slopes, tiles, t, -1);
    const int right = slope_beside(slopes, tiles, t, 1);
    if (left == SLOPE_UNKNOWN || right == SLOPE_UNKNOWN) {
        return left == SLOPE_UNKNOWN ? right : left;
    }
    const int gap = left - right;
    return gap < TUNE_SLOPE_GAP && gap > -TUNE_SLOPE_GAP ? (left + right) / 2 : SLOPE_UNKNOWN;
}

// The slope that a tile follows, in disparities of a level that has `scale` times as many a pixel.
static int16_t slope_followed(const int16_t *slopes, int tiles, int t, int scale) {
    int slope = slopes[t] == SLOPE_UNKNOWN ? slope_between(slopes, tiles, t) : slopes[t];
    slope = slope <= SLOPE_MIXED ? 0 : clamp(scale * slope, -MATCH_SLOPE_MAX, MATCH_SLOPE_MAX);
    return (int16_t)(slope < TUNE_SLOPE_MIN && slope > -TUNE_SLOPE_MIN ? 0 : slope);
}

void match_plan_slopes(const struct match_level *level, int band_begin, struct match_tile *tiles) {
    if (level->coarser == NULL) {
        for (int t = 0; t < level->tiles; t++) {
            tiles[t].slope_down = tiles[t].slope_along = 0;
        }
        return;
    }
    int16_t down[TILES_MAX];
    int16_t along[TILES_MAX];
    const int rows = slope_rows(level) * TUNE_SLOPE_STEP / TUNE_SLOPE_AROUND;
    // Between coarser levels a wrong slope does no harm: no surface is found along it.
    const bool any_steep = !match_is_finest(level);
    for (int t = 0; t < level->tiles; t++) {
        const struct area area = area_of_tile(level, band_begin, t);
        down[t] =
            (int16_t)slope_of(level->coarser, &area, 0, rows, TUNE_SLOPE_SHARE_DOWN, any_steep);
        along[t] = (int16_t)slope_of(level->coarser, &area, TUNE_SLOPE_STEP, 0,
                                     TUNE_SLOPE_SHARE_ALONG, any_steep);
    }
    // Disparities are halved with the columns, rows less often.
    const int scale = 1 << (halvings_x(level) - halvings_y(level));
    for (int t = 0; t < level->tiles; t++) {
        tiles[t].slope_down = slope_followed(down, level->tiles, t, scale);
        tiles[t].slope_along = slope_followed(along, level->tiles, t, 1);
    }
}

void match_plan_windows(const struct match_level *level, int band_begin,
                        const struct match_scratch *scratch, const struct match_tile *above,
                        struct match_tile *tiles) {
    struct search_bounds bounds[TILES_MAX];
    INVARIANT(level->tiles <= TILES_MAX);
    if (match_searches_everything(level)) {
        for (int t = 0; t < level->tiles; t++) {
            bounds[t] = (struct search_bounds){0, level->disparity_count - 1, 0, false};
        }
    } else {
        // Nothing is in progress: the working memory of one thread is free.
        const struct columns_found found = {scratch->box, (int16_t *)scratch->line[0].cost.backward,
                                            (int16_t *)scratch->line[1].cost.forward};
        search_columns(level, band_begin, &found);
        for (int t = 0; t < level->tiles; t++) {
            bounds[t] = bounds_of_tile(level, t, &found);
        }
        close_gaps(level, bounds);
    }
    // Narrows the windows until the row fits its memory.
    const size_t capacity = level->row_bytes / MATCH_TILE_COLUMNS;
    int max_lanes = level->lanes;
    int lanes;
    do {
        lanes = 0;
        for (int t = 0; t < level->tiles; t++) {
            set_window(level, bounds[t], max_lanes, above[t].base, &tiles[t]);
            tiles[t].offset = lanes * MATCH_TILE_COLUMNS;
            lanes += tiles[t].lanes;
        }
        max_lanes -= MATCH_LANES;
    } while ((size_t)lanes > capacity);
}
