// SPDX-License-Identifier: Apache-2.0
/// What the commands `capture` and `snapshot` are asked: by whoever carries them out, and by
/// whoever plays them again.
#ifndef VERGENCE_DAEMON_SESSION_CAPTURE_H
#define VERGENCE_DAEMON_SESSION_CAPTURE_H

#include "console/command.h"
#include "rig/pair.h"
#include "rig/registers.h"

#ifdef __cplusplus
extern "C" {
#endif

enum { CAPTURE_NAME, CAPTURE_CHECK, CAPTURE_ACCEPT, CAPTURE_ARGUMENTS };

/// The word that goes on with a calibration that does not belong to the instrument as it stands.
#define CAPTURE_ACCEPT_WORD "accept-mismatch"

enum { SNAPSHOT_SIZE, SNAPSHOT_ARGUMENTS };

extern const struct command_argument capture_arguments[CAPTURE_ARGUMENTS];
extern const struct command_argument snapshot_arguments[SNAPSHOT_ARGUMENTS];

/// How the pair is to be taken.
struct pair_options capture_options(const struct command_value *values);

/// Takes the pair, as pair_capture does, then reads all registers, which belong to it, and judges
/// its pictures. Errors of either; `*registers` counts only on success.
int capture_take(struct rig *rig, const struct pair_options *options, uint16_t *memory,
                 size_t values, struct pair *pair, struct registers_all *registers);

#ifdef __cplusplus
}
#endif

#endif
