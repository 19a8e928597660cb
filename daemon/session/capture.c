// SPDX-License-Identifier: Apache-2.0
#include "daemon/session/capture.h"

#include <stdlib.h>

#include "core/error.h"

const struct command_argument capture_arguments[CAPTURE_ARGUMENTS] = {
    [CAPTURE_NAME] =
        {.name = "NAME",
         .kind = COMMAND_TEXT,
         .min = 1,
         .max = 60,
         .optional = true,
         .help = "of a new session for the pair: letters, digits and - _ . + = , @; default: only "
                 "in memory"},
    [CAPTURE_ADD] = {.name = "add",
                     .kind = COMMAND_FLAG,
                     .help = "add the pair to the session NAME if it exists, as its next pair; for "
                             "pairs at other zooms, see with-pair of \"reconstruct\""},
    [CAPTURE_CHECK] = {.name = "static",
                       .kind = COMMAND_FLAG,
                       .help = "take the left image twice and check that the scene has not moved"},
    [CAPTURE_ACCEPT] = {.name = CAPTURE_ACCEPT_NAME,
                        .kind = COMMAND_FLAG,
                        .help =
                            "accept a saved calibration made with other axes, cameras or windows"},
    [CAPTURE_AVERAGE] = {.name = "average",
                         .kind = COMMAND_INTEGER,
                         .min = 2,
                         .max = PAIR_AVERAGE_MAX,
                         .help = "merge this many frames of each camera: less noise"},
    [CAPTURE_BRACKET] =
        {.name = "bracket",
         .kind = COMMAND_INTEGER,
         .min = 2,
         .max = PAIR_BRACKET_MAX,
         .help = "merge this many exposures of each camera, from one for the bright parts to one "
                 "for the dark parts"},
    [CAPTURE_READINGS] = {.name = "readings",
                          .kind = COMMAND_INTEGER,
                          .min = 1,
                          .max = RIG_LENS_READINGS_MAX,
                          .help = "of each lens position before the frames, for their mean; "
                                  "default: 4. 16 take a second for each lens"},
};

const struct command_argument view_arguments[VIEW_ARGUMENTS] = {
    [VIEW_FULL] = {.name = "full",
                   .kind = COMMAND_FLAG,
                   .help = "all pixels, in colour, without marks"},
};

struct pair_options capture_options(const struct command_value *values) {
    static const struct pair_memory memory = {malloc, free};
    const struct command_value *average = &values[CAPTURE_AVERAGE];
    const struct command_value *bracket = &values[CAPTURE_BRACKET];
    return (struct pair_options){
        .check_static = command_is_set(&values[CAPTURE_CHECK]),
        .average = average->given && !bracket->given ? (uint8_t)average->integer : 0,
        .bracket = bracket->given ? (uint8_t)bracket->integer : 0,
        .readings = values[CAPTURE_READINGS].given ? (uint8_t)values[CAPTURE_READINGS].integer : 0,
        .memory = &memory,
    };
}

int view_take(struct rig *rig, const struct command_value *values,
              struct pair_look_frame looks[RIG_SIDES]) {
    const bool full = command_is_set(&values[VIEW_FULL]);
    return pair_look(rig, full ? PAIR_LOOK_WHOLE_PX : VIEW_SIDE_MAX_PX, false, looks);
}

int capture_take(struct rig *rig, const struct pair_options *options, struct pair *pair,
                 struct registers_all *registers) {
    int error = pair_capture(rig, options, pair);
    if (error != ERROR_OK) {
        return error;
    }
    error = registers_read_all(rig, registers);
    if (error != ERROR_OK) {
        pair_release(pair->frame);
        return error;
    }
    for (int side = 0; side < RIG_SIDES; side++) {
        pair_frame_assess(&pair->frame[side]);
    }
    return ERROR_OK;
}
