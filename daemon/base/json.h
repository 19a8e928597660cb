// SPDX-License-Identifier: Apache-2.0
/// Writes JSON (RFC 8259) value by value, with commas, indentation and escapes: as a stream, as
/// results and reports can be larger than the memory of a board. Reading is by cJSON.
#ifndef VERGENCE_DAEMON_BASE_JSON_H
#define VERGENCE_DAEMON_BASE_JSON_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

#ifdef __cplusplus
extern "C" {
#endif

enum { JSON_MAX_DEPTH = 16 };

struct json {
    FILE *stream;   // its error indicator shows whether everything was written
    bool one_line;  // the whole document is one line
    int depth;
    bool first[JSON_MAX_DEPTH + 1];    // nothing written at this depth yet
    bool in_line[JSON_MAX_DEPTH + 1];  // this array is written on one line
};

/// Begins a document on a stream that the caller owns.
void json_begin(struct json *json, FILE *stream);
/// Begins a document on one line.
void json_begin_line(struct json *json, FILE *stream);

/// Objects and arrays. `name` is the member's name, or NULL inside an array and at the top.
void json_open_object(struct json *json, const char *name);
void json_close_object(struct json *json);
void json_open_array(struct json *json, const char *name);
void json_close_array(struct json *json);

/// Values. Numbers that are not finite become null, as JSON cannot express them; bytes that are not
/// UTF-8 become U+FFFD; a NULL text becomes null.
void json_text(struct json *json, const char *name, const char *value);
void json_bool(struct json *json, const char *name, bool value);
void json_integer(struct json *json, const char *name, int64_t value);
/// With `digits` significant digits, 1..17.
void json_real(struct json *json, const char *name, double value, int digits);
/// With `decimals` digits after the point, 0..17.
void json_fixed(struct json *json, const char *name, double value, int decimals);
void json_null(struct json *json, const char *name);

/// An array of numbers, on one line.
void json_reals(struct json *json, const char *name, const double *values, int count, int digits);

/// Ends the document with a line feed. Everything that was opened must be closed.
void json_end(struct json *json);

struct cJSON;  // declared in <cjson/cJSON.h>

/// Parses a zero-terminated text that is one value, of up to CJSON_NESTING_LIMIT levels. The caller
/// frees it with cJSON_Delete. NULL: not well-formed, or out of memory.
struct cJSON *json_parse(const char *text);

/// Copies a member of an object that is a string into `to`, terminated. False, with `to` unchanged:
/// there is no such string (`object` may be NULL), or it is longer than `bytes` - 1.
bool json_member_text(const struct cJSON *object, const char *name, char *to, size_t bytes);
/// Reads a member that is an integer of up to 2^53. False: there is none.
bool json_member_integer(const struct cJSON *object, const char *name, int64_t *number);
/// Whether a member is `true`.
bool json_member_true(const struct cJSON *object, const char *name);

#ifdef __cplusplus
}
#endif

#endif
