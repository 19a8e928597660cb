// SPDX-License-Identifier: Apache-2.0
/// The subject of a measurement in the coarse surface of a pair.
#ifndef VERGENCE_DAEMON_MEASURE_MEASURE_LOOK_H
#define VERGENCE_DAEMON_MEASURE_MEASURE_LOOK_H

#include "daemon/surface/reconstruct_request.h"
#include "daemon/surface/result/reconstruct_context.h"
#include "measure/measure_subject.h"
#include "measure/measure_types.h"
#include "rig/pair_frame.h"

#ifdef __cplusplus
extern "C" {
#endif

struct measure_look {
    /// A point that is looked at, in the instrument's frame; NULL: the middle of both views.
    const struct measure_ray *ray;
    /// Width in which the subject is: mm + per_mm * its distance; 0 0: all of the view.
    double width_mm, width_per_mm;
    double near_mm, far_mm;  ///< depths that count; 0: not limited
};

/// The request for the coarse surface of a pair.
void measure_look_prepare(const struct measure_step *step, const struct pair_frame frames[2],
                          struct reconstruct_request *request);

/// Sets the width by what is wanted of the picture. `left`: the left frame.
void measure_look_set_width(struct measure_look *self, const struct measure_request *request,
                            const struct zoom_calibration *calibration,
                            const struct pair_frame *left);

/// Fills in the event's subject by a surface that has its points. `window`: that of the right
/// frame. False: there is none.
bool measure_look_find(const struct reconstruct_context *context, const struct pair_window *window,
                       const struct measure_look *look, struct measure_event *event);

/// Where the line through the middle of both cameras, along the mean of their views, is.
struct measure_ray measure_look_middle(const struct calibration *calibration);

#ifdef __cplusplus
}
#endif

#endif
