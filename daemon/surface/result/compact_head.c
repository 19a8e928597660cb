// SPDX-License-Identifier: Apache-2.0
// The head of a compact surface, as the daemon and the PC print and read it.
#include <inttypes.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/error.h"
#include "daemon/surface/result/compact.h"

_Static_assert(sizeof(struct picture_stats) == 4 * sizeof(uint16_t), "four values");
_Static_assert(sizeof(enum adjust_health) == sizeof(int), "enums are written as int");

#define FIELD(name, kind, count, range, member) \
    {name, COMPACT_##kind, count, range, offsetof(struct compact, member)},
static const struct compact_field fields[] = {COMPACT_FIELDS(FIELD)};
#undef FIELD
enum { FIELDS = sizeof fields / sizeof fields[0] };

// ---- printing

/// Lines of the session's index describe the pair and the instrument.
static int print_capture(const struct capture_info *capture, struct compact_writer *writer) {
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
        compact_writer_text(writer, "session", capture->session);
        compact_writer_text(writer, "session_pair", line);
    }
    if (error > 0 && capture->instrument != NULL) {
        event->kind = SESSION_INSTRUMENT;
        event->instrument = *capture->instrument;
        error = session_event_print(event, line);
        compact_writer_text(writer, "session_instrument", line);
    }
    free(event);
    return error > 0 ? ERROR_OK : error;
}

int compact_head_print(const struct reconstruct_context *context, struct compact_writer *writer) {
    struct compact *record = calloc(1, sizeof *record);
    if (record == NULL) {
        return ERROR_MEMORY;
    }
    record->context = *context;
    record->options = *context->options;
    record->result = *context->result;
    compact_writer_fields(writer, fields, FIELDS, record);
    free(record);
    // Notes on the files that were made are not notes on the surface.
    for (int i = 0; i < context->warning_count && i < context->notes_measured; i++) {
        compact_writer_text(writer, "note", context->warnings[i].text);
    }
    const int error = print_capture(&context->capture, writer);
    return error == ERROR_OK ? compact_writer_calibration(writer, context->calibration) : error;
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

static void store(enum compact_kind kind, char *at, double real, int64_t integer) {
    switch (kind) {
        case COMPACT_FLAG:
            *(bool *)at = integer != 0;
            break;
        case COMPACT_U16:
            *(uint16_t *)(void *)at = (uint16_t)integer;
            break;
        case COMPACT_U32:
            *(uint32_t *)(void *)at = (uint32_t)integer;
            break;
        case COMPACT_U64:
            *(uint64_t *)(void *)at = (uint64_t)integer;
            break;
        case COMPACT_SIZE:
            *(size_t *)(void *)at = (size_t)integer;
            break;
        case COMPACT_REAL:
            *(double *)(void *)at = real;
            break;
        default:
            *(int *)(void *)at = (int)integer;
            break;
    }
}

static bool parse_numbers(const struct compact_field *field, const char *values, char *at) {
    for (int i = 0; i < field->count; i++, at += compact_kind_bytes[field->kind]) {
        char *end = NULL;
        const int64_t integer = field->kind == COMPACT_REAL ? 0 : strtoll(values, &end, 10);
        const double real = field->kind == COMPACT_REAL ? strtod(values, &end) : (double)integer;
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

static bool parse_field(struct reader *reader, const struct compact_field *field,
                        struct compact *compact) {
    char *at = (char *)compact + field->offset;
    char *values = take(reader, field->name);
    if (field->kind == COMPACT_TEXT) {
        *(const char **)(void *)at = values != NULL ? plain(values) : NULL;
        return true;
    }
    if (field->kind == COMPACT_LETTERS && values != NULL) {
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
