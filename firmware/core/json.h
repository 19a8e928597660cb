// SPDX-License-Identifier: Apache-2.0
/// Writes JSON (RFC 8259) value by value, with commas, indentation and escapes: as a stream, as
/// answers and results can be larger than the memory of a board.
#ifndef VERGENCE_CORE_JSON_H
#define VERGENCE_CORE_JSON_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

enum { JSON_MAX_DEPTH = 16 };

struct json {
    void (*put)(void *self, const char *data, size_t bytes);
    void *self;
    bool one_line;  ///< the whole document is one line
    int depth;
    bool first[JSON_MAX_DEPTH + 1];    ///< nothing written at this depth yet
    bool in_line[JSON_MAX_DEPTH + 1];  ///< this array is written on one line
};

/// Begins a document, whose bytes go to `put`.
void json_begin_at(struct json *json, void (*put)(void *self, const char *data, size_t bytes),
                   void *self, bool one_line);

/// Objects and arrays. `name` is the member's name, or NULL inside an array and at the top.
void json_open_object(struct json *json, const char *name);
void json_close_object(struct json *json);
void json_open_array(struct json *json, const char *name);
/// An array on one line.
void json_open_row(struct json *json, const char *name);
void json_close_array(struct json *json);

/// Values. Bytes that are not UTF-8 become U+FFFD; a NULL text becomes null.
void json_text(struct json *json, const char *name, const char *value);
void json_bool(struct json *json, const char *name, bool value);
void json_integer(struct json *json, const char *name, int64_t value);
/// A number with `decimals` digits after the point, 0 .. DECIMAL_MAX_DECIMALS, as
/// decimal_print_double; null if it is not finite, as JSON cannot express that.
void json_fixed(struct json *json, const char *name, double value, int decimals);
void json_null(struct json *json, const char *name);
/// A value as it is printed.
void json_token(struct json *json, const char *name, const char *printed);

/// Ends the document with a line feed. Everything that was opened must be closed.
void json_end(struct json *json);

#ifdef __cplusplus
}
#endif

#endif
