// SPDX-License-Identifier: Apache-2.0
/// Figures of a surface: what was measured of it, and how its depths and errors spread.
#ifndef VERGENCE_SURFACE_SURFACE_FIGURES_H
#define VERGENCE_SURFACE_SURFACE_FIGURES_H

#include <stdbool.h>
#include <stdint.h>

#include "core/arena.h"
#include "stereo/reconstruct.h"

#ifdef __cplusplus
extern "C" {
#endif

/// Whether the point of this pixel (y * width + x) was not measured: see stereo/fill.h.
bool surface_figures_is_filled(const struct reconstruct_result *result, uint32_t pixel);

/// Number of points without the filled ones.
uint32_t surface_figures_measured_count(const struct reconstruct_result *result);

enum { SURFACE_FIGURES_QUANTILES = 3 };

/// Quantiles of depth and sigma of the measured points; extreme values would be dominated by single
/// points.
struct surface_figures_spread {
    double depth_mm[SURFACE_FIGURES_QUANTILES];  ///< quantiles for 1 %, 50 % and 99 % of the points
    double sigma_mm[SURFACE_FIGURES_QUANTILES];  ///< quantiles for 5 %, 50 % and 95 % of the points
};

/// Depths of points, left camera, both inclusive.
struct surface_figures_depths {
    int32_t near_um, far_um;
};

/// The spread of the measured points with these depths (NULL: all), of which there are `points`, at
/// least one. False if the arena is too small (`spread` is unchanged).
bool surface_figures_find_spread(const struct reconstruct_result *result,
                                 const struct surface_figures_depths *depths, uint32_t points,
                                 struct arena *arena, struct surface_figures_spread *spread);
size_t surface_figures_spread_need_bytes(void);

#ifdef __cplusplus
}
#endif

#endif
