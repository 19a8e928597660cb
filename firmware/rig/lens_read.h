// SPDX-License-Identifier: Apache-2.0
/// Readings of the rig's lenses that were asked for after a given moment. For rig/ alone.
#ifndef VERGENCE_RIG_LENS_READ_H
#define VERGENCE_RIG_LENS_READ_H

#include "rig/rig.h"

#ifdef __cplusplus
extern "C" {
#endif

enum {
    /// A controller that has sent nothing at all for so long is taken for dead (us): the rig is
    /// safe
    /// two seconds after its line fell silent.
    LENS_READ_SILENCE_US = 1700000,
    /// And one that sends, but no reading (us): on a bad line one question of several is answered.
    LENS_READ_NONSENSE_US = 3000000,
    LENS_READ_MEDIAN = 3,
};

/// Whether the rig is up and has these lenses (bits RIG_LEFT, RIG_RIGHT) with this axis (LENS_AXES:
/// any): 0, ERROR_ARGUMENT, ERROR_NOT_CONNECTED or ERROR_NOT_READY, told in `trouble`.
int lens_read_ready(struct rig *self, unsigned sides, enum lens_axis axis);

/// One try, of WATCH_STEP_US at most, at a reading of all axes that was asked for at `since_us` or
/// later. ERROR_TIMEOUT: not yet, call again; others as lens.h, told in `trouble`.
int lens_read_try(struct rig *self, unsigned side, uint64_t since_us,
                  struct lens_reading readings[LENS_AXES]);

/// After a try that brought no reading: 0 when one that is wanted since `since_us` may still come
/// at `now_us`; ERROR_TIMEOUT, told in `trouble`, when the controller is silent or makes no sense.
int lens_read_patience(struct rig *self, unsigned side, uint64_t since_us, uint64_t now_us);

/// The part for messages.
enum rig_part lens_read_part(unsigned side);

/// The middle one of three.
int32_t lens_read_median(const int32_t values[LENS_READ_MEDIAN]);

#ifdef __cplusplus
}
#endif

#endif
