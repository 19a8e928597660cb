// SPDX-License-Identifier: Apache-2.0
/// Calibrations from texts of either kind, in memory of malloc.
#ifndef VERGENCE_DAEMON_SESSION_CALIBRATION_READ_H
#define VERGENCE_DAEMON_SESSION_CALIBRATION_READ_H

#include <stddef.h>

#include "console/pair/calibration_at.h"
#include "daemon/base/message.h"

#ifdef __cplusplus
extern "C" {
#endif

/// calibration_at_parse_zoom, allocated by malloc. Its errors; ERROR_MEMORY.
int calibration_read_zoom(const char *name, const char *text, size_t length,
                          struct zoom_calibration **zoom, struct message *message);

/// The calibration for a pair from a text of either kind. Errors of calibration_at and
/// calibration_at_zoom; ERROR_MEMORY.
int calibration_read_for_pair(const char *name, const char *text, size_t length,
                              const struct calibration_match_state *axes,
                              struct calibration *calibration, struct message *message);

#ifdef __cplusplus
}
#endif

#endif
