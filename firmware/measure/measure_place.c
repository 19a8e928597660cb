// SPDX-License-Identifier: Apache-2.0
#include "measure/measure_place.h"

#include <math.h>
#include <string.h>

#include "core/invariant.h"
#include "core/math.h"
#include "stereo/geometry/geometry.h"

// A pupil is within a few metres of the other one.
static const double origin_max_mm = 2e6, um_per_mm = 1e3, q20 = 1 << 20;

bool measure_place_of(const struct zoom_calibration *calibration, const struct zoom_state *state,
                      int side, const double pixel_px[2], struct measure_place *place) {
    struct zoom_pair pair;
    double ray[3];
    INVARIANT(side == 0 || side == 1);
    zoom_pair_at(calibration->camera, state, &pair);
    if (!lens_ray(&pair.side[side].lens, pixel_px, ray)) {
        return false;
    }
    geometry_rotate(pair.side[side].R_instrument_camera, ray, place->direction);
    memcpy(place->origin_mm, pair.side[side].position_mm, sizeof place->origin_mm);
    return true;
}

bool measure_place_ray(const struct measure_place *place,
                       const struct zoom_calibration *calibration, const struct zoom_state *state,
                       struct measure_ray *ray) {
    struct zoom_pair pair;
    double arm_mm[3], origin_mm[3], direction[3];
    zoom_pair_at(calibration->camera, state, &pair);
    for (int i = 0; i < 3; i++) {
        arm_mm[i] = place->origin_mm[i] - pair.side[0].position_mm[i];
    }
    geometry_rotate_back(pair.side[0].R_instrument_camera, arm_mm, origin_mm);
    geometry_rotate_back(pair.side[0].R_instrument_camera, place->direction, direction);
    for (int i = 0; i < 3; i++) {
        if (!(fabs(origin_mm[i]) <= origin_max_mm)) {
            return false;
        }
        ray->origin_um[i] = (int32_t)math_round(um_per_mm * origin_mm[i]);
    }
    for (int i = 0; i < 2; i++) {
        if (!(direction[2] > 0 && fabs(direction[i]) <= TRIANGULATE_SLOPE_MAX * direction[2])) {
            return false;
        }
        ray->slope_q20[i] = (int32_t)math_round(q20 * direction[i] / direction[2]);
    }
    return true;
}
