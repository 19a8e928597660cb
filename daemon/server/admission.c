// SPDX-License-Identifier: Apache-2.0
#include "daemon/server/admission.h"

#include <stdbool.h>
#include <string.h>

#include "daemon/files/token.h"

static bool begins_with(const char *line, size_t length, const char *word) {
    const size_t bytes = strlen(word);
    return length >= bytes && memcmp(line, word, bytes) == 0;
}

/// No console command is upper-case.
static bool is_http(const char *line, size_t length) {
    static const char *const methods[] = {"GET ",     "HEAD ",    "POST ",  "PUT ",   "DELETE ",
                                          "CONNECT ", "OPTIONS ", "TRACE ", "PATCH ", "PRI "};
    for (size_t i = 0; i < sizeof methods / sizeof methods[0]; i++) {
        if (begins_with(line, length, methods[i])) {
            return true;
        }
    }
    return false;
}

static bool is_blank(const char *line, size_t length) {
    size_t i = 0;
    while (i < length && (line[i] == ' ' || line[i] == '\t')) {
        i++;
    }
    return i == length;
}

enum admission admission_of(const char *line, size_t length, const char *token) {
    const size_t prefix = sizeof TOKEN_PREFIX - 1;
    if (is_blank(line, length)) {
        return ADMISSION_LINE;
    }
    if (is_http(line, length)) {
        return ADMISSION_HTTP;
    }
    const bool gives = begins_with(line, length, TOKEN_PREFIX);
    if (token == NULL) {
        return gives ? ADMISSION_TOKEN : ADMISSION_LINE;
    }
    return gives && token_is(token, line + prefix, length - prefix) ? ADMISSION_TOKEN
                                                                    : ADMISSION_WRONG;
}
