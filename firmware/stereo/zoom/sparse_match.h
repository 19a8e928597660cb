// SPDX-License-Identifier: Apache-2.0
/// Distinct points of two pictures that show the same things from places that need not be known
/// well: corners, described by 256 comparisons of grey values (BRIEF, Calonder et al., ECCV 2010),
/// paired where the description agrees both ways, then aligned to a fraction of a pixel.
#ifndef VERGENCE_STEREO_ZOOM_SPARSE_MATCH_H
#define VERGENCE_STEREO_ZOOM_SPARSE_MATCH_H

#include <stdbool.h>
#include <stddef.h>

#include "core/arena.h"
#include "stereo/image/image.h"

#ifdef __cplusplus
extern "C" {
#endif

enum {
    SPARSE_LEFT_MAX = 2048,
    SPARSE_RIGHT_MAX = 8192,
};

/// Where the partner of a point is expected, in px of the other picture: around the line from
/// `from` to `to`, `across` px to each side of it and `beyond` px past both ends.
struct sparse_region {
    double from[2], to[2], across, beyond;
};

/// Expected region of a point of the left picture; false: it has none.
typedef bool sparse_expect(void *self, const double left_px[2], struct sparse_region *region);

struct sparse_pair {
    double left_px[2], right_px[2];
};

/// A picture and its corners. All points into the arena.
struct sparse_picture {
    struct image_u8 image;
    struct image_u8 level;  // reduced, and smoothed
    int factor;             // px of `image` in one of `level`
    int count;
    struct sparse_corner *corner;  // sorted by rows
};

/// Means over squares of `factor` px; `level` has its size and memory.
void sparse_reduce(const struct image_u8 *image, int factor, struct image_u8 *level);

/// Finds at most `max` corners, spread over the picture. ERROR_MEMORY, ERROR_TOO_SMALL.
int sparse_picture_make(const struct image_u8 *image, int max, struct arena *arena,
                        struct sparse_picture *picture);
size_t sparse_picture_need_bytes(int width, int height, int max);

/// Pairs of corners, at most the left ones' number. `serve` is called before each of them is looked
/// at. Returns their number, or ERROR_MEMORY.
int sparse_match(const struct sparse_picture *left, const struct sparse_picture *right,
                 sparse_expect *expect, void (*serve)(void *self), void *self, struct arena *arena,
                 struct sparse_pair *pairs);
size_t sparse_match_need_bytes(int left_max, int right_max);

#ifdef __cplusplus
}
#endif

#endif
