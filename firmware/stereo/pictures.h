// SPDX-License-Identifier: Apache-2.0
/// The rectified pictures of a pair, made from its raw images row by row: all at once, or, where
/// memory is short, those that a stage asks for, which replace the oldest.
#ifndef VERGENCE_STEREO_PICTURES_H
#define VERGENCE_STEREO_PICTURES_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "core/arena.h"
#include "core/parallel.h"
#include "core/raw_image.h"
#include "stereo/develop.h"
#include "stereo/geometry/calibration.h"
#include "stereo/geometry/rectify.h"
#include "stereo/image/image.h"

#ifdef __cplusplus
extern "C" {
#endif

/// One camera's picture, whole or in rings, of as many rows as the other camera's; the ring of
/// `colour` may be smaller than that of `grey`, and the right one have no data if colour is wanted
/// of the left one alone.
struct picture_side {
    struct raw_image raw;
    struct image_u8 grey;
    struct image_rgb8 colour;
    struct rectify_span *span;      // valid columns of each row
    struct rectify_extent *extent;  // raw rows of each row
    struct rectify_table table;
    struct develop_state develop;
    struct rectify_strip strip;  // developed raw rows in memory
    int strip_rows;              // for so many there is memory
};

struct pictures {
    struct picture_side side[2];
    int sides;       // 2; 1: only the left one is wanted
    bool in_colour;  // whether colour is wanted, too
    int begin, end;  // the rows that are there
    const struct parallel *parallel;
    int32_t *coordinates_q16;         // 2 * width values per part
    uint64_t (*now_us)(void *self);   // may be NULL, as in reconstruct_environment
    void *clock;                      // its argument
    uint64_t develop_us, rectify_us;  // time spent
};

/// Memory that `pictures_begin` takes for raw images of so many bits a pixel. `*ahead_bytes`: what
/// `pictures_begin_ahead` takes.
size_t pictures_need_bytes(const struct rectify_plan *plan, const struct calibration *calibration,
                           int bits, int threads, int ring_rows, size_t *ahead_bytes);

/// Prepares to make the rows of a pair, of which none is there. The caller has set both sides' raw
/// image, pictures and memory for the spans, and `parallel` and the clock; all must live as long as
/// rows are asked for. ERROR_MEMORY, and the errors of the tables and of development.
int pictures_begin(struct pictures *pictures, const struct rectify_plan *plan,
                   const struct calibration *calibration, struct arena *arena);

/// Prepares to make the rows of the same pair at a second place, in grey, into rings of `ring_rows`
/// rows, while `pictures` lives; not both at the same time. ERROR_MEMORY.
int pictures_begin_ahead(const struct pictures *pictures, int ring_rows, struct arena *arena,
                         struct pictures *ahead);

/// From now on only the left side is wanted, or both, and only grey, or colour too. Where that
/// changes no row is there any more.
void pictures_want(struct pictures *pictures, int sides, bool in_colour);

/// Makes rows [begin, end) of both sides, if they are not there. As many rows before `end` as the
/// rings have stay; end - begin is no larger. Cheap in ascending order.
void pictures_rows(struct pictures *pictures, int begin, int end);

#ifdef __cplusplus
}
#endif

#endif
