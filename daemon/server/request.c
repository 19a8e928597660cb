// SPDX-License-Identifier: Apache-2.0
#include "daemon/server/request.h"

#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "console/command_text.h"
#include "core/crc.h"
#include "core/error.h"
#include "daemon/base/framing.h"

enum { WORD_MAX = 24, CRC_DIGITS = 8 };

static const char crc_option[] = "crc=";

static bool is_crc(const char *option, size_t bytes) {
    const size_t prefix = sizeof crc_option - 1;
    return bytes == prefix + CRC_DIGITS && memcmp(option, crc_option, prefix) == 0 &&
           strspn(option + prefix, "0123456789ABCDEFabcdef") == CRC_DIGITS;
}

/// Checks the CRC of a line whose last option begins at `option`. 0, or ERROR_CRC with a message.
static int check_crc(const char *line, const char *option, const struct request *request,
                     char *message, size_t message_bytes) {
    uint32_t crc = crc_update(0, line, (size_t)(option - line));
    crc = crc_update(crc, request->command, strlen(request->command));
    if (strtoul(option + sizeof crc_option - 1, NULL, 16) == crc) {
        return ERROR_OK;
    }
    snprintf(message, message_bytes, FRAMING_DAMAGED ": send it again");
    return ERROR_CRC;
}

/// Takes an option other than crc. 0, or ERROR_SYNTAX with a message.
static int take_option(const char *option, size_t bytes, struct request *request, char *message,
                       size_t message_bytes) {
    char word[WORD_MAX] = "";
    memcpy(word, option, bytes < WORD_MAX ? bytes : WORD_MAX - 1);
    if (strcmp(word, "json") == 0 || strcmp(word, "text") == 0) {
        request->json = word[0] == 'j';
        return ERROR_OK;
    }
    if (strcmp(word, "progress") == 0) {
        request->progress = true;
        return ERROR_OK;
    }
    if (strcmp(word, "binary") == 0) {
        request->binary = true;
        return ERROR_OK;
    }
    struct command_text text = command_text_begin(message, message_bytes);
    command_text_add(&text, "invalid option \"");
    command_text_add_typed(&text, word);
    command_text_add(
        &text, "\" after @ (expected json, text, progress, binary, or as the last one crc=HEX)");
    return ERROR_SYNTAX;
}

int request_parse(const char *line, struct request *request, char *message, size_t message_bytes) {
    request->framed = false;
    request->binary = false;
    request->command = line;
    message[0] = '\0';
    if (*line != '@') {
        return 0;
    }
    const char *end = line + strcspn(line, " \t");
    request->command = end + (*end != '\0');
    const char *comma = memrchr(line, ',', (size_t)(end - line));
    const char *last = comma != NULL ? comma + 1 : line + 1;
    if (is_crc(last, (size_t)(end - last))) {
        request->framed = true;
        end = last - 1;
    }
    int error = 0;
    for (const char *at = line + 1; error == ERROR_OK && at <= end;) {
        const size_t bytes = strcspn(at, ", \t");
        error = take_option(at, bytes, request, message, message_bytes);
        at += bytes + 1;
    }
    // A damaged line may have damaged options; those before the damage select the answer's form.
    const int damaged =
        request->framed ? check_crc(line, last, request, message, message_bytes) : 0;
    return damaged != 0 ? damaged : error;
}
