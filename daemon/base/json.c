// SPDX-License-Identifier: Apache-2.0
#include "daemon/base/json.h"

#include <cjson/cJSON.h>
#include <inttypes.h>
#include <math.h>
#include <stddef.h>
#include <string.h>

#include "core/invariant.h"
#include "daemon/base/message.h"

void json_begin(struct json *json, FILE *stream) {
    INVARIANT(stream != NULL);
    *json = (struct json){.stream = stream};
    json->first[0] = true;
}

void json_begin_line(struct json *json, FILE *stream) {
    json_begin(json, stream);
    json->one_line = true;
}

static void put_text(FILE *stream, const char *text) {
    fputc('"', stream);
    while (*text != '\0') {
        uint32_t character = 0;
        const size_t length = utf8_character(text, &character);
        if (length == 0) {
            fputs("\\ufffd", stream);
        } else if (*text == '"' || *text == '\\') {
            fprintf(stream, "\\%c", *text);
        } else if (character < ' ' || character == 0x7f) {
            fprintf(stream, "\\u%04x", (unsigned)character);
        } else {
            fwrite(text, 1, length, stream);
        }
        text += length > 0 ? length : 1;
    }
    fputc('"', stream);
}

/// Writes what precedes a value: comma, line, indentation, name.
static void put_lead(struct json *json, const char *name) {
    const bool in_line = json->in_line[json->depth];
    if (!json->first[json->depth]) {
        fputs(in_line ? ", " : ",", json->stream);
    }
    json->first[json->depth] = false;
    if (json->depth > 0 && !in_line) {
        fprintf(json->stream, "\n%*s", 2 * json->depth, "");
    }
    if (name != NULL) {
        put_text(json->stream, name);
        fputs(": ", json->stream);
    }
}

static void open_level(struct json *json, const char *name, char bracket, bool in_line) {
    put_lead(json, name);
    INVARIANT(json->depth < JSON_MAX_DEPTH);
    fputc(bracket, json->stream);
    json->depth++;
    json->first[json->depth] = true;
    json->in_line[json->depth] = in_line || json->one_line;
}

static void close_level(struct json *json, char bracket) {
    INVARIANT(json->depth > 0);
    const bool empty = json->first[json->depth];
    const bool in_line = json->in_line[json->depth];
    json->depth--;
    if (!empty && !in_line) {
        fprintf(json->stream, "\n%*s", 2 * json->depth, "");
    }
    fputc(bracket, json->stream);
}

void json_open_object(struct json *json, const char *name) {
    open_level(json, name, '{', false);
}

void json_close_object(struct json *json) {
    close_level(json, '}');
}

void json_open_array(struct json *json, const char *name) {
    open_level(json, name, '[', false);
}

void json_close_array(struct json *json) {
    close_level(json, ']');
}

void json_null(struct json *json, const char *name) {
    put_lead(json, name);
    fputs("null", json->stream);
}

void json_text(struct json *json, const char *name, const char *value) {
    if (value == NULL) {
        json_null(json, name);
        return;
    }
    put_lead(json, name);
    put_text(json->stream, value);
}

void json_bool(struct json *json, const char *name, bool value) {
    put_lead(json, name);
    fputs(value ? "true" : "false", json->stream);
}

void json_integer(struct json *json, const char *name, int64_t value) {
    put_lead(json, name);
    fprintf(json->stream, "%" PRId64, value);
}

void json_real(struct json *json, const char *name, double value, int digits) {
    INVARIANT(digits >= 1 && digits <= 17);
    if (!isfinite(value)) {
        json_null(json, name);
        return;
    }
    put_lead(json, name);
    fprintf(json->stream, "%.*g", digits, value);
}

void json_fixed(struct json *json, const char *name, double value, int decimals) {
    INVARIANT(decimals >= 0 && decimals <= 17);
    if (!isfinite(value)) {
        json_null(json, name);
        return;
    }
    put_lead(json, name);
    fprintf(json->stream, "%.*f", decimals, value);
}

void json_reals(struct json *json, const char *name, const double *values, int count, int digits) {
    open_level(json, name, '[', true);
    for (int i = 0; i < count; i++) {
        json_real(json, NULL, values[i], digits);
    }
    close_level(json, ']');
}

void json_end(struct json *json) {
    INVARIANT(json->depth == 0);
    fputc('\n', json->stream);
}

struct cJSON *json_parse(const char *text) {
    return cJSON_ParseWithOpts(text, NULL, true);
}

bool json_member_text(const struct cJSON *object, const char *name, char *to, size_t bytes) {
    const char *text = cJSON_GetStringValue(cJSON_GetObjectItemCaseSensitive(object, name));
    if (text == NULL || strlen(text) >= bytes) {
        return false;
    }
    memcpy(to, text, strlen(text) + 1);
    return true;
}

bool json_member_integer(const struct cJSON *object, const char *name, int64_t *number) {
    const double exact = 9007199254740992.0;
    const struct cJSON *value = cJSON_GetObjectItemCaseSensitive(object, name);
    if (!cJSON_IsNumber(value) || !(fabs(value->valuedouble) <= exact) ||
        value->valuedouble != floor(value->valuedouble)) {
        return false;
    }
    *number = (int64_t)value->valuedouble;
    return true;
}

bool json_member_true(const struct cJSON *object, const char *name) {
    return cJSON_IsTrue(cJSON_GetObjectItemCaseSensitive(object, name));
}
