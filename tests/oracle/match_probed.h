// SPDX-License-Identifier: Apache-2.0
/// Kernels that report to a test which disparities each tile of the finest level searched and which
/// slopes it followed, and that can use averaged costs of the test instead of computing them from
/// the images. Everything else is unchanged.
#ifndef VERGENCE_TESTS_ORACLE_MATCH_PROBED_H
#define VERGENCE_TESTS_ORACLE_MATCH_PROBED_H

#include <stdbool.h>
#include <stdint.h>

#include "stereo/match/kernels.h"

#ifdef __cplusplus
extern "C" {
#endif

/// Lanes [begin, end) of a pixel: disparities, counted from the lowest. Slopes in 1/256
/// disparities.
struct match_window {
    int begin, end;
    bool doubtful;  // the coarser level saw other good matches
    int slope_down, slope_along;
};

struct match_probed {
    struct match_kernels kernels;  // for match_options.kernels
    const struct match_kernels *real;
    // Owned by the caller: row by row, one byte per lane, as many lanes per pixel as the
    // disparities padded to a multiple of 16. NULL: those of the images.
    const uint8_t *averages;
    struct match_window *windows;  // the caller's, to be filled: one per pixel
};

/// Probes the kernels of a processor level. For a finest level with all rows, on one thread.
struct match_probed match_probe(const struct match_kernels *real, const uint8_t *averages,
                                struct match_window *windows);

#ifdef __cplusplus
}
#endif

#endif
