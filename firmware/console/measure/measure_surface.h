// SPDX-License-Identifier: Apache-2.0
/// A surface as a measurement asks for it and reads it.
#ifndef VERGENCE_CONSOLE_MEASURE_MEASURE_SURFACE_H
#define VERGENCE_CONSOLE_MEASURE_MEASURE_SURFACE_H

#include <stdbool.h>
#include <stdint.h>

#include "rig/pair_frame.h"
#include "stereo/geometry/calibration.h"
#include "surface/surface_figures.h"

#ifdef __cplusplus
extern "C" {
#endif

/// What a surface is computed from.
struct measure_search {
    uint32_t pair;           ///< number of the pair; 0: the last one, for a coarse surface
    uint32_t with_pair;      ///< of a pair at another zoom; 0: none
    double near_mm, far_mm;  ///< depths to search; 0 0: not known
    double scale;            ///< of the pictures
};

enum { MEASURE_SURFACE_NAME_BYTES = 300 };

/// Owns nothing; valid until the next surface, or the end of the measurement.
struct measure_surface {
    const struct reconstruct_result *result;  ///< a coarse one with its points
    const struct calibration *calibration;    ///< for frames shrunk by `shrink`
    int shrink;
    const struct pair_frame *frames;        ///< of the pair
    char name[MEASURE_SURFACE_NAME_BYTES];  ///< its directory; not of a coarse one
    struct surface_figures_spread spread;   ///< of all points
    double common_mm;                       ///< that all share at the median depth; < 0: not known
    bool with_used;                         ///< the pair at the other zoom helped
    bool misfit;                            ///< ADJUST_CALIBRATE of stereo/zoom/adjust_pair.h
    const char *doubt;                      ///< why most of the pictures does not match; NULL
    double seconds;                         ///< of computing
};

#ifdef __cplusplus
}
#endif

#endif
