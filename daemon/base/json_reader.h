// SPDX-License-Identifier: Apache-2.0
/// Finds members of a JSON object (RFC 8259) in a text without building a tree.
#ifndef VERGENCE_DAEMON_BASE_JSON_READER_H
#define VERGENCE_DAEMON_BASE_JSON_READER_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

enum { JSON_READER_DEPTH_MAX = 32 };

/// The text of a value; NULL: no value.
struct json_value {
    const char *text;
    size_t length;
};

/// The whole text as one value, or NULL text if it is not well-formed.
struct json_value json_reader_parse(const char *text, size_t length);

/// The member `name` of an object returned by json_reader_parse or by this function. Names that
/// contain escapes are not found.
struct json_value json_reader_member(struct json_value object, const char *name);

/// The array element after `previous` (NULL text: the first element). NULL text at the end.
struct json_value json_reader_next(struct json_value array, struct json_value previous);

/// Unescapes a string, without its quotes, into `to` (terminated). False: not a string, or longer
/// than `bytes` - 1.
bool json_reader_text(struct json_value value, char *to, size_t bytes);
/// Reads an integer. False: not an integer.
bool json_reader_integer(struct json_value value, int64_t *number);
/// Whether the value is `true`.
bool json_reader_true(struct json_value value);

#ifdef __cplusplus
}
#endif

#endif
