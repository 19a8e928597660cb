// SPDX-License-Identifier: Apache-2.0
/// JSON (RFC 8259) in files, and reading it by cJSON. What writes it: core/json.h.
#ifndef VERGENCE_DAEMON_BASE_JSON_H
#define VERGENCE_DAEMON_BASE_JSON_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

#include "core/json.h"

#ifdef __cplusplus
extern "C" {
#endif

/// Begins a document on a stream that the caller owns, whose error indicator shows whether
/// everything was written.
void json_begin(struct json *json, FILE *stream);
/// Begins a document on one line.
void json_begin_line(struct json *json, FILE *stream);

/// A number with `digits` significant digits, 1..17; null if it is not finite.
void json_real(struct json *json, const char *name, double value, int digits);
/// An array of numbers, on one line.
void json_reals(struct json *json, const char *name, const double *values, int count, int digits);

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
