// SPDX-License-Identifier: Apache-2.0
/// What the command `capture` is asked: by whoever carries it out, and by whoever plays it again.
#ifndef VERGENCE_DAEMON_CAPTURE_H
#define VERGENCE_DAEMON_CAPTURE_H

#include "rig/command.h"
#include "rig/pair.h"

#ifdef __cplusplus
extern "C" {
#endif

enum { CAPTURE_NAME, CAPTURE_CHECK, CAPTURE_ARGUMENTS };

extern const struct command_argument capture_arguments[CAPTURE_ARGUMENTS];

/// How the pair is to be taken.
struct pair_options capture_options(const struct command_value *values);

#ifdef __cplusplus
}
#endif

#endif
