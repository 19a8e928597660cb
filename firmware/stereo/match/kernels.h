// SPDX-License-Identifier: Apache-2.0
/// The steps on pixels, compiled once per processor level from the same text (kernels_text.h) with
/// the level's own vector operations on the disparities of one or two pixels. Plain C is the
/// reference (vector_plain.h); every level gives identical results.
#ifndef VERGENCE_STEREO_MATCH_KERNELS_H
#define VERGENCE_STEREO_MATCH_KERNELS_H

#include <stdint.h>

#include "stereo/image/image.h"

#ifdef __cplusplus
extern "C" {
#endif

struct match_level;
struct match_scratch;

struct match_kernels {
    const char *name;

    /// Before a band, MATCH_ROWS_ABREAST rows of a level from y_begin on, in the present band or in
    /// the next one: features, costs and their edge-aware average along the row, into the ring.
    void (*cost_rows)(struct match_level *level, struct match_scratch *scratch, int y_begin);

    /// Then tiles [begin, end) of the band: averages along the columns, path costs from above.
    void (*columns)(struct match_level *level, struct match_scratch *scratch, int begin, int end);

    /// Then MATCH_ROWS_ABREAST rows of the band from y_begin on: path costs along the rows, winners
    /// and checks, into the output or the surface.
    void (*rows)(struct match_level *level, struct match_scratch *scratch, int y_begin);

    /// Row y of a coarser level, from the image that it shows: width pixels.
    void (*scale)(const struct match_level *level, const struct image_u8 *image, int y,
                  uint8_t *pixels);

    /// After the last band, columns [x_begin, x_end) of the output: medians of three along the
    /// columns, and the rows between those of the finest level.
    void (*finish)(const struct match_level *level, struct match_scratch *scratch, int x_begin,
                   int x_end);
};

extern const struct match_kernels match_plain_kernels;
#if defined(__x86_64__)
extern const struct match_kernels match_sse41_kernels;
extern const struct match_kernels match_avx2_kernels;
#endif
#if defined(__ARM_NEON)
extern const struct match_kernels match_neon_kernels;
#endif

/// The fastest set that this processor runs.
const struct match_kernels *match_kernels_best(void);

/// The set with this name, for tests and measurements; NULL if there is none or the processor
/// cannot run it.
const struct match_kernels *match_kernels_named(const char *name);

#ifdef __cplusplus
}
#endif

#endif
