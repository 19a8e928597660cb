// SPDX-License-Identifier: Apache-2.0
/// Reads lens positions that were requested after a given moment. For rig/ only.
#ifndef VERGENCE_RIG_LENS_READ_H
#define VERGENCE_RIG_LENS_READ_H

#include "rig/rig.h"

#ifdef __cplusplus
extern "C" {
#endif

enum {
    /// A controller that sends nothing for this long (us) counts as dead: the rig is safe two
    /// seconds after its line fell silent.
    LENS_READ_SILENCE_US = 1700000,
    /// The same for a controller that sends data but no reading (us): on a bad line only some
    /// questions are answered.
    LENS_READ_INVALID_US = 3000000,
    LENS_READ_MEDIAN = 3,
};

/// Whether the rig is up and has these lenses (bits RIG_LEFT, RIG_RIGHT) with this axis (LENS_AXES:
/// any). Returns 0, ERROR_ARGUMENT, ERROR_NOT_CONNECTED or ERROR_NOT_READY with `last_error` set.
int lens_read_ready(struct rig *self, unsigned sides, enum lens_axis axis);

/// Takes readings of all axes requested at `since_us` or later; waits for them until `until_us`, a
/// time in the past: not at all. ERROR_TIMEOUT: not yet, call again; other errors as in
/// device/lens_driver.h with `last_error` set.
int lens_read_try(struct rig *self, unsigned side, uint64_t since_us, uint64_t until_us,
                  struct lens_reading readings[LENS_AXES]);

/// To be called after a try without a reading. Returns 0 while a reading requested at `since_us`
/// may still come at `now_us`; ERROR_TIMEOUT with `last_error` set if the controller is silent or
/// sends no valid replies.
int lens_read_timeout(struct rig *self, unsigned side, uint64_t since_us, uint64_t now_us);

/// The median of three.
int32_t lens_read_median(const int32_t values[LENS_READ_MEDIAN]);

#ifdef __cplusplus
}
#endif

#endif
