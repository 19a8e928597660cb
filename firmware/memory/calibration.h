// SPDX-License-Identifier: Apache-2.0
/// The command `calibration`: the one in force, which a client has sent. A store keeps its text.
#ifndef VERGENCE_MEMORY_CALIBRATION_H
#define VERGENCE_MEMORY_CALIBRATION_H

#include <stdbool.h>
#include <stddef.h>

#include "console/command.h"
#include "console/pair/calibration_match.h"
#include "hal/store.h"
#include "stereo/zoom/zoom_calibration.h"

/// Puts the calibration that the store keeps in force, and keeps later ones there. After
/// memory_pair_begin; the store must live on.
void memory_calibration_begin(const struct hal_store *store);

bool memory_calibration_is_set(void);

/// The calibration of all zooms in force; NULL: there is none.
const struct zoom_calibration *memory_calibration_zoom(void);

/// The calibration in force for a pair of this state. ERROR_MISSING: there is none; errors of
/// calibration_at_zoom and calibration_match. After ERROR_MISMATCH of the latter `calibration` is
/// set: it can be used if the user accepts that.
int memory_calibration_for(const struct calibration_match_state *state,
                           struct calibration *calibration, struct message *message);

const struct command *memory_calibration_table(size_t *count);

#endif
