// SPDX-License-Identifier: Apache-2.0
/// The subject of a measurement in the surface of a pair.
#ifndef VERGENCE_CONSOLE_MEASURE_MEASURE_LOOK_H
#define VERGENCE_CONSOLE_MEASURE_MEASURE_LOOK_H

#include "console/measure/measure_surface.h"
#include "core/arena.h"
#include "measure/measure_place.h"
#include "measure/measure_types.h"

#ifdef __cplusplus
extern "C" {
#endif

/// The search for the coarse surface of a pair.
void measure_look_prepare(const struct measure_step *step, const struct pair_frame *left,
                          struct measure_search *search);

/// Fills in the event's subject by the coarse surface of a pair: what is at `place` if the
/// machine's request has one, else in the middle. False: there is none.
bool measure_look_at(const struct measure_surface *surface, const struct measure *machine,
                     const struct measure_step *step, const struct measure_place *place,
                     struct measure_event *event);

/// The depths of the subject in the surface that was measured. Where that shows something else
/// instead, those of the coarse surface; all, where neither shows it. The arena has
/// measure_share_need_bytes.
struct surface_figures_depths measure_look_depths(const struct measure_surface *surface,
                                                  const struct measure *machine,
                                                  const struct measure_place *place,
                                                  struct arena *arena);

#ifdef __cplusplus
}
#endif

#endif
