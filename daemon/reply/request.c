// SPDX-License-Identifier: Apache-2.0
#include "daemon/reply/request.h"

#include <string.h>

#include "console/command_text.h"
#include "console/command_words.h"
#include "core/crc.h"
#include "core/error.h"
#include "core/invariant.h"

enum { WORD_MAX = 24, ID_MOST = 999999999 };

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
        number > ID_MOST) {
        return false;
    }
    *id = (int32_t)number;
    return true;
}

/// One word of the prefix but crc; false: there is no such word.
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
        request->once = true;
    } else {
        return false;
    }
    return true;
}

/// What is not carried out is not repeated either.
static int refuse(struct request *request, const char *why, const char *word, char *message,
                  size_t bytes, int error) {
    struct command_text sentence = command_text_begin(message, bytes);
    request->once = false;
    command_text_add(&sentence, why);
    if (word != NULL) {
        command_text_add(&sentence, " \"");
        command_text_add_typed(&sentence, word);
        command_text_add(&sentence, "\"");
    }
    return error;
}

int request_parse(const char *line, struct request *request, char *message, size_t message_bytes) {
    request->id = REQUEST_ID_NONE;
    request->sealed = false;
    request->once = false;
    request->command = line;
    message[0] = '\0';
    if (*line != '@') {
        return 0;
    }
    const char *at = line + 1;
    const size_t prefix = strcspn(at, " \t");
    request->command = at + prefix + (at[prefix] != '\0');
    const char *const end = at + prefix;
    uint32_t crc = 0;
    uint32_t right_crc = 0;
    while (at <= end) {
        size_t bytes = (size_t)(end - at);
        const char *comma = memchr(at, ',', bytes);
        bytes = comma != NULL ? (size_t)(comma - at) : bytes;
        char word[WORD_MAX] = "";
        const bool fits = bytes < sizeof word;
        memcpy(word, at, fits ? bytes : sizeof word - 1);
        if (fits && comma == NULL && strncmp(word, "crc=", 4) == 0 && parse_hex8(word + 4, &crc)) {
            request->sealed = true;
            right_crc = crc_update(0, line, (size_t)(at - line));
        } else if (!fits || !take_word(word, request)) {
            return refuse(
                request,
                "what stands behind @ must be json, text, progress, once, id=N, or at the "
                "end crc=HEX, not",
                word, message, message_bytes, ERROR_SYNTAX);
        }
        at += bytes + 1;
    }
    INVARIANT(request->command >= line);
    right_crc = crc_update(right_crc, request->command, strlen(request->command));
    if (request->sealed && crc != right_crc) {
        request->id = REQUEST_ID_NONE;  // it may have been another one
        return refuse(request, "the line was damaged on its way: send it again", NULL, message,
                      message_bytes, ERROR_CRC);
    }
    if (request->once && (!request->sealed || request->id == REQUEST_ID_NONE)) {
        return refuse(request, "once needs id=N and crc=HEX", NULL, message, message_bytes,
                      ERROR_SYNTAX);
    }
    return 0;
}
