// SPDX-License-Identifier: Apache-2.0
// The head of a compact surface: lines "NAME VALUES" in a fixed order, for everything that a writer
// of results reads and that is not a pixel. A text that is not there has no line.
#include <inttypes.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/error.h"
#include "daemon/surface/result/compact.h"
#include "daemon/surface/result/compact_band.h"

enum kind {
    FLAG,    // 0 or 1; bool
    INT,     // int, or an enum
    U16,     // uint16_t
    U32,     // uint32_t
    U64,     // uint64_t
    SIZE,    // size_t
    REAL,    // double
    TEXT,    // the rest of the line; const char *
    LETTERS  // the same; char[MESSAGE_BYTES]
};

struct field {
    const char *name;
    enum kind kind;
    int count;        // values, one after the other in memory
    double min, max;  // of each number, both ends included
    size_t offset;    // in struct compact
};

#define OF(member) offsetof(struct compact, member)
#define ANY_REAL -1e15, 1e15
#define COUNT 0, 1e9
#define LARGE 0, 9e15

enum {
    REPORT_FIGURES =
        (offsetof(struct adjust_report, health) - offsetof(struct adjust_report, rows_before_px)) /
        sizeof(double),
};
_Static_assert(sizeof(struct picture_stats) == 4 * sizeof(uint16_t), "four values");
_Static_assert(sizeof(enum adjust_health) == sizeof(int), "enums are written as int");

// clang-format off
#define REPORT(name, member) \
    {name "_points", INT, 3, COUNT, OF(context.member.corners)}, \
    {name "_figures", REAL, REPORT_FIGURES, -INFINITY, INFINITY, OF(context.member.rows_before_px)}, \
    {name "_health", INT, 1, 0, ADJUST_CALIBRATE, OF(context.member.health)}
#define IMAGE(name, side) \
    {name "_size_px", INT, 2, 1, 1 << 17, OF(context.side.width_px)}, \
    {name "_bits", INT, 1, 8, 16, OF(context.side.bits)}, \
    {name "_layout", INT, 1, RAW_GREY, RAW_BAYER_GRBG, OF(context.side.layout)}

static const struct field fields[] = {
    {"version", TEXT, 1, 0, 0, OF(context.version)},
    {"build", TEXT, 1, 0, 0, OF(context.build_id)},
    {"left", TEXT, 1, 0, 0, OF(context.left_path)},
    {"right", TEXT, 1, 0, 0, OF(context.right_path)},
    IMAGE("left", left),
    IMAGE("right", right),
    {"shrunk_by", INT, 1, 1, 1 << 16, OF(context.shrink)},
    {"left_picture_permille", U16, 4, 0, 1000, OF(context.picture[0])},
    {"right_picture_permille", U16, 4, 0, 1000, OF(context.picture[1])},
    {"calibration_path", TEXT, 1, 0, 0, OF(context.calibration_path)},
    {"calibration_format", TEXT, 1, 0, 0, OF(context.calibration_format)},
    {"calibration_crc", U32, 1, 0, UINT32_MAX, OF(result.calibration_crc)},
    {"metric", FLAG, 1, 0, 1, OF(context.metric)},
    {"mismatch", LETTERS, 1, 0, 0, OF(context.mismatch)},
    {"axes_compared", FLAG, 1, 0, 1, OF(context.axes_compared)},
    {"self_calibrated", FLAG, 1, 0, 1, OF(context.self_calibrated)},
    REPORT("self", self_calibration),
    {"with_pair", U32, 1, COUNT, OF(context.with_pair)},
    {"with_pair_used", FLAG, 1, 0, 1, OF(context.with_pair_used)},
    {"with_pair_points", INT, 1, COUNT, OF(context.wide_pair.carried)},
    {"with_pair_off_px", REAL, 1, -INFINITY, INFINITY, OF(context.wide_pair.carried_px)},
    {"with_pair_turn_rad", REAL, 4, -INFINITY, INFINITY, OF(context.wide_pair.turn_rad)},
    {"target_points", INT, 1, COUNT, OF(context.target_points)},
    REPORT("without_target", without_target),
    {"depth_sigma_common_mm", REAL, 1, -INFINITY, INFINITY, OF(context.depth_sigma_common_mm)},
    {"decisions", TEXT, 1, 0, 0, OF(context.decisions)},
    {"scale", REAL, 1, 1e-6, 1e6, OF(options.rectify.scale)},
    {"preset", INT, 1, 0, MATCH_PRESET_COUNT - 1, OF(options.preset)},
    {"speckle_px", INT, 1, COUNT, OF(options.speckle_px)},
    {"keep_all", FLAG, 1, 0, 1, OF(options.keep_all)},
    {"fill", FLAG, 1, 0, 1, OF(options.fill)},
    {"refine", FLAG, 1, 0, 1, OF(options.refine)},
    {"max_gap_q8", INT, 1, COUNT, OF(options.max_gap_q8)},
    {"plan_size_px", INT, 2, 1, IMAGE_MAX_SIDE_PX, OF(result.plan.width_px)},
    {"plan_focal_px", REAL, 2, 1e-6, 1e9, OF(result.plan.f_px)},
    {"plan_centre_px", REAL, 3, ANY_REAL, OF(result.plan.cx_left_px)},
    {"plan_baseline_mm", REAL, 1, 1e-6, 1e9, OF(result.plan.baseline_mm)},
    {"plan_left", REAL, 9, -1.000001, 1.000001, OF(result.plan.R_rect_left)},
    {"plan_right", REAL, 9, -1.000001, 1.000001, OF(result.plan.R_rect_right)},
    {"plan_depths_mm", REAL, 2, -INFINITY, INFINITY, OF(result.plan.depth_near_mm)},
    {"plan_disparities", INT, 2, -1e6, 1e6, OF(result.plan.disparity_min)},
    {"plan_identity", FLAG, 1, 0, 1, OF(result.plan.identity)},
    {"plan_depths_assumed", FLAG, 1, 0, 1, OF(result.plan.depth_range_assumed)},
    {"rows_offset_px", REAL, 8, ANY_REAL, OF(result.vertical.offset_px)},
    {"rows_samples", INT, 1, COUNT, OF(result.vertical.samples)},
    {"repeating", U32, 1, COUNT, OF(result.repeating_count)},
    {"vertices", U32, 1, COUNT, OF(result.vertex_count)},
    {"triangles", U32, 1, COUNT, OF(result.triangle_count)},
    {"threads", INT, 1, COUNT, OF(context.threads)},
    {"read_us", U64, 1, LARGE, OF(context.read_us)},
    {"total_us", U64, 1, LARGE, OF(context.total_us)},
    {"stages_us", U64, RECONSTRUCT_STAGES, LARGE, OF(result.stage_us)},
    {"stages_bytes", SIZE, RECONSTRUCT_STAGES, LARGE, OF(result.stage_peak_bytes)},
    {"match_bytes", SIZE, 1, LARGE, OF(result.match_peak_bytes)},
    {"arena_bytes", SIZE, 1, LARGE, OF(result.arena_peak_bytes)},
    {"arena_given_bytes", SIZE, 1, LARGE, OF(context.arena_bytes)},
    {"process_bytes", SIZE, 1, LARGE, OF(context.rss_peak_bytes)},
};
// clang-format on
enum { FIELDS = sizeof fields / sizeof fields[0] };

static const size_t kind_bytes[] = {
    [FLAG] = sizeof(bool),    [INT] = sizeof(int),      [U16] = sizeof(uint16_t),
    [U32] = sizeof(uint32_t), [U64] = sizeof(uint64_t), [SIZE] = sizeof(size_t),
    [REAL] = sizeof(double),  [TEXT] = sizeof(char *),  [LETTERS] = sizeof(struct message),
};

// ---- printing

/// Line feeds and backslashes are written as \n and \\.
static void print_text(const char *name, const char *text, FILE *stream) {
    if (text == NULL) {
        return;
    }
    fprintf(stream, "%s ", name);
    for (; *text != '\0'; text++) {
        if (*text == '\n' || *text == '\\') {
            fputs(*text == '\n' ? "\\n" : "\\\\", stream);
        } else {
            fputc(*text, stream);
        }
    }
    fputc('\n', stream);
}

static int64_t integer_at(enum kind kind, const char *at) {
    switch (kind) {
        case FLAG:
            return *(const bool *)at;
        case U16:
            return *(const uint16_t *)(const void *)at;
        case U32:
            return *(const uint32_t *)(const void *)at;
        case U64:
            return (int64_t) * (const uint64_t *)(const void *)at;
        case SIZE:
            return (int64_t) * (const size_t *)(const void *)at;
        default:
            return *(const int *)(const void *)at;
    }
}

static void print_field(const struct field *field, const struct compact *record, FILE *stream) {
    const char *at = (const char *)record + field->offset;
    if (field->kind == TEXT || field->kind == LETTERS) {
        print_text(field->name, field->kind == TEXT ? *(const char *const *)(const void *)at : at,
                   stream);
        return;
    }
    fputs(field->name, stream);
    for (int i = 0; i < field->count; i++, at += kind_bytes[field->kind]) {
        if (field->kind == REAL) {
            fprintf(stream, " %.17g", *(const double *)(const void *)at);
        } else {
            fprintf(stream, " %" PRId64, integer_at(field->kind, at));
        }
    }
    fputc('\n', stream);
}

/// Lines of the session's index describe the pair and the instrument.
static int print_capture(const struct capture_info *capture, FILE *stream) {
    if (capture->session == NULL) {
        return ERROR_OK;
    }
    struct session_event *event = calloc(1, sizeof *event);
    char line[SESSION_LINE_MAX + 1];
    if (event == NULL) {
        return ERROR_MEMORY;
    }
    event->kind = SESSION_PAIR;
    event->pair = *capture->pair;
    int error = session_event_print(event, line);
    if (error > 0) {
        print_text("session", capture->session, stream);
        fprintf(stream, "session_pair %s\n", line);
    }
    if (error > 0 && capture->instrument != NULL) {
        event->kind = SESSION_INSTRUMENT;
        event->instrument = *capture->instrument;
        error = session_event_print(event, line);
        fprintf(stream, "session_instrument %s\n", line);
    }
    free(event);
    return error > 0 ? ERROR_OK : error;
}

int compact_head_print(const struct reconstruct_context *context, FILE *stream) {
    char calibration[CALIBRATION_TEXT_MAX_BYTES];
    struct compact *record = calloc(1, sizeof *record);
    if (record == NULL) {
        return ERROR_MEMORY;
    }
    record->context = *context;
    record->options = *context->options;
    record->result = *context->result;
    fprintf(stream, COMPACT_MAGIC "%d\n", COMPACT_VERSION);
    for (int i = 0; i < FIELDS; i++) {
        print_field(&fields[i], record, stream);
    }
    free(record);
    // Notes on the files that were made are not notes on the surface.
    for (int i = 0; i < context->warning_count && i < context->notes_measured; i++) {
        print_text("note", context->warnings[i].text, stream);
    }
    const int error = print_capture(&context->capture, stream);
    const int length = calibration_print(context->calibration, calibration, sizeof calibration);
    fprintf(stream, "calibration %d\n%srows\n", length, length > 0 ? calibration : "");
    return error != ERROR_OK ? error : length < 0 ? length : ERROR_OK;
}

// ---- parsing

struct reader {
    char *at;  // start of the next line
    int line;  // its number
};

/// The rest of the next line if it has this name, which is then taken; else NULL.
static char *take(struct reader *reader, const char *name) {
    const size_t length = strlen(name);
    char *end = strchr(reader->at, '\n');
    if (end == NULL || strncmp(reader->at, name, length) != 0 ||
        (reader->at[length] != ' ' && reader->at[length] != '\n')) {
        return NULL;
    }
    char *values = reader->at + length + (reader->at[length] == ' ');
    *end = '\0';
    reader->at = end + 1;
    reader->line++;
    return values;
}

/// Undoes print_text in place.
static const char *plain(char *text) {
    char *to = text;
    for (const char *from = text; *from != '\0'; from++) {
        if (*from == '\\' && from[1] != '\0') {
            from++;
            *to++ = *from == 'n' ? '\n' : *from;
        } else {
            *to++ = *from;
        }
    }
    *to = '\0';
    return text;
}

static void store(enum kind kind, char *at, double real, int64_t integer) {
    switch (kind) {
        case FLAG:
            *(bool *)at = integer != 0;
            break;
        case U16:
            *(uint16_t *)(void *)at = (uint16_t)integer;
            break;
        case U32:
            *(uint32_t *)(void *)at = (uint32_t)integer;
            break;
        case U64:
            *(uint64_t *)(void *)at = (uint64_t)integer;
            break;
        case SIZE:
            *(size_t *)(void *)at = (size_t)integer;
            break;
        case REAL:
            *(double *)(void *)at = real;
            break;
        default:
            *(int *)(void *)at = (int)integer;
            break;
    }
}

static bool parse_numbers(const struct field *field, const char *values, char *at) {
    for (int i = 0; i < field->count; i++, at += kind_bytes[field->kind]) {
        char *end = NULL;
        const int64_t integer = field->kind == REAL ? 0 : strtoll(values, &end, 10);
        const double real = field->kind == REAL ? strtod(values, &end) : (double)integer;
        // False for a NaN, too.
        if (end == values || !(real >= field->min && real <= field->max) ||
            *end != (i + 1 < field->count ? ' ' : '\0')) {
            return false;
        }
        store(field->kind, at, real, integer);
        values = end + 1;
    }
    return true;
}

static bool parse_field(struct reader *reader, const struct field *field, struct compact *compact) {
    char *at = (char *)compact + field->offset;
    char *values = take(reader, field->name);
    if (field->kind == TEXT) {
        *(const char **)(void *)at = values != NULL ? plain(values) : NULL;
        return true;
    }
    if (field->kind == LETTERS && values != NULL) {
        snprintf(at, sizeof(struct message), "%s", plain(values));
        return true;
    }
    return values != NULL && parse_numbers(field, values, at);
}

static bool parse_event(char *line, enum session_event_kind kind, struct session_event *event) {
    return line != NULL && session_event_parse(line, strlen(line), event) == ERROR_OK &&
           event->kind == kind;
}

static bool parse_capture(struct reader *reader, struct compact *compact) {
    struct capture_info *capture = &compact->context.capture;
    char *session = take(reader, "session");
    if (session == NULL) {
        return true;
    }
    struct session_event *event = calloc(1, sizeof *event);
    bool read = event != NULL && parse_event(take(reader, "session_pair"), SESSION_PAIR, event);
    if (read) {
        compact->pair = event->pair;
        capture->session = plain(session);
        capture->pair = &compact->pair;
    }
    char *line = read ? take(reader, "session_instrument") : NULL;
    if (line != NULL) {
        read = parse_event(line, SESSION_INSTRUMENT, event);
        compact->instrument = event->instrument;
        capture->instrument = &compact->instrument;
    }
    free(event);
    return read;
}

/// A text of as many bytes as its line says.
static bool parse_calibration(struct reader *reader, struct compact *compact) {
    const char *values = take(reader, "calibration");
    const long length = values != NULL ? strtol(values, NULL, 10) : 0;
    if (length <= 0 || length > CALIBRATION_TEXT_MAX_BYTES ||
        strnlen(reader->at, (size_t)length) < (size_t)length ||
        calibration_parse(reader->at, (size_t)length, &compact->calibration, NULL) != ERROR_OK) {
        return false;
    }
    reader->at += length;
    return true;
}

static bool parse_all(struct reader *reader, struct compact *compact) {
    char *values = NULL;
    if (take(reader, "vergence") == NULL) {
        return false;
    }
    for (int i = 0; i < FIELDS; i++) {
        if (!parse_field(reader, &fields[i], compact)) {
            return false;
        }
    }
    while ((values = take(reader, "note")) != NULL) {
        reconstruct_context_warn(&compact->context, "%s", plain(values));
    }
    return parse_capture(reader, compact) && parse_calibration(reader, compact) &&
           take(reader, "rows") != NULL;
}

/// What every writer expects to be there.
static bool is_complete(const struct compact *compact) {
    const struct reconstruct_context *context = &compact->context;
    return context->version != NULL && context->build_id != NULL && context->left_path != NULL &&
           context->right_path != NULL && context->calibration_format != NULL;
}

size_t compact_head_parse(struct compact *compact, int *line) {
    struct reader reader = {.at = compact->head, .line = 1};
    const bool read = parse_all(&reader, compact) && is_complete(compact);
    *line = reader.line;
    struct reconstruct_context *context = &compact->context;
    context->result = &compact->result;
    context->options = &compact->options;
    context->calibration = &compact->calibration;
    context->notes_measured = context->warning_count;
    compact->result.max_gap_q8 = compact->options.max_gap_q8;
    return read ? (size_t)(reader.at - compact->head) : 0;
}
