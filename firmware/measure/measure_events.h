// SPDX-License-Identifier: Apache-2.0
/// What a measurement learns from a step. For measure.c, and for what a driver need not compute.
#ifndef VERGENCE_MEASURE_MEASURE_EVENTS_H
#define VERGENCE_MEASURE_MEASURE_EVENTS_H

#include "measure/measure_types.h"

#ifdef __cplusplus
extern "C" {
#endif

enum measure_outcome {
    MEASURE_DONE,    ///< the next phase follows
    MEASURE_REPEAT,  ///< the phase in `self` is to be taken, again
    MEASURE_FAILED,  ///< there is no way to continue
};

/// Takes over what the step of the present phase showed, `axes` excepted.
enum measure_outcome measure_take(struct measure *self, const struct measure_event *event);

/// What a surface's event will lead to advise, before it has `other_mm` and `board_mm`: which of
/// them counts.
enum measure_advice measure_advice_after(const struct measure *self,
                                         const struct measure_event *event);

/// Whether a value from outside is finite and a length that an instrument may have.
bool measure_is_length(double value_mm);

#ifdef __cplusplus
}
#endif

#endif
