// SPDX-License-Identifier: Apache-2.0
// What the phases share (included by them): lanes of a pixel, the dynamic-programming step, the
// lowest lane, and moves between windows.
#ifndef VERGENCE_STEREO_MATCH_MATCH_PATH_COST_H
#define VERGENCE_STEREO_MATCH_MATCH_PATH_COST_H

#include "stereo/match/match_state.h"

enum { PATH_COST_VECTORS = MATCH_MAX_DISPARITIES / MATCH_LANES };

/// All lanes of a pixel, or of one pixel for each member.
struct lanes {
    struct vector part[PATH_COST_VECTORS];
};

struct path_penalties {
    struct vector p1;  // of a change by one disparity
    struct vector p2;  // of any other
};

MATCH_INLINE void load_lanes(const uint8_t *const at[], ptrdiff_t cell, struct lanes *to,
                             const int lanes) {
    for (int k = 0; k < lanes / MATCH_LANES; k++) {
        to->part[k] = vector_load(at, cell + (ptrdiff_t)k * MATCH_LANES);
    }
}

MATCH_INLINE void store_lanes(const struct lanes *from, uint8_t *const at[], ptrdiff_t cell,
                              const int lanes) {
    for (int k = 0; k < lanes / MATCH_LANES; k++) {
        vector_store(at, cell + (ptrdiff_t)k * MATCH_LANES, from->part[k]);
    }
}

// The lower neighbour and the upper neighbour of each lane, whichever is lower; those beyond the
// ends are infinite. `before` is the original part before part k, even if `lanes` has been
// overwritten there.
MATCH_INLINE struct vector lower_neighbour(const struct lanes *of, int k, struct vector before,
                                           const int lanes) {
    const struct vector after =
        k + 1 < lanes / MATCH_LANES ? of->part[k + 1] : vector_all(UINT8_MAX);
    return vector_min(vector_up(of->part[k], before), vector_down(of->part[k], after));
}

// Part k of an average, in which each lane may be replaced by a neighbour's value plus `price`: an
// average along a slanted surface. `before` as above.
MATCH_INLINE struct vector leaning(const struct lanes *of, int k, struct vector before,
                                   struct vector price, const int lanes) {
    const struct vector beside = lower_neighbour(of, k, before, lanes);
    return vector_min(of->part[k], vector_add(beside, price));
}

// Moves all lanes up by `rise`, as far as a surface rises from one pixel to the next. Those that
// come from beyond the ends are `low` and `high`. Not inlined: few tiles are slanted.
static __attribute__((noinline)) void move_lanes(struct lanes *of, int rise, struct vector low,
                                                 struct vector high, int lanes) {
    const int count = lanes / MATCH_LANES;
    for (int i = 0; i < rise; i++) {
        struct vector before = low;
        for (int k = 0; k < count; k++) {
            const struct vector here = of->part[k];
            of->part[k] = vector_up(here, before);
            before = here;
        }
    }
    for (int i = 0; i > rise; i--) {
        for (int k = 0; k < count; k++) {
            of->part[k] = vector_down(of->part[k], k + 1 < count ? of->part[k + 1] : high);
        }
    }
}

MATCH_INLINE void shear(struct lanes *of, int rise, struct vector low, struct vector high,
                        const int lanes) {
    if (rise != 0) {
        move_lanes(of, rise, low, high, lanes);
    }
}

// Shears an average as it arrives in the pixel of `at` and `cell`, whose own costs at the ends of
// its window stand for what lies beyond these.
MATCH_INLINE void shear_average(struct lanes *of, int rise, const uint8_t *const at[],
                                ptrdiff_t cell, const int lanes) {
    if (rise != 0) {
        move_lanes(of, rise, vector_each(at, cell), vector_each(at, cell + lanes - 1), lanes);
    }
}

// message[i] = cost[i] + min(p[i], p[i-1] + small, p[i+1] + small, large), where p is the previous
// path cost in `path_cost` and neighbours beyond the ends are infinite; then its lowest lane is
// subtracted. Source: H. Hirschmueller, "Stereo processing by semiglobal matching and mutual
// information", PAMI 30(2), 2008, equation 13.
MATCH_INLINE void add_path_cost(const struct lanes *cost, struct path_penalties penalties,
                                struct lanes *path_cost, const int lanes) {
    const int count = lanes / MATCH_LANES;
    struct vector before = vector_all(UINT8_MAX);
    struct vector smallest = vector_all(UINT8_MAX);
    for (int k = 0; k < count; k++) {
        const struct vector here = path_cost->part[k];
        const struct vector beside = lower_neighbour(path_cost, k, before, lanes);
        const struct vector step =
            vector_min(vector_min(here, vector_add(beside, penalties.p1)), penalties.p2);
        path_cost->part[k] = vector_add(cost->part[k], step);
        smallest = vector_min(smallest, path_cost->part[k]);
        before = here;
    }
    const struct vector lowest = vector_lowest(smallest);
    for (int k = 0; k < count; k++) {
        path_cost->part[k] = vector_sub(path_cost->part[k], lowest);
    }
}

// The first lane of a member that is the lowest of all `total`.
MATCH_INLINE void first_lowest(const struct vector *total, struct vector lowest,
                               int lane[VECTOR_MEMBERS], const int count) {
    for (int r = 0; r < VECTOR_MEMBERS; r++) {
        lane[r] = -1;
    }
    // Two parts of a member fill a word.
    for (int k = 0; k < count; k += 2) {
        const uint32_t here = vector_equal(total[k], lowest);
        const uint32_t next = k + 1 < count ? vector_equal(total[k + 1], lowest) : 0;
        for (int r = 0; r < VECTOR_MEMBERS; r++) {
            const uint32_t bits = (here >> (MATCH_LANES * r) & 0xffff) +
                                  0x10000u * (next >> (MATCH_LANES * r) & 0xffff);
            if (count == 1) {
                lane[r] = __builtin_ctz(bits);
            } else if (lane[r] < 0 && bits != 0) {
                lane[r] = MATCH_LANES * k + __builtin_ctz(bits);
            }
        }
    }
}

// Moves the cells of one pixel from the window `from` to the window `to`. Lanes missing in `from`
// get the value of `fill`, or UINT8_MAX if that is NULL.
static inline void match_realign(const uint8_t *from_cells, const struct match_tile *from,
                                 const uint8_t *fill, const struct match_tile *to,
                                 uint8_t *to_cells) {
    const int shift = to->base - from->base;  // to lane i is from lane i + shift
    const int first = shift < 0 ? -shift : 0;
    const int beyond = from->lanes - shift < to->lanes ? from->lanes - shift : to->lanes;
    // In steps of constant size, which compile to single moves.
    for (int i = 0; i < to->lanes; i += MATCH_LANES) {
        if (fill == NULL) {
            memset(to_cells + i, UINT8_MAX, MATCH_LANES);
        } else {
            memcpy(to_cells + i, fill + i, MATCH_LANES);
        }
    }
    if (beyond - first >= MATCH_LANES) {
        // The last step ends where the lanes end, and overlaps the one before.
        for (int i = first; i < beyond; i += MATCH_LANES) {
            const int at = i + MATCH_LANES <= beyond ? i : beyond - MATCH_LANES;
            memcpy(to_cells + at, from_cells + at + shift, MATCH_LANES);
        }
    } else {
        for (int i = first; i < beyond; i++) {
            to_cells[i] = from_cells[i + shift];
        }
    }
}

static inline bool match_same_window(const struct match_tile *a, const struct match_tile *b) {
    return a->base == b->base && a->lanes == b->lanes;
}

#endif
