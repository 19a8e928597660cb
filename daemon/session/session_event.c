// SPDX-License-Identifier: Apache-2.0
#include <inttypes.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#include "core/error.h"
#include "daemon/session/session.h"

#define NO_POSITION "none"

static const char *const kind_names[SESSION_EVENT_KINDS] = {
    "begin", "instrument", "calibration", "setting", "command", "registers", "pair", "end",
};
static const char *const layout_names[] = {"grey", "rgb", "grbg"};
enum { LAYOUTS = sizeof layout_names / sizeof layout_names[0] };
static const char *const side_names[RIG_SIDES] = {"left", "right"};

void session_frame_name(uint32_t crc32, char name[SESSION_NAME_MAX + 1]) {
    snprintf(name, SESSION_NAME_MAX + 1, "frame-%08" PRIx32 ".pnm", crc32);
}

void session_calibration_name(uint32_t crc32, char name[SESSION_NAME_MAX + 1]) {
    snprintf(name, SESSION_NAME_MAX + 1, "calibration-%08" PRIx32 ".txt", crc32);
}

int session_frame_head(const struct pair_frame *frame, char head[SESSION_NAME_MAX + 1]) {
    const char *magic = frame->layout == HAL_CAMERA_RGB ? "P6" : "P5";
    return snprintf(head, SESSION_NAME_MAX + 1, "%s\n%d %d\n%d\n", magic, frame->width_px,
                    frame->height_px, (1 << frame->bits) - 1);
}

uint32_t session_frame_row_values(const struct pair_frame *frame) {
    return frame->layout == HAL_CAMERA_RGB ? 3u * frame->width_px : frame->width_px;
}

unsigned session_frame_value_bytes(const struct pair_frame *frame) {
    return frame->bits <= 8 ? 1 : 2;
}

// ---- printing

/// A line being printed; `length` is negative once something did not fit.
struct line {
    char *text;
    int length;
};

static void put(struct line *line, const char *format, ...) __attribute__((format(printf, 2, 3)));
static void put(struct line *line, const char *format, ...) {
    if (line->length < 0) {
        return;
    }
    const size_t room = (size_t)(SESSION_LINE_MAX + 1 - line->length);
    va_list arguments;
    va_start(arguments, format);
    const int length = vsnprintf(line->text + line->length, room, format, arguments);
    va_end(arguments);
    line->length = length >= 0 && (size_t)length < room ? line->length + length : -1;
}

/// Prints a text as one word: blanks, '%' and anything but printable ASCII as %XX.
static void put_text(struct line *line, const char *key, const char *text) {
    put(line, " %s=", key);
    for (const char *c = text; *c != '\0'; c++) {
        const unsigned char byte = (unsigned char)*c;
        if (byte > ' ' && byte < 0x7f && byte != '%') {
            put(line, "%c", byte);
        } else {
            put(line, "%%%02x", byte);
        }
    }
}

static void put_axes(struct line *line, const char *side, const char *when,
                     const struct pair_axes *axes) {
    put(line, " %s_%s=%" PRIu16, side, when, axes->pan_q4);
    for (int axis = 0; axis < LENS_AXES; axis++) {
        if (axes->position[axis] == INT32_MIN) {
            put(line, "," NO_POSITION);
        } else {
            put(line, ",%" PRId32, axes->position[axis]);
        }
    }
}

static int put_frame(struct line *line, const char *side, const struct pair_frame *frame,
                     uint32_t crc32) {
    if (frame->width_px == 0 || frame->height_px == 0 || frame->bits < 8 || frame->bits > 16 ||
        (unsigned)frame->layout >= LAYOUTS) {
        return ERROR_RANGE;
    }
    put(line, " %s_frame=%08" PRIx32, side, crc32);
    put(line, " %s_size=%dx%d", side, frame->width_px, frame->height_px);
    put(line, " %s_bits=%d", side, frame->bits);
    put(line, " %s_layout=%s", side, layout_names[frame->layout]);
    put(line, " %s_sequence=%" PRIu32, side, frame->sequence);
    put(line, " %s_begin_us=%" PRIu64, side, frame->begin_us);
    put(line, " %s_end_us=%" PRIu64, side, frame->end_us);
    put(line, " %s_exposure_us=%" PRIu32, side, frame->exposure_us);
    put(line, " %s_gain_q3=%" PRIu16, side, frame->gain_q3);
    put_axes(line, side, "before", &frame->before);
    put_axes(line, side, "after", &frame->after);
    if (frame->window.skip != 0) {
        put(line, " %s_window=%" PRIu16 ",%" PRIu16 ",%d", side, frame->window.column_px,
            frame->window.row_px, frame->window.skip);
    }
    if (frame->has_picture) {
        const struct picture_stats *picture = &frame->picture;
        put(line, " %s_picture=%d,%d,%d,%d", side, picture->brightness_permille,
            picture->saturated_permille, picture->black_permille, picture->sharpness_permille);
    }
    return 0;
}

static int put_pair(struct line *line, const struct session_event *event) {
    const struct pair *pair = &event->pair;
    put(line, " number=%" PRIu32, pair->number);
    put(line, " skew_us=%" PRId64, pair->skew_us);
    put(line, " checked=%s", pair->checked ? "yes" : "no");
    put(line, " change_permille=%" PRIu32, pair->change_permille);
    for (int side = 0; side < RIG_SIDES; side++) {
        const int code =
            put_frame(line, side_names[side], &pair->frame[side], event->frame_crc[side]);
        if (code != 0) {
            return code;
        }
    }
    return 0;
}

static int put_registers(struct line *line, const struct session_event *event) {
    if (event->count == 0 || event->count > SESSION_REGISTERS_MAX) {
        return ERROR_RANGE;
    }
    put(line, " at_us=%" PRIu64, event->at_us);
    put_text(line, "part", event->part);
    put(line, " first=%02" PRIx16, event->first);
    put(line, " values=");
    for (int i = 0; i < event->count; i++) {
        put(line, "%s%04" PRIx16, i > 0 ? "," : "", event->values[i]);
    }
    return 0;
}

static void put_instrument(struct line *line, const struct session_instrument *instrument) {
    put_text(line, "left_camera", instrument->camera[RIG_LEFT]);
    put_text(line, "right_camera", instrument->camera[RIG_RIGHT]);
    for (int side = 0; side < RIG_SIDES; side++) {
        put(line, " %s_servo=%" PRIu16 ",%" PRIu32, side_names[side],
            instrument->servo_centre_q4[side], instrument->servo_q4_per_rad[side]);
    }
    put(line, " pan_repeatability_urad=%" PRIu32, instrument->pan_repeatability_urad);
    put(line, " lens_repeatability_counts=%" PRIu32, instrument->lens_repeatability_counts);
    put(line, " lens_zoom_ppm=%" PRIu32, instrument->lens_zoom_ppm);
}

static int put_begin(struct line *line, const struct session_event *event) {
    put(line, " version=%d", event->version);
    put_text(line, "build", event->build);
    put_text(line, "profile", event->profile);
    put_text(line, "date", event->date);
    return event->version >= 1 && event->version <= SESSION_VERSION ? 0 : ERROR_RANGE;
}

/// Length of a finished line, or ERROR_RANGE if something did not fit.
static int length_of(const struct line *line) {
    return line->length < 0 ? ERROR_RANGE : line->length;
}

int session_event_print(const struct session_event *event, char text[SESSION_LINE_MAX + 1]) {
    if ((unsigned)event->kind >= SESSION_EVENT_KINDS) {
        return ERROR_RANGE;
    }
    struct line line = {text, 0};
    put(&line, "%s", kind_names[event->kind]);
    int code = 0;
    switch (event->kind) {
        case SESSION_BEGIN:
            code = put_begin(&line, event);
            break;
        case SESSION_INSTRUMENT:
            put_instrument(&line, &event->instrument);
            break;
        case SESSION_CALIBRATION:
            put(&line, " file=%08" PRIx32, event->crc32);
            break;
        case SESSION_SETTING:
        case SESSION_COMMAND:
            put_text(&line, "text", event->text);
            break;
        case SESSION_REGISTERS:
            code = put_registers(&line, event);
            break;
        case SESSION_PAIR:
            code = put_pair(&line, event);
            break;
        case SESSION_END:
        case SESSION_EVENT_KINDS:
            break;
    }
    return code != 0 ? code : length_of(&line);
}

// ---- parsing: words in a fixed order; anything not canonical is found by printing it again

/// The rest of a line; `wrong` once something did not match.
struct cursor {
    const char *at, *end;
    bool wrong;
};

static bool expect(struct cursor *cursor, const char *word) {
    const size_t length = strlen(word);
    if (cursor->wrong || (size_t)(cursor->end - cursor->at) < length ||
        memcmp(cursor->at, word, length) != 0) {
        cursor->wrong = true;
        return false;
    }
    cursor->at += length;
    return true;
}

static bool expect_key(struct cursor *cursor, const char *side, const char *key) {
    return expect(cursor, " ") &&
           (*side == '\0' || (expect(cursor, side) && expect(cursor, "_"))) &&
           expect(cursor, key) && expect(cursor, "=");
}

static int digit_of(char c) {
    return c >= '0' && c <= '9' ? c - '0' : c >= 'a' && c <= 'f' ? c - 'a' + 10 : 16;
}

static uint64_t take_number(struct cursor *cursor, unsigned base, uint64_t max) {
    uint64_t value = 0;
    const char *const begin = cursor->at;
    while (!cursor->wrong && cursor->at < cursor->end) {
        const unsigned digit = (unsigned)digit_of(*cursor->at);
        if (digit >= base) {
            break;
        }
        if (value > (max - digit) / base) {
            cursor->wrong = true;
            break;
        }
        value = value * base + digit;
        cursor->at++;
    }
    cursor->wrong |= cursor->at == begin;
    return cursor->wrong ? 0 : value;
}

static int64_t take_signed(struct cursor *cursor, int64_t max) {
    if (!cursor->wrong && cursor->at < cursor->end && *cursor->at == '-') {
        cursor->at++;
        return -(int64_t)take_number(cursor, 10, (uint64_t)max);
    }
    return (int64_t)take_number(cursor, 10, (uint64_t)max);
}

static uint64_t take_key(struct cursor *cursor, const char *side, const char *key, unsigned base,
                         uint64_t max) {
    return expect_key(cursor, side, key) ? take_number(cursor, base, max) : 0;
}

static void take_text(struct cursor *cursor, const char *key, char *text, size_t max) {
    size_t length = 0;
    if (!expect_key(cursor, "", key)) {
        return;
    }
    while (cursor->at < cursor->end && *cursor->at != ' ') {
        int byte = (unsigned char)*cursor->at++;
        if (byte == '%') {
            if (cursor->end - cursor->at < 2) {
                cursor->wrong = true;
                return;
            }
            byte = digit_of(cursor->at[0]) * 16 + digit_of(cursor->at[1]);
            cursor->at += 2;
        }
        if (byte <= 0 || byte > 255 || length == max) {
            cursor->wrong = true;
            return;
        }
        text[length++] = (char)byte;
    }
    text[length] = '\0';
}

static int take_choice(struct cursor *cursor, const char *const *names, int count) {
    const char *end = cursor->at;
    while (end < cursor->end && *end != ' ') {
        end++;
    }
    const size_t length = (size_t)(end - cursor->at);
    for (int i = 0; !cursor->wrong && i < count; i++) {
        if (strlen(names[i]) == length && memcmp(names[i], cursor->at, length) == 0) {
            cursor->at = end;
            return i;
        }
    }
    cursor->wrong = true;
    return 0;
}

static void take_axes(struct cursor *cursor, const char *side, const char *when,
                      struct pair_axes *axes) {
    axes->pan_q4 = (uint16_t)take_key(cursor, side, when, 10, UINT16_MAX);
    for (int axis = 0; axis < LENS_AXES; axis++) {
        expect(cursor, ",");
        if (!cursor->wrong && cursor->at < cursor->end && *cursor->at == 'n') {
            expect(cursor, NO_POSITION);
            axes->position[axis] = INT32_MIN;
        } else {
            axes->position[axis] = (int32_t)take_signed(cursor, INT32_MAX);
        }
    }
}

/// Whether this key comes next, for optional keys of a frame.
static bool has_key(const struct cursor *cursor, const char *side, const char *key) {
    struct cursor ahead = *cursor;
    return expect_key(&ahead, side, key);
}

/// Only if it was known; sessions of cameras with separate ports have no window.
static void take_window(struct cursor *cursor, const char *side, struct pair_window *window) {
    if (!has_key(cursor, side, "window")) {
        return;
    }
    window->column_px = (uint16_t)take_key(cursor, side, "window", 10, UINT16_MAX);
    expect(cursor, ",");
    window->row_px = (uint16_t)take_number(cursor, 10, UINT16_MAX);
    expect(cursor, ",");
    window->skip = (uint8_t)take_number(cursor, 10, UINT8_MAX);
}

/// Absent in sessions of version 1.
static void take_picture(struct cursor *cursor, const char *side, struct pair_frame *frame) {
    uint16_t *const shares[] = {&frame->picture.brightness_permille,
                                &frame->picture.saturated_permille, &frame->picture.black_permille,
                                &frame->picture.sharpness_permille};
    frame->has_picture = has_key(cursor, side, "picture") && expect_key(cursor, side, "picture");
    for (size_t i = 0; frame->has_picture && i < sizeof shares / sizeof shares[0]; i++) {
        if (i > 0) {
            expect(cursor, ",");
        }
        *shares[i] = (uint16_t)take_number(cursor, 10, PICTURE_STATS_MAX_PERMILLE);
    }
}

static void take_frame(struct cursor *cursor, const char *side, struct pair_frame *frame,
                       uint32_t *crc32) {
    *crc32 = (uint32_t)take_key(cursor, side, "frame", 16, UINT32_MAX);
    frame->width_px = (uint16_t)take_key(cursor, side, "size", 10, UINT16_MAX);
    expect(cursor, "x");
    frame->height_px = (uint16_t)take_number(cursor, 10, UINT16_MAX);
    frame->bits = (uint8_t)take_key(cursor, side, "bits", 10, UINT8_MAX);
    expect_key(cursor, side, "layout");
    frame->layout = (enum hal_camera_layout)take_choice(cursor, layout_names, LAYOUTS);
    frame->sequence = (uint32_t)take_key(cursor, side, "sequence", 10, UINT32_MAX);
    frame->begin_us = take_key(cursor, side, "begin_us", 10, UINT64_MAX);
    frame->end_us = take_key(cursor, side, "end_us", 10, UINT64_MAX);
    frame->exposure_us = (uint32_t)take_key(cursor, side, "exposure_us", 10, UINT32_MAX);
    frame->gain_q3 = (uint16_t)take_key(cursor, side, "gain_q3", 10, UINT16_MAX);
    take_axes(cursor, side, "before", &frame->before);
    take_axes(cursor, side, "after", &frame->after);
    take_window(cursor, side, &frame->window);
    take_picture(cursor, side, frame);
    frame->stride = session_frame_row_values(frame);
}

static void take_pair(struct cursor *cursor, struct session_event *event) {
    static const char *const answers[] = {"no", "yes"};
    struct pair *pair = &event->pair;
    pair->number = (uint32_t)take_key(cursor, "", "number", 10, UINT32_MAX);
    expect_key(cursor, "", "skew_us");
    pair->skew_us = take_signed(cursor, INT64_MAX);
    expect_key(cursor, "", "checked");
    pair->checked = take_choice(cursor, answers, 2) == 1;
    pair->change_permille = (uint32_t)take_key(cursor, "", "change_permille", 10, UINT32_MAX);
    for (int side = 0; side < RIG_SIDES; side++) {
        take_frame(cursor, side_names[side], &pair->frame[side], &event->frame_crc[side]);
    }
}

static void take_registers(struct cursor *cursor, struct session_event *event) {
    event->at_us = take_key(cursor, "", "at_us", 10, UINT64_MAX);
    take_text(cursor, "part", event->part, SESSION_NAME_MAX);
    event->first = (uint16_t)take_key(cursor, "", "first", 16, UINT16_MAX);
    event->values[0] = (uint16_t)take_key(cursor, "", "values", 16, UINT16_MAX);
    event->count = 1;
    while (!cursor->wrong && cursor->at < cursor->end && expect(cursor, ",")) {
        if (event->count == SESSION_REGISTERS_MAX) {
            cursor->wrong = true;
            return;
        }
        event->values[event->count++] = (uint16_t)take_number(cursor, 16, UINT16_MAX);
    }
}

static void take_instrument(struct cursor *cursor, struct session_instrument *instrument) {
    take_text(cursor, "left_camera", instrument->camera[RIG_LEFT], SESSION_NAME_MAX);
    take_text(cursor, "right_camera", instrument->camera[RIG_RIGHT], SESSION_NAME_MAX);
    for (int side = 0; side < RIG_SIDES; side++) {
        instrument->servo_centre_q4[side] =
            (uint16_t)take_key(cursor, side_names[side], "servo", 10, UINT16_MAX);
        expect(cursor, ",");
        instrument->servo_q4_per_rad[side] = (uint32_t)take_number(cursor, 10, UINT32_MAX);
    }
    instrument->pan_repeatability_urad =
        (uint32_t)take_key(cursor, "", "pan_repeatability_urad", 10, UINT32_MAX);
    instrument->lens_repeatability_counts =
        (uint32_t)take_key(cursor, "", "lens_repeatability_counts", 10, UINT32_MAX);
    instrument->lens_zoom_ppm = (uint32_t)take_key(cursor, "", "lens_zoom_ppm", 10, UINT32_MAX);
}

static void take_event(struct cursor *cursor, struct session_event *event) {
    event->kind = (enum session_event_kind)take_choice(cursor, kind_names, SESSION_EVENT_KINDS);
    switch (event->kind) {
        case SESSION_BEGIN:
            event->version = (uint8_t)take_key(cursor, "", "version", 10, SESSION_VERSION);
            take_text(cursor, "build", event->build, SESSION_NAME_MAX);
            take_text(cursor, "profile", event->profile, SESSION_NAME_MAX);
            take_text(cursor, "date", event->date, SESSION_NAME_MAX);
            break;
        case SESSION_INSTRUMENT:
            take_instrument(cursor, &event->instrument);
            break;
        case SESSION_CALIBRATION:
            event->crc32 = (uint32_t)take_key(cursor, "", "file", 16, UINT32_MAX);
            break;
        case SESSION_SETTING:
        case SESSION_COMMAND:
            take_text(cursor, "text", event->text, SESSION_TEXT_MAX);
            break;
        case SESSION_REGISTERS:
            take_registers(cursor, event);
            break;
        case SESSION_PAIR:
            take_pair(cursor, event);
            break;
        case SESSION_END:
        case SESSION_EVENT_KINDS:
            break;
    }
}

int session_event_parse(const char *text, size_t length, struct session_event *event) {
    memset(event, 0, sizeof *event);
    struct cursor cursor = {text, text + length, false};
    take_event(&cursor, event);
    if (cursor.wrong || cursor.at != cursor.end) {
        return ERROR_SYNTAX;
    }
    char again[SESSION_LINE_MAX + 1];
    const int printed = session_event_print(event, again);
    const bool same = printed >= 0 && (size_t)printed == length && memcmp(again, text, length) == 0;
    return same ? 0 : ERROR_SYNTAX;
}
