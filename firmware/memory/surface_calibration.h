// SPDX-License-Identifier: Apache-2.0
/// The calibration of a pair's frames, from the one in force.
#ifndef VERGENCE_MEMORY_SURFACE_CALIBRATION_H
#define VERGENCE_MEMORY_SURFACE_CALIBRATION_H

#include <stdbool.h>

#include "console/pair/calibration_match.h"
#include "console/pair/pair_adjust.h"
#include "core/parallel.h"
#include "rig/rig.h"

struct surface_calibration_request {
    const struct rig *rig;
    const struct pair *pair;
    const struct pair *with_pair;  ///< helps to correct it, at another zoom; NULL: none
    bool accept_mismatch;
    bool adjust;     ///< the pictures correct it, if it is of all zooms
    double near_mm;  ///< nearest depth of the scene; 0: not known
    struct watch watch;
};

struct surface_calibration {
    struct calibration calibration;
    struct calibration_match_state state;  ///< of the pair
    bool axes_compared;
    struct message mismatch;  ///< that was accepted; "": none
    bool adjusted;
    struct pair_adjust_report report;  ///< how it was adjusted
};

/// Errors of memory_calibration_for and pair_adjust, ERROR_SIZE_MISMATCH; with `message`.
int surface_calibration_make(const struct surface_calibration_request *request, struct arena *arena,
                             struct surface_calibration *self, struct message *message);

#endif
