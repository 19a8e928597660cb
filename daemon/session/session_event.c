// SPDX-License-Identifier: Apache-2.0
#include <inttypes.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#include "core/error.h"
#include "core/invariant.h"
#include "daemon/session/session.h"
#include "daemon/session/trace.h"

#define NO_POSITION "none"

void session_frame_name(uint32_t crc32, char name[SESSION_NAME_MAX + 1]) {
    snprintf(name, SESSION_NAME_MAX + 1, "frame-%08" PRIx32 ".pnm", crc32);
}

void session_calibration_name(uint32_t crc32, char name[SESSION_NAME_MAX + 1]) {
    snprintf(name, SESSION_NAME_MAX + 1, "calibration-%08" PRIx32 ".txt", crc32);
}

void session_zoom_calibration_name(uint32_t crc32, char name[SESSION_NAME_MAX + 1]) {
    snprintf(name, SESSION_NAME_MAX + 1, "zoom-%08" PRIx32 ".txt", crc32);
}

int session_frame_head(const struct raw_image *image, char head[SESSION_NAME_MAX + 1]) {
    const char *magic = image->layout == RAW_RGB ? "P6" : "P5";
    return snprintf(head, SESSION_NAME_MAX + 1, "%s\n%d %d\n%d\n", magic, image->width_px,
                    image->height_px, (1 << image->bits) - 1);
}

unsigned session_frame_value_bytes(const struct raw_image *image) {
    return image->bits <= 8 ? 1 : 2;
}

// ---- the fields of each event

enum field_type {
    TEXT,      // text of up to `bytes` - 1 characters
    NUMBER,    // `min` .. `max`
    SIGNED,    // -`max` .. `max`
    POSITION,  // a struct lens_mean: -`max` .. `max`
    HEX,       // `min` digits at least
    CHOICE,    // one of `choices`, `max` is the last
    FRAME,     // the fields of a frame, with `key` before each key
    VALUES,    // register values
    PARTS,     // exposures that a frame was merged from
};

/// One value of a line: a member of an event, or of a frame.
struct field {
    const char *key;  // NULL: a further value of the last key, after `separator`
    const char *separator;
    enum field_type type;
    size_t offset, bytes;
    uint64_t min, max;
    const char *const *choices;
    size_t present;  // member that is 0 if the key is not there; 0: it always is
};

#define OF(type, member) offsetof(struct type, member), sizeof(((struct type *)0)->member)
#define EVENT(key, type, member, min, max) \
    { key, NULL, type, OF(session_event, member), min, max, NULL, 0 }
#define KEY(key, type, member, min, max) \
    { key, NULL, type, OF(pair_frame, member), min, max, NULL, 0 }
#define NEXT(separator, type, member, min, max) \
    { NULL, separator, type, OF(pair_frame, member), min, max, NULL, 0 }
#define U32(key, member) EVENT(key, NUMBER, member, 0, UINT32_MAX)
#define SERVO(key, side)                                                                        \
    EVENT(key, NUMBER, instrument.servo_centre_q4[side], 0, UINT16_MAX), {                      \
        NULL, ",", NUMBER, OF(session_event, instrument.servo_q4_per_rad[side]), 0, UINT32_MAX, \
            NULL, 0                                                                             \
    }
#define AXES(key, member)                                       \
    KEY(key, NUMBER, member.pan_q4, 0, UINT16_MAX),             \
        NEXT(",", POSITION, member.lens[0], 0, INT32_MAX / 16), \
        NEXT(",", POSITION, member.lens[1], 0, INT32_MAX / 16), \
        NEXT(",", POSITION, member.lens[2], 0, INT32_MAX / 16)

static const char *const layouts[] = {"grey", "rgb", "grbg"};
static const char *const answers[] = {"no", "yes"};

static const struct field frame_fields[] = {
    KEY("size", NUMBER, image.width_px, 1, UINT16_MAX),
    NEXT("x", NUMBER, image.height_px, 1, UINT16_MAX),
    KEY("bits", NUMBER, image.bits, 8, 16),
    {"layout", NULL, CHOICE, OF(pair_frame, image.layout), 0, 2, layouts, 0},
    KEY("sequence", NUMBER, sequence, 0, UINT32_MAX),
    KEY("begin_us", NUMBER, begin_us, 0, UINT64_MAX),
    KEY("end_us", NUMBER, end_us, 0, UINT64_MAX),
    KEY("exposure_us", NUMBER, exposure_us, 0, UINT32_MAX),
    KEY("gain_q3", NUMBER, gain_q3, 0, UINT16_MAX),
    AXES("before", before),
    AXES("after", after),
    // Cameras with ports of their own have no window, and version 1 has no statistics.
    {"window", NULL, NUMBER, OF(pair_frame, window.column_px), 0, UINT16_MAX, NULL,
     offsetof(struct pair_frame, window.skip)},
    NEXT(",", NUMBER, window.row_px, 0, UINT16_MAX),
    NEXT(",", NUMBER, window.skip, 1, UINT8_MAX),
    {"picture", NULL, NUMBER, OF(pair_frame, picture.brightness_permille), 0, 1000, NULL,
     offsetof(struct pair_frame, has_picture)},
    NEXT(",", NUMBER, picture.saturated_permille, 0, 1000),
    NEXT(",", NUMBER, picture.black_permille, 0, 1000),
    NEXT(",", NUMBER, picture.sharpness_permille, 0, 1000),
    {"merged", NULL, PARTS, OF(pair_frame, part), 0, 0, NULL, offsetof(struct pair_frame, parts)},
    {.key = NULL}};

static const struct field begin_fields[] = {EVENT("version", NUMBER, version, 1, SESSION_VERSION),
                                            EVENT("build", TEXT, build, 0, 0),
                                            EVENT("profile", TEXT, profile, 0, 0),
                                            EVENT("date", TEXT, date, 0, 0),
                                            {.key = NULL}};

static const struct field instrument_fields[] = {
    EVENT("left_camera", TEXT, instrument.camera[RIG_LEFT], 0, 0),
    EVENT("right_camera", TEXT, instrument.camera[RIG_RIGHT], 0, 0),
    SERVO("left_servo", RIG_LEFT),
    SERVO("right_servo", RIG_RIGHT),
    U32("pan_repeatability_urad", instrument.pan_repeatability_urad),
    U32("lens_repeatability_counts", instrument.lens_repeatability_counts),
    U32("lens_zoom_ppm", instrument.lens_zoom_ppm),
    {.key = NULL}};

static const struct field calibration_fields[] = {
    EVENT("file", HEX, crc32, SESSION_CRC_DIGITS, UINT32_MAX), {.key = NULL}};

static const struct field text_fields[] = {EVENT("text", TEXT, text, 0, 0), {.key = NULL}};

static const struct field registers_fields[] = {EVENT("at_us", NUMBER, at_us, 0, UINT64_MAX),
                                                EVENT("part", TEXT, part, 0, 0),
                                                EVENT("first", HEX, first, 2, UINT16_MAX),
                                                EVENT("values", VALUES, values, 0, 0),
                                                {.key = NULL}};

static const struct field pair_fields[] = {
    U32("number", pair.number),
    EVENT("skew_us", SIGNED, pair.skew_us, 0, INT64_MAX),
    {"checked", NULL, CHOICE, OF(session_event, pair.checked), 0, 1, answers, 0},
    U32("change_permille", pair.change_permille),
    EVENT("left_frame", HEX, frame_crc[RIG_LEFT], SESSION_CRC_DIGITS, UINT32_MAX),
    EVENT("left_", FRAME, pair.frame[RIG_LEFT], 0, 0),
    EVENT("right_frame", HEX, frame_crc[RIG_RIGHT], SESSION_CRC_DIGITS, UINT32_MAX),
    EVENT("right_", FRAME, pair.frame[RIG_RIGHT], 0, 0),
    {.key = NULL}};

static const struct field end_fields[] = {{.key = NULL}};

static const struct {
    const char *name;
    const struct field *fields;
} kinds[SESSION_EVENT_KINDS] = {
    [SESSION_BEGIN] = {"begin", begin_fields},
    [SESSION_INSTRUMENT] = {"instrument", instrument_fields},
    [SESSION_CALIBRATION] = {"calibration", calibration_fields},
    [SESSION_ZOOM_CALIBRATION] = {"zoom_calibration", calibration_fields},
    [SESSION_SETTING] = {"setting", text_fields},
    [SESSION_COMMAND] = {"command", text_fields},
    [SESSION_REGISTERS] = {"registers", registers_fields},
    [SESSION_PAIR] = {"pair", pair_fields},
    [SESSION_END] = {"end", end_fields},
};

// ---- a line, printed or parsed by the same functions. Texts that would be printed differently are
// found by printing the parsed event again.

struct line {
    bool parses;
    bool wrong;            // something did not fit, or did not match
    char *text;            // printed so far
    const char *at, *end;  // still to be parsed
};

static void append_text(struct line *line, const char *format, ...)
    __attribute__((format(printf, 2, 3)));
static void append_text(struct line *line, const char *format, ...) {
    const size_t length = strlen(line->text), room = SESSION_LINE_MAX + 1 - length;
    va_list arguments;
    va_start(arguments, format);
    const int more = vsnprintf(line->text + length, room, format, arguments);
    va_end(arguments);
    line->wrong |= more < 0 || (size_t)more >= room;
}

/// Moves behind `word` if it comes next.
static bool skip_word(struct line *line, const char *word) {
    const size_t length = strlen(word);
    const bool there = !line->wrong && (size_t)(line->end - line->at) >= length &&
                       memcmp(line->at, word, length) == 0;
    line->at += there ? length : 0;
    return there;
}

static uint64_t take_number(struct line *line, unsigned base, uint64_t max) {
    uint64_t value = 0;
    const char *const begin = line->at;
    while (!line->wrong && line->at < line->end && trace_digit(*line->at) < (int)base) {
        const unsigned digit = (unsigned)trace_digit(*line->at++);
        line->wrong = digit > max || value > (max - digit) / base;
        value = value * base + digit;
    }
    line->wrong |= line->at == begin;
    return value;
}

/// A text is one word: blanks, '%' and anything but printable ASCII are %XX.
static void put_text(struct line *line, const char *text) {
    for (; *text != '\0'; text++) {
        const unsigned char byte = (unsigned char)*text;
        append_text(line, byte > ' ' && byte < 0x7f && byte != '%' ? "%c" : "%%%02x", byte);
    }
}

static void take_text(struct line *line, char *text, size_t bytes) {
    for (size_t length = 0; line->at < line->end && *line->at != ' ' && !line->wrong; length++) {
        int byte = (unsigned char)*line->at++;
        if (byte == '%' && line->end - line->at >= 2) {
            byte = trace_digit(line->at[0]) * 16 + trace_digit(line->at[1]);
            line->at += 2;
        }
        line->wrong = byte <= 0 || byte > 255 || length == bytes - 1;
        text[length] = line->wrong ? '\0' : (char)byte;
    }
}

static void walk_values(struct line *line, struct session_event *event) {
    if (line->parses) {
        do {
            event->values[event->count++] = (uint16_t)take_number(line, 16, UINT16_MAX);
        } while (event->count < SESSION_REGISTERS_MAX && skip_word(line, ","));
        return;
    }
    line->wrong |= event->count == 0 || event->count > SESSION_REGISTERS_MAX;
    for (int i = 0; i < event->count && !line->wrong; i++) {
        append_text(line, "%s%04" PRIx16, i > 0 ? "," : "", event->values[i]);
    }
}

/// EXPOSURE:GAIN:FRAMES of each part.
static void walk_parts(struct line *line, struct pair_frame *frame) {
    if (!line->parses) {
        line->wrong |= frame->parts > PAIR_PARTS_MAX;
        for (int i = 0; i < frame->parts && !line->wrong; i++) {
            const struct pair_part *part = &frame->part[i];
            line->wrong = part->frames == 0;
            append_text(line, "%s%" PRIu32 ":%" PRIu16 ":%" PRIu16, i > 0 ? "," : "",
                        part->exposure_us, part->gain_q3, part->frames);
        }
        return;
    }
    frame->parts = 0;
    do {
        struct pair_part *part = &frame->part[frame->parts++];
        part->exposure_us = (uint32_t)take_number(line, 10, UINT32_MAX);
        line->wrong |= !skip_word(line, ":");
        part->gain_q3 = (uint16_t)take_number(line, 10, UINT16_MAX);
        line->wrong |= !skip_word(line, ":");
        part->frames = (uint16_t)take_number(line, 10, UINT16_MAX);
        line->wrong |= part->frames == 0;
    } while (frame->parts < PAIR_PARTS_MAX && skip_word(line, ","));
}

static bool has_sign(const struct field *field) {
    return field->type == SIGNED || field->type == POSITION;
}

/// "4805:8" is a position in 1/16 count with its standard error; up to version 4, "300" is one in
/// counts, whose error is not known.
static void put_position(struct line *line, const struct lens_mean *mean) {
    if (mean->position_q4 == INT32_MIN) {
        append_text(line, NO_POSITION);
    } else if (mean->sigma_q4 > 0) {
        append_text(line, "%" PRId32 ":%" PRIu16, mean->position_q4, mean->sigma_q4);
    } else {
        line->wrong |= mean->position_q4 % 16 != 0;
        append_text(line, "%" PRId32, mean->position_q4 / 16);
    }
}

static void put_number(struct line *line, const struct field *field, uint64_t value) {
    const bool bounded = field->type == NUMBER || field->type == CHOICE;
    if (bounded && (value < field->min || value > field->max)) {
        line->wrong = true;
    } else if (field->type == CHOICE) {
        append_text(line, "%s", field->choices[value]);
    } else if (field->type == HEX) {
        append_text(line, "%0*" PRIx64, (int)field->min, value);
    } else if (has_sign(field)) {
        append_text(line, "%" PRId64, (int64_t)value);
    } else {
        append_text(line, "%" PRIu64, value);
    }
}

static uint64_t parse_number(struct line *line, const struct field *field) {
    for (uint64_t i = 0; field->type == CHOICE && i <= field->max; i++) {
        if (skip_word(line, field->choices[i])) {
            return i;
        }
    }
    const bool negative = has_sign(field) && skip_word(line, "-");
    const uint64_t value = take_number(line, field->type == HEX ? 16 : 10, field->max);
    return negative ? -value : value;
}

static void parse_position(struct line *line, const struct field *field, struct lens_mean *mean) {
    *mean = (struct lens_mean){INT32_MIN, 0};
    if (skip_word(line, NO_POSITION)) {
        return;
    }
    const int32_t number = (int32_t)parse_number(line, field);
    if (skip_word(line, ":")) {
        *mean = (struct lens_mean){number, (uint16_t)take_number(line, 10, UINT16_MAX)};
    } else {
        // Counts of older versions.
        enum { COUNTS_MAX = INT32_MAX / 16 };
        line->wrong |= number > COUNTS_MAX || number < -COUNTS_MAX;
        *mean = (struct lens_mean){line->wrong ? INT32_MIN : number * 16, 0};
    }
}

static uint64_t load(const struct field *field, const char *at) {
    const uint16_t *const u16 = (const void *)at;
    const uint32_t *const u32 = (const void *)at;
    const uint64_t *const u64 = (const void *)at;
    INVARIANT(field->bytes == 1 || field->bytes == 2 || field->bytes == 4 || field->bytes == 8);
    switch (field->bytes) {
        case 1:
            return (uint8_t)*at;
        case 2:
            return *u16;
        case 8:
            return *u64;
        default:
            return has_sign(field) ? (uint64_t)(int32_t)*u32 : *u32;
    }
}

static void store(const struct field *field, char *at, uint64_t value) {
    const uint8_t u8 = (uint8_t)value;
    const uint16_t u16 = (uint16_t)value;
    const uint32_t u32 = (uint32_t)value;
    const void *stored = &value;
    if (field->bytes == 1) {
        stored = &u8;
    } else if (field->bytes == 2) {
        stored = &u16;
    } else if (field->bytes == 4) {
        stored = &u32;
    }
    memcpy(at, stored, field->bytes);
}

static void walk_value(struct line *line, const struct field *field, char *base) {
    char *const member = base + field->offset;
    if (field->type == TEXT && line->parses) {
        take_text(line, member, field->bytes);
    } else if (field->type == TEXT) {
        put_text(line, member);
    } else if (field->type == VALUES) {
        walk_values(line, (struct session_event *)(void *)base);
    } else if (field->type == PARTS) {
        walk_parts(line, (struct pair_frame *)(void *)base);
    } else if (field->type == POSITION && line->parses) {
        parse_position(line, field, (struct lens_mean *)(void *)member);
    } else if (field->type == POSITION) {
        put_position(line, (const struct lens_mean *)(const void *)member);
    } else if (line->parses) {
        store(field, member, parse_number(line, field));
    } else {
        put_number(line, field, load(field, member));
    }
}

/// The word before a value: its key or separator. False: the key is optional and not there, so
/// neither are its values.
static bool walk_key(struct line *line, const struct field *field, const char *prefix, char *base) {
    const bool optional = field->present != 0;
    char word[SESSION_NAME_MAX];
    if (field->key != NULL) {
        snprintf(word, sizeof word, " %s%s=", prefix, field->key);
    } else {
        snprintf(word, sizeof word, "%s", field->separator);
    }
    if (!line->parses && optional && base[field->present] == 0) {
        return false;
    }
    if (!line->parses) {
        append_text(line, "%s", word);
        return true;
    }
    const bool there = skip_word(line, word);
    line->wrong |= !there && !optional;
    if (there && optional) {
        base[field->present] = 1;
    }
    return there;
}

static void walk(struct line *line, const struct field *field, const char *prefix, char *base) {
    bool present = true;
    for (; (field->key != NULL || field->separator != NULL) && !line->wrong; field++) {
        if (field->type == FRAME) {
            walk(line, frame_fields, field->key, base + field->offset);
            continue;
        }
        if (field->key != NULL || present) {
            present = walk_key(line, field, prefix, base);
        }
        if (present) {
            walk_value(line, field, base);
        }
    }
}

int session_event_print(const struct session_event *event, char text[SESSION_LINE_MAX + 1]) {
    if ((unsigned)event->kind >= SESSION_EVENT_KINDS) {
        return ERROR_RANGE;
    }
    struct session_event copy = *event;
    struct line line = {.text = text};
    text[0] = '\0';
    append_text(&line, "%s", kinds[event->kind].name);
    walk(&line, kinds[event->kind].fields, "", (char *)&copy);
    return line.wrong ? ERROR_RANGE : (int)strlen(text);
}

int session_event_parse(const char *text, size_t length, struct session_event *event) {
    struct line line = {.parses = true, .at = text, .end = text + length};
    memset(event, 0, sizeof *event);
    size_t kind = 0;
    while (kind < SESSION_EVENT_KINDS && !skip_word(&line, kinds[kind].name)) {
        kind++;
    }
    if (kind == SESSION_EVENT_KINDS) {
        return ERROR_SYNTAX;
    }
    event->kind = (enum session_event_kind)kind;
    walk(&line, kinds[kind].fields, "", (char *)event);
    for (int side = 0; kind == SESSION_PAIR && side < RIG_SIDES; side++) {
        struct raw_image *const image = &event->pair.frame[side].image;
        image->stride = (ptrdiff_t)raw_image_row_values(image);
    }
    char again[SESSION_LINE_MAX + 1];
    const int printed = line.wrong ? ERROR_SYNTAX : session_event_print(event, again);
    const bool same = printed >= 0 && (size_t)printed == length && memcmp(again, text, length) == 0;
    return same ? 0 : ERROR_SYNTAX;
}
