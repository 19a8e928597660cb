// SPDX-License-Identifier: Apache-2.0
/// Messages of failed parts. For rig/ only.
#ifndef VERGENCE_RIG_FAILURE_H
#define VERGENCE_RIG_FAILURE_H

#include "rig/rig_state.h"

#ifdef __cplusplus
extern "C" {
#endif

/// The part of a side, given that of the left side.
enum rig_part failure_part(enum rig_part left, unsigned side);

/// Sets `last_error` to a failed I2C transfer: what is wrong, and what to do. Returns `error`.
int failure_of_bus(struct rig *self, enum rig_part part, int error);

/// Records that the bridge was used with this result, and on an error sets `last_error` as
/// failure_of_bus does. Returns `error`.
int failure_of_bridge(struct rig *self, int error);

#ifdef __cplusplus
}
#endif

#endif
