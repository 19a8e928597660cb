// SPDX-License-Identifier: Apache-2.0
/// Finds members of a JSON object (RFC 8259) in a text, without building anything.
#ifndef VERGENCE_DAEMON_BASE_JSON_READER_H
#define VERGENCE_DAEMON_BASE_JSON_READER_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

enum { JSON_READER_DEPTH_MAX = 32 };

/// A value's text; NULL: there is none.
struct json_value {
    const char *text;
    size_t length;
};

/// The whole text as one value, if it is well formed.
struct json_value json_reader_parse(const char *text, size_t length);

/// The member of an object that json_reader_parse or this has found. Names with escapes are not
/// found.
struct json_value json_reader_member(struct json_value object, const char *name);

/// The element of an array behind `previous` (NULL in it: the first). Its text is NULL at the end.
struct json_value json_reader_next(struct json_value array, struct json_value previous);

/// A string without its quotes, its escapes taken apart, in `to` (terminated). False: it is none,
/// or longer than `bytes` - 1.
bool json_reader_text(struct json_value value, char *to, size_t bytes);
/// A whole number. False: it is none.
bool json_reader_integer(struct json_value value, int64_t *number);
/// Whether it is `true`.
bool json_reader_true(struct json_value value);

#ifdef __cplusplus
}
#endif

#endif
