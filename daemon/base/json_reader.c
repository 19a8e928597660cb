// SPDX-License-Identifier: Apache-2.0
#include "daemon/base/json_reader.h"

#include <string.h>

#include "core/invariant.h"

/// A position in a text that ends at `end`.
struct scan {
    const char *at, *end;
};

static bool skip_value(struct scan *scan, int depth);

static void skip_blanks(struct scan *scan) {
    while (scan->at < scan->end && strchr(" \t\r\n", *scan->at) != NULL && *scan->at != '\0') {
        scan->at++;
    }
}

static bool take(struct scan *scan, char wanted) {
    const bool there = scan->at < scan->end && *scan->at == wanted;
    scan->at += there;
    return there;
}

static bool skip_word(struct scan *scan, const char *word) {
    const size_t length = strlen(word);
    const bool there =
        (size_t)(scan->end - scan->at) >= length && memcmp(scan->at, word, length) == 0;
    scan->at += there ? length : 0;
    return there;
}

static bool is_hex(char c) {
    return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'f') || (c >= 'A' && c <= 'F');
}

/// Skips the rest of an escape, after the backslash.
static bool skip_escape(struct scan *scan) {
    if (!take(scan, 'u')) {
        return scan->at < scan->end && *scan->at != '\0' &&
               strchr("\"\\/bfnrt", *scan->at++) != NULL;
    }
    for (int i = 0; i < 4; i++) {
        if (scan->at >= scan->end || !is_hex(*scan->at++)) {
            return false;
        }
    }
    return true;
}

static bool skip_string(struct scan *scan) {
    if (!take(scan, '"')) {
        return false;
    }
    while (scan->at < scan->end && *scan->at != '"') {
        const char c = *scan->at++;
        if ((unsigned char)c < ' ') {
            return false;
        }
        if (c == '\\' && !skip_escape(scan)) {
            return false;
        }
    }
    return take(scan, '"');
}

static bool skip_digits(struct scan *scan) {
    const char *first = scan->at;
    while (scan->at < scan->end && *scan->at >= '0' && *scan->at <= '9') {
        scan->at++;
    }
    return scan->at > first;
}

static bool skip_number(struct scan *scan) {
    take(scan, '-');
    if (!take(scan, '0') && !skip_digits(scan)) {
        return false;
    }
    if (take(scan, '.') && !skip_digits(scan)) {
        return false;
    }
    if (take(scan, 'e') || take(scan, 'E')) {
        if (!take(scan, '+')) {
            take(scan, '-');
        }
        return skip_digits(scan);
    }
    return true;
}

/// Skips the contents of brackets; members are preceded by a name.
static bool skip_group(struct scan *scan, bool object, int depth) {
    const char closing = object ? '}' : ']';
    skip_blanks(scan);
    if (take(scan, closing)) {
        return true;
    }
    do {
        skip_blanks(scan);
        if (object) {
            if (!skip_string(scan)) {
                return false;
            }
            skip_blanks(scan);
            if (!take(scan, ':')) {
                return false;
            }
        }
        if (!skip_value(scan, depth + 1)) {
            return false;
        }
    } while (take(scan, ','));
    return take(scan, closing);
}

/// Skips a value and the white space around it.
static bool skip_value(struct scan *scan, int depth) {
    if (depth > JSON_READER_DEPTH_MAX) {
        return false;
    }
    skip_blanks(scan);
    if (scan->at >= scan->end) {
        return false;
    }
    bool good = false;
    switch (*scan->at) {
        case '{':
        case '[': {
            const bool object = *scan->at++ == '{';
            good = skip_group(scan, object, depth);
            break;
        }
        case '"':
            good = skip_string(scan);
            break;
        case 't':
            good = skip_word(scan, "true");
            break;
        case 'f':
            good = skip_word(scan, "false");
            break;
        case 'n':
            good = skip_word(scan, "null");
            break;
        default:
            good = skip_number(scan);
            break;
    }
    skip_blanks(scan);
    return good;
}

struct json_value json_reader_parse(const char *text, size_t length) {
    struct scan scan = {text, text + length};
    skip_blanks(&scan);
    const char *begin = scan.at;
    if (!skip_value(&scan, 0) || scan.at != scan.end) {
        return (struct json_value){NULL, 0};
    }
    return (struct json_value){begin, (size_t)(scan.end - begin)};
}

struct json_value json_reader_member(struct json_value object, const char *name) {
    if (object.text == NULL) {
        return (struct json_value){NULL, 0};
    }
    struct scan scan = {object.text, object.text + object.length};
    const size_t length = strlen(name);
    if (!take(&scan, '{')) {
        return (struct json_value){NULL, 0};
    }
    do {
        skip_blanks(&scan);
        const char *key = scan.at;
        if (!skip_string(&scan)) {
            break;
        }
        const bool meant =
            (size_t)(scan.at - key) == length + 2 && memcmp(key + 1, name, length) == 0;
        skip_blanks(&scan);
        take(&scan, ':');
        skip_blanks(&scan);
        const char *value = scan.at;
        const bool good = skip_value(&scan, 0);
        INVARIANT(good || scan.at <= scan.end);
        if (meant) {
            return (struct json_value){value, (size_t)(scan.at - value)};
        }
    } while (take(&scan, ','));
    return (struct json_value){NULL, 0};
}

struct json_value json_reader_next(struct json_value array, struct json_value previous) {
    const struct json_value none = {NULL, 0};
    if (array.text == NULL) {
        return none;
    }
    struct scan scan = {array.text, array.text + array.length};
    if (previous.text != NULL) {
        INVARIANT(previous.text > array.text && previous.text + previous.length <= scan.end);
        scan.at = previous.text + previous.length;
    }
    if (!take(&scan, previous.text != NULL ? ',' : '[')) {
        return none;
    }
    skip_blanks(&scan);
    const char *value = scan.at;
    // An empty array has no element.
    return skip_value(&scan, 0) ? (struct json_value){value, (size_t)(scan.at - value)} : none;
}

/// The character of an escape; beyond Latin-1 it is '?', as no reader here needs those.
static char unescaped(const char **at) {
    static const char letters[] = "bfnrt";
    static const char meant[] = "\b\f\n\r\t";
    const char c = *(*at)++;
    if (c == 'u') {
        int code = 0;
        for (int i = 0; i < 4; i++) {
            const char digit = *(*at)++;
            code = code * 16 + (digit <= '9' ? digit - '0' : (digit | 0x20) - 'a' + 10);
        }
        return code > 0 && code < 0x80 ? (char)code : '?';
    }
    const char *letter = strchr(letters, c);
    return letter != NULL ? meant[letter - letters] : c;
}

bool json_reader_text(struct json_value value, char *to, size_t bytes) {
    if (value.text == NULL || value.length < 2 || value.text[0] != '"') {
        return false;
    }
    const char *end = value.text + value.length;
    while (end[-1] != '"') {
        end--;  // trailing white space
    }
    end--;
    size_t length = 0;
    for (const char *at = value.text + 1; at < end;) {
        if (length + 1 >= bytes) {
            return false;
        }
        const char c = *at++;
        to[length++] = c == '\\' ? unescaped(&at) : c;
    }
    to[length] = '\0';
    return true;
}

bool json_reader_integer(struct json_value value, int64_t *number) {
    int64_t sum = 0;
    size_t at = 0;
    const bool negative = value.length > 0 && value.text[0] == '-';
    at += negative;
    const size_t first = at;
    for (; at < value.length && value.text[at] >= '0' && value.text[at] <= '9'; at++) {
        if (sum > (INT64_MAX - 9) / 10) {
            return false;
        }
        sum = sum * 10 + (value.text[at] - '0');
    }
    if (at == first || (at < value.length && strchr(".eE", value.text[at]) != NULL)) {
        return false;
    }
    *number = negative ? -sum : sum;
    return true;
}

bool json_reader_true(struct json_value value) {
    return value.length >= 4 && memcmp(value.text, "true", 4) == 0;
}
