// SPDX-License-Identifier: Apache-2.0
#include "daemon/session/capture_info.h"

#include <inttypes.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#include "console/pair/calibration_match.h"
#include "core/invariant.h"
#include "device/lens_driver.h"

static const double q3 = 8, q4 = 16, permille_a_percent = 10;

// ---- lines

static void add(char text[CAPTURE_INFO_BYTES], const char *format, ...)
    __attribute__((format(printf, 2, 3)));
static void add(char text[CAPTURE_INFO_BYTES], const char *format, ...) {
    const size_t length = strlen(text);
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(text + length, CAPTURE_INFO_BYTES - length, format, arguments);
    va_end(arguments);
}

static void add_pair(const struct capture_info *info, char text[CAPTURE_INFO_BYTES]) {
    const struct pair *pair = info->pair;
    add(text, "%.300s pair %" PRIu32 ": skew %" PRId64 " us", info->session, pair->number,
        pair->skew_us);
    if (pair->checked) {
        add(text, ", static scene (%.1f %% changed)", pair->change_permille / permille_a_percent);
    }
    // A directory name may contain a line feed, which would end the comment.
    for (char *at = text; *at != '\0'; at++) {
        *at = (unsigned char)*at < ' ' || *at == 0x7F ? '?' : *at;
    }
}

static void add_pan(const struct capture_info *info, int side, char text[CAPTURE_INFO_BYTES]) {
    const int pulse_q4 = info->pair->frame[side].before.pan_q4;
    double deg = 0;
    if (pulse_q4 == 0) {
        return;
    }
    if (info->instrument != NULL &&
        calibration_match_pan_deg(info->instrument, side, pulse_q4, &deg)) {
        add(text, ", pan %.3f deg", deg);
    } else {
        add(text, ", pan %.4f us", pulse_q4 / q4);
    }
}

static void add_frame(const struct capture_info *info, int side, char text[CAPTURE_INFO_BYTES]) {
    const struct pair_frame *frame = &info->pair->frame[side];
    add(text, "%s: sequence %" PRIu32, rig_side_names[side], frame->sequence);
    if (frame->exposure_us != 0) {
        add(text, ", exposure %" PRIu32 " us", frame->exposure_us);
    }
    if (frame->gain_q3 != 0) {
        add(text, ", gain %.3f", frame->gain_q3 / q3);
    }
    for (int i = 0; i < frame->parts; i++) {
        const struct pair_part *part = &frame->part[i];
        add(text, "%s%u x %" PRIu32 " us", i == 0 ? ", merged from " : " + ",
            (unsigned)part->frames, part->exposure_us);
    }
    add_pan(info, side, text);
    for (int axis = 0; axis < LENS_AXES; axis++) {
        if (frame->before.lens[axis].position_q4 != INT32_MIN) {
            add(text, ", %s %.2f", lens_axis_names[axis],
                frame->before.lens[axis].position_q4 / q4);
        }
    }
}

void capture_info_line(const struct capture_info *info, int line, char text[CAPTURE_INFO_BYTES]) {
    INVARIANT(info->session != NULL && info->pair != NULL);
    INVARIANT(line >= 0 && line < CAPTURE_INFO_LINES);
    text[0] = '\0';
    if (line == 0) {
        add_pair(info, text);
    } else {
        add_frame(info, line - 1, text);
    }
}

// ---- JSON

/// 0 means unknown.
static void put_known(struct json *json, const char *name, double value) {
    if (value > 0) {
        json_real(json, name, value, 10);
    } else {
        json_null(json, name);
    }
}

/// Null if it is one frame.
static void put_parts(struct json *json, const struct pair_frame *frame) {
    if (frame->parts == 0) {
        json_null(json, "merged");
        return;
    }
    json_open_array(json, "merged");
    for (int i = 0; i < frame->parts; i++) {
        const struct pair_part *part = &frame->part[i];
        json_open_object(json, NULL);
        put_known(json, "exposure_us", part->exposure_us);
        put_known(json, "gain", part->gain_q3 / q3);
        json_integer(json, "frames", part->frames);
        json_close_object(json);
    }
    json_close_array(json);
}

static void put_frame(struct json *json, const struct pair_frame *frame, const char *side) {
    const struct pair_axes *before = &frame->before, *after = &frame->after;
    json_open_object(json, side);
    json_integer(json, "sequence", frame->sequence);
    json_integer(json, "begin_us", (int64_t)frame->begin_us);
    json_integer(json, "end_us", (int64_t)frame->end_us);
    put_known(json, "exposure_us", frame->exposure_us);
    put_known(json, "gain", frame->gain_q3 / q3);
    put_parts(json, frame);
    if (before->pan_q4 != 0) {
        json_reals(json, "pan_us", (const double[]){before->pan_q4 / q4, after->pan_q4 / q4}, 2,
                   10);
    } else {
        json_null(json, "pan_us");
    }
    for (int axis = 0; axis < LENS_AXES; axis++) {
        if (before->lens[axis].position_q4 != INT32_MIN) {
            json_reals(json, lens_axis_names[axis],
                       (const double[]){before->lens[axis].position_q4 / q4,
                                        after->lens[axis].position_q4 / q4},
                       2, 10);
        } else {
            json_null(json, lens_axis_names[axis]);
        }
    }
    json_close_object(json);
}

void capture_info_json(const struct capture_info *info, struct json *json) {
    if (info->session == NULL) {
        json_null(json, "capture");
        return;
    }
    const struct pair *pair = info->pair;
    INVARIANT(pair != NULL);
    json_open_object(json, "capture");
    json_text(json, "session", info->session);
    json_integer(json, "pair", pair->number);
    json_integer(json, "skew_us", pair->skew_us);
    json_bool(json, "static_checked", pair->checked);
    if (pair->checked) {
        json_real(json, "changed_percent", pair->change_permille / permille_a_percent, 6);
    } else {
        json_null(json, "changed_percent");
    }
    for (int side = 0; side < RIG_SIDES; side++) {
        put_frame(json, &pair->frame[side], rig_side_names[side]);
    }
    json_close_object(json);
}
