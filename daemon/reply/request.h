// SPDX-License-Identifier: Apache-2.0
/// What may stand before a command: @ and words with commas between, which say how the answer is
/// wanted. `@json,id=7,progress,crc=1A2B3C4D pan left 3`.
///
///   json      one JSON object on a line (text: items, then OK or ERR code text)
///   text      the other way round, where a connection has asked for JSON
///   progress  long commands tell how far they are, in lines of their own
///   id=N      the answer carries the number (0 .. 999999999): in JSON, and where it is sealed
///   once      with id and crc, on a line that began with `@sealed`: the same number again means
///             that the answer was lost on its way, which is repeated; nothing is carried out again
///   crc=H     the last word: CRC-32 of the line without it and the blank behind it. A line with
///             another one is refused, and the answer carries its own CRC; see reply.h
///
/// `@json` alone holds for all lines that follow, and so does `@text`.
#ifndef VERGENCE_DAEMON_REPLY_REQUEST_H
#define VERGENCE_DAEMON_REPLY_REQUEST_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

enum { REQUEST_PREFIX_MAX = 64, REQUEST_ID_NONE = -1 };

struct request {
    bool json, progress, sealed, once;
    int32_t id;           ///< REQUEST_ID_NONE: it has none, or it may be a damaged one
    const char *command;  ///< the rest of the line
};

/// Takes the prefix off a line. `request` holds what the connection has asked for before and gets
/// what holds for this line. 0; ERROR_SYNTAX or ERROR_CRC with a sentence in `message`; the answer
/// is then wanted as far as the prefix was understood.
int request_parse(const char *line, struct request *request, char *message, size_t message_bytes);

#ifdef __cplusplus
}
#endif

#endif
