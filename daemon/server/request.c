// SPDX-License-Identifier: Apache-2.0
#include "daemon/server/request.h"

#include <string.h>

#include "console/command_text.h"
#include "console/command_words.h"
#include "core/crc.h"
#include "core/error.h"
#include "core/invariant.h"

enum { WORD_MAX = 24, ID_MAX = 999999999 };

static bool parse_hex8(const char *text, uint32_t *value) {
    if (strlen(text) != 8 || strspn(text, "0123456789ABCDEFabcdef") != 8) {
        return false;
    }
    char word[11] = "0x";
    memcpy(word + 2, text, 9);
    int64_t number = 0;
    const bool good = command_words_integer(word, &number);
    INVARIANT(good && number >= 0 && number <= UINT32_MAX);
    *value = (uint32_t)number;
    return good;
}

static bool parse_id(const char *text, int32_t *id) {
    int64_t number = -1;
    if (strspn(text, "0123456789") != strlen(text) || !command_words_integer(text, &number) ||
        number > ID_MAX) {
        return false;
    }
    *id = (int32_t)number;
    return true;
}

/// Takes an option other than crc. False: unknown or invalid option.
static bool take_word(const char *word, struct request *request) {
    if (strcmp(word, "json") == 0) {
        request->json = true;
    } else if (strcmp(word, "text") == 0) {
        request->json = false;
    } else if (strcmp(word, "progress") == 0) {
        request->progress = true;
    } else if (strncmp(word, "id=", 3) == 0) {
        return parse_id(word + 3, &request->id);
    } else if (strcmp(word, "once") == 0) {
        request->exactly_once = true;
    } else {
        return false;
    }
    return true;
}

/// Clears `exactly_once`: a command that was not run has no answer to repeat.
static int refuse(struct request *request, const char *text, char *message, size_t message_bytes,
                  int error) {
    struct command_text sentence = command_text_begin(message, message_bytes);
    request->exactly_once = false;
    command_text_add(&sentence, text);
    return error;
}

static int refuse_option(struct request *request, const char *word, char *message,
                         size_t message_bytes) {
    struct command_text sentence = command_text_begin(message, message_bytes);
    request->exactly_once = false;
    command_text_add(&sentence, "invalid option \"");
    command_text_add_typed(&sentence, word);
    command_text_add(&sentence,
                     "\" after @ (expected json, text, progress, once, id=N, or as the "
                     "last one crc=HEX)");
    return ERROR_SYNTAX;
}

/// CRC-32 of a line: as given, and computed.
struct line_crc {
    uint32_t given, computed;
};

/// Takes an option, which begins at `at`. False: unknown or invalid option.
static bool take_option(const char *line, const char *at, const char *word, bool last,
                        struct request *request, struct line_crc *crc) {
    if (last && strncmp(word, "crc=", 4) == 0 && parse_hex8(word + 4, &crc->given)) {
        request->framed = true;
        crc->computed = crc_update(0, line, (size_t)(at - line));
        return true;
    }
    return take_word(word, request);
}

/// Takes the options after @, up to `end`. False: `word` has the beginning of an invalid one.
static bool take_options(const char *line, const char *end, struct request *request,
                         struct line_crc *crc, char word[WORD_MAX]) {
    for (const char *at = line + 1; at <= end;) {
        const char *comma = memchr(at, ',', (size_t)(end - at));
        const size_t bytes = (size_t)((comma != NULL ? comma : end) - at);
        const bool fits = bytes < WORD_MAX;
        memset(word, 0, WORD_MAX);
        memcpy(word, at, fits ? bytes : WORD_MAX - 1);
        if (!fits || !take_option(line, at, word, comma == NULL, request, crc)) {
            return false;
        }
        at += bytes + 1;
    }
    return true;
}

int request_parse(const char *line, struct request *request, char *message, size_t message_bytes) {
    request->id = REQUEST_ID_NONE;
    request->framed = false;
    request->exactly_once = false;
    request->command = line;
    message[0] = '\0';
    if (*line != '@') {
        return 0;
    }
    const char *const end = line + strcspn(line, " \t");
    request->command = end + (*end != '\0');
    char word[WORD_MAX];
    struct line_crc crc = {0, 0};
    if (!take_options(line, end, request, &crc, word)) {
        return refuse_option(request, word, message, message_bytes);
    }
    crc.computed = crc_update(crc.computed, request->command, strlen(request->command));
    if (request->framed && crc.given != crc.computed) {
        request->id = REQUEST_ID_NONE;  // possibly damaged
        return refuse(request, "wrong CRC-32 of the line: send it again", message, message_bytes,
                      ERROR_CRC);
    }
    if (request->exactly_once && (!request->framed || request->id == REQUEST_ID_NONE)) {
        return refuse(request, "once requires id=N and crc=HEX", message, message_bytes,
                      ERROR_SYNTAX);
    }
    return 0;
}
