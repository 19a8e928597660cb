// SPDX-License-Identifier: Apache-2.0
#include "console/line/file_blocks.h"

#include <string.h>

#include "core/base64.h"
#include "core/crc.h"
#include "core/error.h"

const struct command_argument file_blocks_files_arguments[FILES_ARGUMENTS] = {
    [FILES_DIRECTORY] = {.name = "DIRECTORY",
                         .kind = COMMAND_TEXT,
                         .min = 1,
                         .max = FILES_NAME_MAX,
                         .optional = true,
                         .help = "a directory in \"files\"; default: \"files\" itself"},
    [FILES_AFTER] = {.name = "after",
                     .kind = COMMAND_TEXT,
                     .value_name = "NAME",
                     .min = 1,
                     .max = FILES_NAME_MAX,
                     .help = "list only names after this one"},
};

const struct command_argument file_blocks_fetch_arguments[FETCH_ARGUMENTS] = {
    [FETCH_NAME] = {.name = "NAME",
                    .kind = COMMAND_TEXT,
                    .min = 1,
                    .max = FILES_NAME_MAX,
                    .help = "path of the file below \"files\""},
    [FETCH_OFFSET] = {.name = "offset",
                      .kind = COMMAND_INTEGER,
                      .unit = "bytes",
                      .min = 0,
                      .max = 1e15,
                      .help = "start of the block; default: report length and CRC-32 of the whole "
                              "file"},
    [FETCH_BYTES] = {.name = "bytes",
                     .kind = COMMAND_INTEGER,
                     .unit = "bytes",
                     .min = 1,
                     .max = FILE_BLOCKS_MAX,
                     .help = "maximum size of the block; default: 3072"},
};

const struct command_argument file_blocks_send_arguments[SEND_ARGUMENTS] = {
    [SEND_NAME] =
        {.name = "NAME",
         .kind = COMMAND_TEXT,
         .min = 1,
         .max = FILE_BLOCKS_SENT_NAME_MAX,
         .help = "name of the file on the instrument, without /; an existing file is replaced"},
    [SEND_SIZE] = {.name = "SIZE",
                   .kind = COMMAND_INTEGER,
                   .unit = "bytes",
                   .min = 0,
                   .max = FILE_BLOCKS_SENT_MAX,
                   .help = "size of the whole file"},
    [SEND_CRC] = {.name = "CRC",
                  .kind = COMMAND_TEXT,
                  .min = FILE_BLOCKS_CRC_DIGITS,
                  .max = FILE_BLOCKS_CRC_DIGITS,
                  .help = "CRC-32 of the whole file, eight hexadecimal digits"},
    [SEND_OFFSET] = {.name = "offset",
                     .kind = COMMAND_INTEGER,
                     .unit = "bytes",
                     .min = 0,
                     .max = FILE_BLOCKS_SENT_MAX,
                     .help = "start of the block; default: report how much was received"},
    [SEND_BLOCK_CRC] = {.name = "block-crc",
                        .value_name = "CRC",
                        .kind = COMMAND_TEXT,
                        .min = FILE_BLOCKS_CRC_DIGITS,
                        .max = FILE_BLOCKS_CRC_DIGITS,
                        .help = "CRC-32 of the block, eight hexadecimal digits"},
    [SEND_DATA] = {.name = "data",
                   .value_name = "BASE64",
                   .kind = COMMAND_TEXT,
                   .min = 4,
                   .max = FILE_BLOCKS_TEXT_MAX,
                   .help = "the block in Base64"},
};

const char *file_blocks_name_fault(const char *name) {
    return name[0] == '\0' || name[0] == '.' || strchr(name, '/') != NULL
               ? "not a plain name (no /, no dot at the beginning)"
               : NULL;
}

const char *file_blocks_new_name_fault(const char *name) {
    static const char good[] =
        "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789-_.+=,@";
    const char *fault = file_blocks_name_fault(name);
    if (fault != NULL) {
        return fault;
    }
    if (name[0] == '-') {
        return "not a plain name (no - at the beginning: it would be an option of the programs "
               "that read it)";
    }
    if (name[strspn(name, good)] != '\0') {
        return "invalid character (allowed: A-Z a-z 0-9 - _ . + = , @)";
    }
    return NULL;
}

bool file_blocks_parse_crc(const char *text, uint32_t *crc) {
    static const char digits[] = "0123456789ABCDEF0123456789abcdef";
    *crc = 0;
    for (int i = 0; i < FILE_BLOCKS_CRC_DIGITS; i++) {
        const char *digit = text[i] != '\0' ? strchr(digits, text[i]) : NULL;
        if (digit == NULL) {
            return false;
        }
        *crc = *crc << 4 | ((uint32_t)(digit - digits) & 0xF);
    }
    return text[FILE_BLOCKS_CRC_DIGITS] == '\0';
}

void file_blocks_reply_crc(const struct command_call *call, uint32_t crc) {
    static const char digits[] = "0123456789ABCDEF";
    char text[FILE_BLOCKS_CRC_DIGITS + 1];
    for (int i = FILE_BLOCKS_CRC_DIGITS - 1; i >= 0; i--, crc >>= 4) {
        text[i] = digits[crc & 0xF];
    }
    text[FILE_BLOCKS_CRC_DIGITS] = '\0';
    reply_text(call, "crc", text);
}

void file_blocks_reply_entry(const struct command_call *call, const char *name, bool directory,
                             uint64_t bytes) {
    reply_group_begin(call, NULL, false);
    reply_text(call, directory ? "directory" : "file", name);
    if (!directory) {
        reply_number(call, "size", (double)bytes, 0, "bytes");
    }
    reply_group_end(call);
}

void file_blocks_reply_file(const struct command_call *call, uint64_t bytes, uint32_t crc) {
    reply_number(call, "size", (double)bytes, 0, "bytes");
    file_blocks_reply_crc(call, crc);
}

void file_blocks_reply_block(const struct command_call *call, const void *data, size_t bytes,
                             char *text) {
    reply_number(call, "offset", call->values[FETCH_OFFSET].number, 0, "bytes");
    reply_number(call, "bytes", (double)bytes, 0, NULL);
    file_blocks_reply_crc(call, crc_update(0, data, bytes));
    base64_encode(data, bytes, text);
    reply_text(call, "data", text);
}

void file_blocks_reply_sent(const struct command_call *call, uint64_t have, bool whole) {
    reply_number(call, "have", (double)have, 0, "bytes");
    reply_text(call, "whole", whole ? "yes" : "no");
}

static int refuse(const struct command_call *call, int error, const char *why) {
    struct command_text sentence = command_text_begin(call->message, call->message_bytes);
    command_text_add(&sentence, why);
    return error;
}

int file_blocks_take_sent(const struct command_call *call, struct file_blocks_sent *sent) {
    const struct command_value *values = call->values;
    sent->is_block = values[SEND_OFFSET].given;
    sent->bytes = 0;
    if (values[SEND_BLOCK_CRC].given != sent->is_block ||
        values[SEND_DATA].given != sent->is_block) {
        return refuse(call, ERROR_MISSING,
                      "send: a block needs offset=, block-crc= and data= together");
    }
    if (!file_blocks_parse_crc(values[SEND_CRC].text, &sent->crc)) {
        return refuse(call, ERROR_SYNTAX, "send: CRC: not eight hexadecimal digits");
    }
    if (!sent->is_block) {
        return ERROR_OK;
    }
    uint32_t crc = 0;
    const long bytes = base64_decode(values[SEND_DATA].text, sent->data, sizeof sent->data);
    if (bytes < 0 || !file_blocks_parse_crc(values[SEND_BLOCK_CRC].text, &crc) ||
        crc_update(0, sent->data, (size_t)bytes) != crc) {
        return refuse(call, ERROR_CRC, "wrong CRC-32 of the block: send it again");
    }
    sent->bytes = (size_t)bytes;
    return ERROR_OK;
}
