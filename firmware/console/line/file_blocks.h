// SPDX-License-Identifier: Apache-2.0
/// Files in blocks, as the commands `files`, `fetch` and `send` exchange them with a client on
/// every instrument. A block has an offset and a CRC-32 (as in zlib), so that a client at a bad
/// line can ask for it again and continue after a broken connection.
#ifndef VERGENCE_CONSOLE_LINE_FILE_BLOCKS_H
#define VERGENCE_CONSOLE_LINE_FILE_BLOCKS_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "console/command.h"

#ifdef __cplusplus
extern "C" {
#endif

enum {
    FILES_NAME_MAX = 200,
    FILE_BLOCKS_MAX = 49152,     ///< bytes in a block that is fetched
    FILE_BLOCKS_DEFAULT = 3072,  ///< if the client names no maximum
    FILE_BLOCKS_SENT_NAME_MAX = 60,
    FILE_BLOCKS_SENT_MAX = 16 * 1024 * 1024,  ///< bytes of a file that is sent
    FILE_BLOCKS_TEXT_MAX = 400,  ///< Base64 of a block that is sent, so that it fits into a line
    FILE_BLOCKS_CRC_DIGITS = 8,
};

/// Arguments of `files`, `fetch` and `send`, without completions.
enum { FILES_DIRECTORY, FILES_AFTER, FILES_ARGUMENTS };
extern const struct command_argument file_blocks_files_arguments[FILES_ARGUMENTS];
enum { FETCH_NAME, FETCH_OFFSET, FETCH_BYTES, FETCH_ARGUMENTS };
extern const struct command_argument file_blocks_fetch_arguments[FETCH_ARGUMENTS];
enum { SEND_NAME, SEND_SIZE, SEND_CRC, SEND_OFFSET, SEND_BLOCK_CRC, SEND_DATA, SEND_ARGUMENTS };
extern const struct command_argument file_blocks_send_arguments[SEND_ARGUMENTS];

/// Why a file or session cannot have this name: it is empty, has a / or begins with a dot. Static
/// storage; NULL: it can.
const char *file_blocks_name_fault(const char *name);
/// The same for a new name, which must need no quotes at the console or in a shell: also only
/// letters, digits and - _ . + = , @, and no - at the beginning.
const char *file_blocks_new_name_fault(const char *name);

/// Parses eight hexadecimal digits. False: something else.
bool file_blocks_parse_crc(const char *text, uint32_t *crc);

/// Adds "crc", in eight hexadecimal digits, to an answer.
void file_blocks_reply_crc(const struct command_call *call, uint32_t crc);
/// Answers `files`: an entry, between the group "files" and its end.
void file_blocks_reply_entry(const struct command_call *call, const char *name, bool directory,
                             uint64_t bytes);
/// Answers `fetch` without an offset: length and CRC-32 of the whole file.
void file_blocks_reply_file(const struct command_call *call, uint64_t bytes, uint32_t crc);
/// Answers `fetch`: a block. `text` has room for BASE64_TEXT_BYTES(bytes).
void file_blocks_reply_block(const struct command_call *call, const void *data, size_t bytes,
                             char *text);
/// Answers `send`: how much of the file is here, and whether it is complete.
void file_blocks_reply_sent(const struct command_call *call, uint64_t have, bool whole);

/// What a call of `send` states.
struct file_blocks_sent {
    uint32_t crc;   ///< of the whole file
    bool is_block;  ///< else it announces the file
    size_t bytes;   ///< of the block
    uint8_t data[FILE_BLOCKS_TEXT_MAX];
};

/// Reads a call of `send`. ERROR_MISSING, ERROR_SYNTAX, ERROR_CRC with the call's message.
int file_blocks_take_sent(const struct command_call *call, struct file_blocks_sent *sent);

#ifdef __cplusplus
}
#endif

#endif
