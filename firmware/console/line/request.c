// SPDX-License-Identifier: Apache-2.0
#include "console/line/request.h"

#include <stdint.h>
#include <string.h>

#include "console/command_text.h"
#include "console/line/framing.h"
#include "core/crc.h"
#include "core/error.h"

enum { WORD_MAX = 24, CRC_DIGITS = 8 };

static const char crc_option[] = "crc=";

static int hex_digit(char c) {
    const int letter = c | 0x20;
    if (c >= '0' && c <= '9') {
        return c - '0';
    }
    return letter >= 'a' && letter <= 'f' ? letter - 'a' + 10 : -1;
}

/// Reads an option that is a CRC. False: it is another one.
static bool read_crc(const char *option, size_t bytes, uint32_t *crc) {
    const size_t prefix = sizeof crc_option - 1;
    if (bytes != prefix + CRC_DIGITS || memcmp(option, crc_option, prefix) != 0) {
        return false;
    }
    *crc = 0;
    for (size_t i = prefix; i < bytes; i++) {
        const int digit = hex_digit(option[i]);
        if (digit < 0) {
            return false;
        }
        *crc = *crc << 4 | (uint32_t)digit;
    }
    return true;
}

/// Checks the CRC of a line whose last option, the CRC `stated`, begins at `option`. 0, or
/// ERROR_CRC with a message.
static int check_crc(const char *line, const char *option, uint32_t stated,
                     const struct request *request, char *message, size_t message_bytes) {
    uint32_t crc = crc_update(0, line, (size_t)(option - line));
    crc = crc_update(crc, request->command, strlen(request->command));
    if (stated == crc) {
        return ERROR_OK;
    }
    struct command_text text = command_text_begin(message, message_bytes);
    command_text_add(&text, FRAMING_DAMAGED ": send it again");
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
    const char *last = end;
    while (last > line + 1 && last[-1] != ',') {
        last--;
    }
    uint32_t crc = 0;
    if (read_crc(last, (size_t)(end - last), &crc)) {
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
        request->framed ? check_crc(line, last, crc, request, message, message_bytes) : 0;
    return damaged != 0 ? damaged : error;
}
