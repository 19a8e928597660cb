// SPDX-License-Identifier: Apache-2.0
// What `capture` replies about a pair.
#include "daemon/commands/commands.h"

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

void pair_reply_put(const struct command_call *call, const struct captured_pair *captured) {
    const struct pair *pair = &captured->pair;
    if (captured->in_session) {
        reply_text(call, "session", captured->name);
    }
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
