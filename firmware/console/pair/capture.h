// SPDX-License-Identifier: Apache-2.0
/// What the commands `capture` and `view` are on every instrument and in a replay: arguments, work,
/// and the answer.
#ifndef VERGENCE_CONSOLE_PAIR_CAPTURE_H
#define VERGENCE_CONSOLE_PAIR_CAPTURE_H

#include "console/command.h"
#include "rig/pair.h"
#include "rig/registers.h"

#ifdef __cplusplus
extern "C" {
#endif

enum {
    CAPTURE_NAME,
    CAPTURE_ADD,
    CAPTURE_CHECK,
    CAPTURE_ACCEPT,
    CAPTURE_AVERAGE,
    CAPTURE_BRACKET,
    CAPTURE_READINGS,
    CAPTURE_ARGUMENTS
};

/// The argument that accepts a calibration that does not belong to the instrument's current state.
#define CAPTURE_ACCEPT_NAME "accept-mismatch"
/// How it is written at the console.
#define CAPTURE_ACCEPT_WORD CAPTURE_ACCEPT_NAME "=yes"

enum { VIEW_FULL, VIEW_ARGUMENTS };
/// Maximum side of one camera's picture by `view` without "full".
enum { VIEW_SIDE_MAX_PX = 640 };

extern const struct command_argument capture_arguments[CAPTURE_ARGUMENTS];
extern const struct command_argument view_arguments[VIEW_ARGUMENTS];

/// The pair options that the arguments ask for. If both average and bracket are given, the bracket
/// counts. `memory` is for merged images (struct pair_options).
struct pair_options capture_options(const struct command_value *values,
                                    const struct pair_memory *memory);

/// Takes the frames of `view`, see pair_look.
int view_take(struct rig *rig, const struct command_value *values,
              struct pair_look_frame looks[RIG_SIDES]);

/// Takes the pair as pair_capture does, then reads all registers and computes the image statistics.
/// Errors of either; on success `*registers` is set, and the caller releases the pair.
int capture_take(struct rig *rig, const struct pair_options *options, struct pair *pair,
                 struct registers_all *registers);

/// Adds what `capture` reports of a pair, whose statistics are computed, to its answer.
void capture_reply(const struct command_call *call, const struct pair *pair);

#ifdef __cplusplus
}
#endif

#endif
