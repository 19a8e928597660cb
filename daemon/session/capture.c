// SPDX-License-Identifier: Apache-2.0
#include "daemon/session/capture.h"

const struct command_argument capture_arguments[CAPTURE_ARGUMENTS] = {
    [CAPTURE_NAME] =
        {.name = "NAME",
         .kind = COMMAND_TEXT,
         .min = 1,
         .max = 60,
         .optional = true,
         .help = "of the new session: letters, digits and - _ . + = , @; default: date and time"},
    [CAPTURE_CHECK] =
        {.name = "CHECK",
         .kind = COMMAND_CHOICE,
         .choices = "static",
         .optional = true,
         .help = "static: take the left image twice and check that the scene has not moved"},
    [CAPTURE_ACCEPT] = {.name = "MISMATCH",
                        .kind = COMMAND_CHOICE,
                        .choices = CAPTURE_ACCEPT_WORD,
                        .optional = true,
                        .help = CAPTURE_ACCEPT_WORD
                        ": accept a saved calibration made with other axes, cameras or windows"},
};

const struct command_argument snapshot_arguments[SNAPSHOT_ARGUMENTS] = {
    [SNAPSHOT_SIZE] = {.name = "SIZE",
                       .kind = COMMAND_CHOICE,
                       .choices = "full",
                       .optional = true,
                       .help =
                           "full: all pixels, in colour; default: grey, at most 640 pixels a side"},
};

struct pair_options capture_options(const struct command_value *values) {
    return (struct pair_options){.check_static = values[CAPTURE_CHECK].given};
}

int capture_take(struct rig *rig, const struct pair_options *options, struct pair *pair,
                 struct registers_all *registers) {
    int error = pair_capture(rig, options, pair);
    if (error != 0) {
        return error;
    }
    error = registers_read_all(rig, registers);
    if (error != 0) {
        pair_release(pair->frame);
        return error;
    }
    for (int side = 0; side < RIG_SIDES; side++) {
        pair_frame_assess(&pair->frame[side]);
    }
    return 0;
}
