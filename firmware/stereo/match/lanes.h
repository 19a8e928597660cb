// SPDX-License-Identifier: Apache-2.0
// Text that each set of kernels compiles: the lanes of a pixel, their neighbours and their moves
// between windows and along slopes.
#ifndef VERGENCE_STEREO_MATCH_LANES_H
#define VERGENCE_STEREO_MATCH_LANES_H

#include "stereo/match/state.h"

/// Runs `call(N, false)` with the number of lanes as a constant for common values, so that the
/// loops over lanes are unrolled; or `call(N, true)` in a tile that follows a `slope`, where
/// vectors of several members make up for the larger code, and else `call(lanes, true)`. The
/// functions below are inlined into each case.
#define MATCH_WITH_CONSTANT_LANES(lanes, slope, call)                             \
    do {                                                                          \
        if (VECTOR_MEMBERS > 1 && (slope) != 0 && (lanes) == 16) {                \
            call(16, true);                                                       \
            break;                                                                \
        }                                                                         \
        if (VECTOR_MEMBERS > 1 && (slope) != 0 && (lanes) == 32) {                \
            call(32, true);                                                       \
            break;                                                                \
        }                                                                         \
        switch ((slope) == 0 && (lanes) <= VECTOR_LANES_UNROLLED ? (lanes) : 0) { \
            case 16:                                                              \
                call(16, false);                                                  \
                break;                                                            \
            case 32:                                                              \
                call(32, false);                                                  \
                break;                                                            \
            case 48:                                                              \
                call(48, false);                                                  \
                break;                                                            \
            case 64:                                                              \
                call(64, false);                                                  \
                break;                                                            \
            default:                                                              \
                call(lanes, (slope) != 0);                                        \
                break;                                                            \
        }                                                                         \
    } while (0)

#define MATCH_INLINE static inline __attribute__((always_inline))

// Of an array of cells: the Blackfin takes four at a time.
#if defined(VECTOR_HAS_CELLS)
#define MATCH_ALIGNED _Alignas(4)
#else
#define MATCH_ALIGNED
#endif

enum { PATH_COST_VECTORS = MATCH_MAX_DISPARITIES / MATCH_LANES };

/// All lanes of a pixel, or of one pixel for each member.
struct lanes {
    struct vector part[PATH_COST_VECTORS];
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
MATCH_INLINE struct vector lower_neighbour(const struct lanes *pixel, int k, struct vector before,
                                           const int lanes) {
    const struct vector after =
        k + 1 < lanes / MATCH_LANES ? pixel->part[k + 1] : vector_all(UINT8_MAX);
    return vector_min(vector_up(pixel->part[k], before), vector_down(pixel->part[k], after));
}

// Part k of an average, in which each lane may be replaced by a neighbour's value plus `price`: an
// average along a slanted surface. `before` as above.
MATCH_INLINE struct vector leaning(const struct lanes *pixel, int k, struct vector before,
                                   struct vector price, const int lanes) {
    const struct vector beside = lower_neighbour(pixel, k, before, lanes);
    return vector_min(pixel->part[k], vector_add(beside, price));
}

// Moves all lanes up by `rise`, as far as a surface rises from one pixel to the next. Those that
// come from beyond the ends are `low` and `high`. Not inlined: few tiles are slanted.
static __attribute__((noinline)) void move_lanes(struct lanes *pixel, int rise, struct vector low,
                                                 struct vector high, int lanes) {
    const int count = lanes / MATCH_LANES;
    for (int i = 0; i < rise; i++) {
        struct vector before = low;
        for (int k = 0; k < count; k++) {
            const struct vector here = pixel->part[k];
            pixel->part[k] = vector_up(here, before);
            before = here;
        }
    }
    for (int i = 0; i > rise; i--) {
        for (int k = 0; k < count; k++) {
            pixel->part[k] = vector_down(pixel->part[k], k + 1 < count ? pixel->part[k + 1] : high);
        }
    }
}

MATCH_INLINE void shear(struct lanes *pixel, int rise, struct vector low, struct vector high,
                        const int lanes) {
    if (rise != 0) {
        move_lanes(pixel, rise, low, high, lanes);
    }
}

// Shears an average as it arrives in the pixel of `at` and `cell`, whose own costs at the ends of
// its window stand for what lies beyond these.
MATCH_INLINE void shear_average(struct lanes *pixel, int rise, const uint8_t *const at[],
                                ptrdiff_t cell, const int lanes) {
    if (rise != 0) {
        move_lanes(pixel, rise, vector_each(at, cell), vector_each(at, cell + lanes - 1), lanes);
    }
}

// Moves the cells of one pixel from the window `from` to the window `to`. Lanes missing in `from`
// get the value of `fill`, or UINT8_MAX if that is NULL.
static inline void match_realign(const uint8_t *from_cells, const struct match_tile *from,
                                 const uint8_t *fill, const struct match_tile *to,
                                 uint8_t *to_cells) {
    const int shift = to->base - from->base;  // lane i of `to` gets lane i + shift of `from`
    const int first = shift < 0 ? -shift : 0;
    const int beyond = from->lanes - shift < to->lanes ? from->lanes - shift : to->lanes;
#if defined(VECTOR_HAS_CELLS)
    if (fill == NULL) {
        memset(to_cells, UINT8_MAX, (size_t)to->lanes);
    } else {
        cells_copy(fill, to_cells, to->lanes);
    }
    cells_place(from_cells, shift, first, beyond, to_cells);
#else
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
#endif
}

MATCH_INLINE void match_copy_cells(const uint8_t *from, uint8_t *to, int lanes) {
#if defined(VECTOR_HAS_CELLS)
    cells_copy(from, to, lanes);
#else
    memcpy(to, from, (size_t)lanes);
#endif
}

static inline bool match_same_window(const struct match_tile *a, const struct match_tile *b) {
    return a->base == b->base && a->lanes == b->lanes;
}

MATCH_INLINE void member_cells(uint8_t *cells, int c, uint8_t *at[VECTOR_MEMBERS],
                               const int lanes) {
    for (int member = 0; member < VECTOR_MEMBERS; member++) {
        at[member] = cells + (ptrdiff_t)(c + member) * lanes;
    }
}

#endif
