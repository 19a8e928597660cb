// SPDX-License-Identifier: Apache-2.0
#include "console/pair/capture.h"

#include "core/error.h"
#include "core/invariant.h"

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

struct pair_options capture_options(const struct command_value *values,
                                    const struct pair_memory *memory) {
    const struct command_value *average = &values[CAPTURE_AVERAGE];
    const struct command_value *bracket = &values[CAPTURE_BRACKET];
    return (struct pair_options){
        .check_static = command_is_set(&values[CAPTURE_CHECK]),
        .average = average->given && !bracket->given ? (uint8_t)average->integer : 0,
        .bracket = bracket->given ? (uint8_t)bracket->integer : 0,
        .readings = values[CAPTURE_READINGS].given ? (uint8_t)values[CAPTURE_READINGS].integer : 0,
        .memory = memory,
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

// ---- the answer

static void put_picture(const struct command_call *call, const struct pair_frame *frame) {
    const struct picture_stats *picture = &frame->picture;
    INVARIANT(frame->has_picture);
    reply_number(call, "brightness", picture->brightness_permille / 10.0, 1, "%");
    reply_number(call, "saturated", picture->saturated_permille / 10.0, 1, "%");
    reply_number(call, "black", picture->black_permille / 10.0, 1, "%");
    reply_number(call, "sharpness", picture->sharpness_permille / 10.0, 1, "%");
}

/// What a frame was merged from.
static void put_parts(const struct command_call *call, const struct pair_frame *frame) {
    if (frame->parts == 0) {
        return;
    }
    reply_group_begin(call, "merged", true);
    for (int i = 0; i < frame->parts; i++) {
        const struct pair_part *part = &frame->part[i];
        reply_group_begin(call, NULL, false);
        reply_number(call, "frames", part->frames, 0, NULL);
        if (part->exposure_us != 0) {
            reply_number(call, "exposure", part->exposure_us, 0, "us");
        }
        if (part->gain_q3 != 0) {
            reply_number(call, "gain", part->gain_q3 / 8.0, 3, NULL);
        }
        reply_group_end(call);
    }
    reply_group_end(call);
}

void capture_reply(const struct command_call *call, const struct pair *pair) {
    reply_number(call, "pair", pair->number, 0, NULL);
    reply_number(call, "skew", (double)pair->skew_us, 0, "us");
    if (pair->checked) {
        reply_number(call, "change", pair->change_permille / 10.0, 1, "%");
    }
    for (int side = 0; side < RIG_SIDES; side++) {
        const struct pair_frame *frame = &pair->frame[side];
        reply_group_begin(call, rig_side_names[side], false);
        reply_number(call, "width", frame->image.width_px, 0, "px");
        reply_number(call, "height", frame->image.height_px, 0, "px");
        reply_number(call, "sequence", frame->sequence, 0, NULL);
        // 0: not set since bring-up, so the camera decides.
        if (frame->exposure_us != 0) {
            reply_number(call, "exposure", frame->exposure_us, 0, "us");
        }
        if (frame->gain_q3 != 0) {
            reply_number(call, "gain", frame->gain_q3 / 8.0, 3, NULL);
        }
        put_parts(call, frame);
        put_picture(call, frame);
        reply_group_end(call);
    }
}
