// SPDX-License-Identifier: Apache-2.0
#include "focus/depth_iris.h"

#include "core/invariant.h"
#include "core/math.h"

struct depth_iris depth_iris_for(const struct lens_state *lens, double near_mm, double far_mm,
                                 double blur_mm, const struct depth_iris_limits *limits) {
    INVARIANT(limits->open > 0 && limits->open <= limits->closed);
    const double needed = lens_f_number_for_blur(lens, near_mm, far_mm, blur_mm);
    const double open = math_min(limits->closed, math_max(limits->open, limits->steady));
    const struct {
        double f_number;
        enum depth_iris_limit limit;
    } bounds[] = {
        {lens_f_number_for_diffraction(lens, near_mm, far_mm), DEPTH_IRIS_DIFFRACTION},
        {limits->closed, DEPTH_IRIS_CLOSED},
        {limits->dark, DEPTH_IRIS_DARK},
    };
    struct depth_iris found = {.f_number = needed, .limit = DEPTH_IRIS_NEEDED};
    for (unsigned i = 0; i < sizeof bounds / sizeof bounds[0]; i++) {
        if (found.f_number > bounds[i].f_number) {
            found.f_number = bounds[i].f_number;
            found.limit = bounds[i].limit;
        }
    }
    if (found.f_number < open) {
        found.f_number = open;
        if (open > limits->open) {
            found.limit = DEPTH_IRIS_STEADY;
        } else if (needed <= open) {
            found.limit = DEPTH_IRIS_OPEN;
        }
    }
    struct lens_state state = *lens;
    state.f_number = found.f_number;
    found.blur_mm = math_max(lens_blur(&state, near_mm), lens_blur(&state, far_mm));
    lens_sharp_range(&state, blur_mm, &found.sharp_near_mm, &found.sharp_far_mm);
    return found;
}
