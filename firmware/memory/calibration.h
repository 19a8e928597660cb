// SPDX-License-Identifier: Apache-2.0
/// The command `calibration`: the one in force, which a client has sent. It is in memory.
#ifndef VERGENCE_MEMORY_CALIBRATION_H
#define VERGENCE_MEMORY_CALIBRATION_H

#include <stddef.h>

#include "console/command.h"
#include "stereo/geometry/calibration.h"

/// The calibration in force; NULL: none.
const struct calibration *memory_calibration(void);

const struct command *memory_calibration_table(size_t *count);

#endif
