// SPDX-License-Identifier: Apache-2.0
/// Errors of parts, and their messages. For rig/ only, but for rig_part_text.
#ifndef VERGENCE_RIG_BASE_ERROR_H
#define VERGENCE_RIG_BASE_ERROR_H

#include "rig/base/rig_state.h"

#ifdef __cplusplus
extern "C" {
#endif

/// The part of a side, given that of the left side.
enum rig_part rig_part_of(enum rig_part left, unsigned side);

/// Sets `last_error` to "<part>: <what>", with each # of `what` replaced by the next of `numbers`
/// (NULL: no replacement); text that is too long is cut off. Returns `error`.
int rig_part_error(struct rig *self, enum rig_part part, int error, const char *what,
                   const int32_t *numbers);

/// Logs "<part>: <what>", cut off if it is too long.
void rig_part_log(const struct rig *self, enum rig_part part, enum hal_log_level level,
                  const char *what);

/// The same for a part that does not work: if its device could not be opened, the reason for that,
/// else `what`, without numbers. Returns `error`.
int rig_part_failed(struct rig *self, enum rig_part part, int error, const char *what);

/// The same for a failed I2C transfer: what is wrong, and what to do. Returns `error`.
int rig_bus_failed(struct rig *self, enum rig_part part, int error);

/// As rig_part_error, but sets `rejected`.
int rig_reject(struct rig *self, enum rig_part part, int error, const char *what,
               const int32_t *numbers);

#ifdef __cplusplus
}
#endif

#endif
