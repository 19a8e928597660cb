// SPDX-License-Identifier: Apache-2.0
#include "core/json.h"

#include <math.h>
#include <string.h>

#include "core/decimal.h"
#include "core/invariant.h"
#include "core/utf8.h"

void json_begin_at(struct json *json, void (*put)(void *self, const char *data, size_t bytes),
                   void *self, bool one_line) {
    INVARIANT(put != NULL);
    *json = (struct json){.put = put, .self = self, .one_line = one_line};
    json->first[0] = true;
}

static void put_string(struct json *json, const char *text) {
    json->put(json->self, text, strlen(text));
}

static void put_escaped(struct json *json, const char *text) {
    static const char digits[] = "0123456789abcdef";
    put_string(json, "\"");
    while (*text != '\0') {
        uint32_t character = 0;
        const size_t length = utf8_character(text, &character);
        if (length == 0) {
            put_string(json, "\\ufffd");
        } else if (*text == '"' || *text == '\\') {
            json->put(json->self, (const char[]){'\\', *text}, 2);
        } else if (character < ' ' || character == 0x7f) {
            put_string(json, "\\u00");
            json->put(json->self, (const char[]){digits[character >> 4], digits[character & 15]},
                      2);
        } else {
            json->put(json->self, text, length);
        }
        text += length > 0 ? length : 1;
    }
    put_string(json, "\"");
}

static void put_indent(struct json *json) {
    put_string(json, "\n");
    for (int i = 0; i < json->depth; i++) {
        put_string(json, "  ");
    }
}

/// Writes what precedes a value: comma, line, indentation, name.
static void put_lead(struct json *json, const char *name) {
    INVARIANT(json->put != NULL && json->depth >= 0 && json->depth <= JSON_MAX_DEPTH);
    const bool in_line = json->in_line[json->depth];
    if (!json->first[json->depth]) {
        put_string(json, in_line ? ", " : ",");
    }
    json->first[json->depth] = false;
    if (json->depth > 0 && !in_line) {
        put_indent(json);
    }
    if (name != NULL) {
        put_escaped(json, name);
        put_string(json, ": ");
    }
}

static void open_level(struct json *json, const char *name, const char *bracket, bool in_line) {
    put_lead(json, name);
    INVARIANT(json->depth < JSON_MAX_DEPTH);
    put_string(json, bracket);
    json->depth++;
    json->first[json->depth] = true;
    json->in_line[json->depth] = in_line || json->one_line;
}

static void close_level(struct json *json, const char *bracket) {
    INVARIANT(json->depth > 0);
    const bool empty = json->first[json->depth];
    const bool in_line = json->in_line[json->depth];
    json->depth--;
    if (!empty && !in_line) {
        put_indent(json);
    }
    put_string(json, bracket);
}

void json_open_object(struct json *json, const char *name) {
    open_level(json, name, "{", false);
}

void json_close_object(struct json *json) {
    close_level(json, "}");
}

void json_open_array(struct json *json, const char *name) {
    open_level(json, name, "[", false);
}

void json_open_row(struct json *json, const char *name) {
    open_level(json, name, "[", true);
}

void json_close_array(struct json *json) {
    close_level(json, "]");
}

void json_token(struct json *json, const char *name, const char *printed) {
    put_lead(json, name);
    put_string(json, printed);
}

void json_null(struct json *json, const char *name) {
    json_token(json, name, "null");
}

void json_text(struct json *json, const char *name, const char *value) {
    if (value == NULL) {
        json_null(json, name);
        return;
    }
    put_lead(json, name);
    put_escaped(json, value);
}

void json_bool(struct json *json, const char *name, bool value) {
    json_token(json, name, value ? "true" : "false");
}

void json_integer(struct json *json, const char *name, int64_t value) {
    char printed[DECIMAL_TEXT_BYTES];
    decimal_print_integer(value, printed);
    json_token(json, name, printed);
}

void json_fixed(struct json *json, const char *name, double value, int decimals) {
    char printed[DECIMAL_TEXT_BYTES];
    decimal_print_double(value, decimals, printed);
    json_token(json, name, isfinite(value) ? printed : "null");
}

void json_end(struct json *json) {
    INVARIANT(json->depth == 0);
    put_string(json, "\n");
}
