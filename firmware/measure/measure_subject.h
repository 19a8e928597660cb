// SPDX-License-Identifier: Apache-2.0
/// The subject in a coarse surface: what is nearest on a ray, how far away, how deep and
/// how wide. Integers only.
#ifndef VERGENCE_MEASURE_MEASURE_SUBJECT_H
#define VERGENCE_MEASURE_MEASURE_SUBJECT_H

#include <stdbool.h>
#include <stdint.h>

#include "stereo/geometry/triangulate.h"

#ifdef __cplusplus
extern "C" {
#endif

/// A ray in the left camera's frame: from a point along (x, y, 1), of which x and y are
/// in 2^-20 and at most TRIANGULATE_SLOPE_MAX.
struct measure_ray {
    int32_t origin_um[3];
    int32_t slope_q20[2];
};

struct measure_subject_request {
    struct measure_ray ray;
    /// Half of the width of the picture around the ray in which the subject is, um at its depth; 0:
    /// all of the view.
    int32_t half_um;
    int32_t near_um, far_um;  ///< depths that count; 0: not limited
};

struct measure_subject {
    int32_t middle_um[3];     ///< of its points around the ray: medians
    int32_t near_um, far_um;  ///< all but 1 % of its points at each end
    int32_t width_um;         ///< twice the distance from the ray that 98 % of them have across
    uint32_t points, around;  ///< of the subject; of these around the ray
};

/// Finds the subject among `count` points. Its depths are all that follow each other without a gap
/// of MEASURE_SUBJECT_GAP_PERMILLE. False: fewer than MEASURE_SUBJECT_POINTS_MIN points are around
/// the ray.
bool measure_subject_find(const struct triangulate_point *points, uint32_t count,
                          const struct measure_subject_request *request,
                          struct measure_subject *subject);

enum { MEASURE_SUBJECT_POINTS_MIN = 40, MEASURE_SUBJECT_GAP_PERMILLE = 47 };

#ifdef __cplusplus
}
#endif

#endif
