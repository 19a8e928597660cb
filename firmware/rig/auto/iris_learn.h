// SPDX-License-Identifier: Apache-2.0
/// Learns how far each position of an iris is open, from the brightness of a scene that does not
/// change: the f-number is proportional to 1 / sqrt(light).
///
/// The iris is closed step by step from its open end. At each step frames of a region are averaged;
/// when they become dark, the exposure is made longer by a known factor. Exposures are multiples of
/// 10 ms, a half period of 50 Hz, unless the light is too bright. At the end the open iris is
/// measured again, to see whether the light has changed. Then the iris returns to where it was;
/// window, exposure and gain are as before.
///
/// A camera with its own port must be linear (no gamma), with its automatic controls off.
#ifndef VERGENCE_RIG_AUTO_IRIS_LEARN_H
#define VERGENCE_RIG_AUTO_IRIS_LEARN_H

#include "rig/rig.h"

#ifdef __cplusplus
extern "C" {
#endif

enum {
    RIG_IRIS_LEARN_POINTS = 12,
    RIG_IRIS_LEARN_REGION_PX = 128,  ///< side of the region in the middle of the frame
};

/// Learns the iris of a lens and stores the table in its `learned`. Returns 0; ERROR_NOT_CONNECTED;
/// ERROR_NOT_READY; ERROR_RANGE (too bright or too dark for all exposures) or ERROR_MOVED (the
/// light has changed) with `rejected` set and the table as before; ERROR_CANCELLED and errors of
/// the parts, with the ring at rest.
int rig_iris_learn(struct rig *self, unsigned side);

#ifdef __cplusplus
}
#endif

#endif
