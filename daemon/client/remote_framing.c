// SPDX-License-Identifier: Apache-2.0
#include "daemon/client/remote_framing.h"

#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/crc.h"
#include "core/invariant.h"
#include "daemon/client/remote.h"

enum { CRC_DIGITS = 8 };

static const char json_mark[] = ", \"crc\": \"";

bool remote_framing_request(const char *words, const char *command, char *request) {
    const int begun = snprintf(request, REMOTE_REQUEST_BYTES, "\r@%s,", words);
    INVARIANT(begun > 0 && begun < REMOTE_REQUEST_BYTES);
    // The CRC covers neither itself nor what comes before and after the line.
    uint32_t crc = crc_update(0, request + 1, (size_t)begun - 1);
    crc = crc_update(crc, command, strlen(command));
    const size_t room = REMOTE_REQUEST_BYTES - (size_t)begun;
    const int rest = snprintf(request + begun, room, "crc=%08" PRIX32 " %s\n", crc, command);
    return rest > 0 && (size_t)rest < room;
}

/// Eight hexadecimal digits of either case, as written by the daemon and others.
static bool read_crc(const char *text, uint32_t *crc) {
    if (strspn(text, "0123456789ABCDEFabcdef") < CRC_DIGITS) {
        return false;
    }
    char digits[CRC_DIGITS + 1];
    memcpy(digits, text, CRC_DIGITS);
    digits[CRC_DIGITS] = '\0';
    *crc = (uint32_t)strtoul(digits, NULL, 16);
    return true;
}

/// Start of the CRC in a line of JSON; NULL: none.
static const char *find_json(const char *line) {
    const size_t length = strlen(line);
    const size_t bytes = sizeof json_mark - 1 + CRC_DIGITS + 2;
    const char *crc_text = length > bytes ? line + length - bytes : NULL;
    const bool found = crc_text != NULL &&
                       strncmp(crc_text, json_mark, sizeof json_mark - 1) == 0 &&
                       strcmp(line + length - 2, "\"}") == 0;
    return found ? crc_text : NULL;
}

bool remote_framing_fits_json(const char *line) {
    const char *crc_text = find_json(line);
    uint32_t crc = 0;
    return crc_text != NULL && read_crc(crc_text + sizeof json_mark - 1, &crc) &&
           crc == crc_update(0, line, (size_t)(crc_text - line));
}

void remote_framing_strip_json(char *line) {
    const char *crc_text = find_json(line);
    INVARIANT(crc_text != NULL);
    strcpy(line + (crc_text - line), "}");
}

enum remote_framing remote_framing_take_text(char *line, uint32_t crc) {
    const size_t length = strlen(line);
    char *const begin = strrchr(line, '#');
    if (begin == NULL || begin == line || begin[-1] != ' ' || length < CRC_DIGITS + 1) {
        return REMOTE_FRAMING_NONE;
    }
    const char *const digits = line + length - CRC_DIGITS;
    uint32_t stated = 0;
    if (digits != begin + 1 || !read_crc(digits, &stated)) {
        return REMOTE_FRAMING_NONE;
    }
    if (crc_update(crc, line, (size_t)(digits - line)) != stated) {
        return REMOTE_FRAMING_DAMAGED;
    }
    begin[-1] = '\0';
    return REMOTE_FRAMING_WHOLE;
}
