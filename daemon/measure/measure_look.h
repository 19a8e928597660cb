// SPDX-License-Identifier: Apache-2.0
/// The subject of a measurement in the surface of a pair.
#ifndef VERGENCE_DAEMON_MEASURE_MEASURE_LOOK_H
#define VERGENCE_DAEMON_MEASURE_MEASURE_LOOK_H

#include "daemon/measure/measure_share.h"
#include "daemon/surface/reconstruct_request.h"
#include "daemon/surface/result/reconstruct_context.h"
#include "measure/measure_place.h"
#include "measure/measure_types.h"
#include "rig/pair_frame.h"

#ifdef __cplusplus
extern "C" {
#endif

/// The request for the coarse surface of a pair.
void measure_look_prepare(const struct measure_step *step, const struct pair_frame frames[2],
                          struct reconstruct_request *request);

/// Fills in the event's subject by the coarse surface of a pair, which has its points: what is at
/// `place` if the machine's request has one, else in the middle. False: there is none.
bool measure_look_at(const struct reconstruct_context *context, const struct pair_frame frames[2],
                     const struct measure *machine, const struct measure_step *step,
                     const struct measure_place *place, struct measure_event *event);

/// The depths of the subject in the surface that was measured. Where that shows something else
/// instead, those of the coarse surface; all, where neither shows it.
struct measure_depths measure_look_depths(const struct reconstruct_context *context,
                                          const struct measure *machine,
                                          const struct measure_place *place);

#ifdef __cplusplus
}
#endif

#endif
