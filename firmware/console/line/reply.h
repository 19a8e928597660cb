// SPDX-License-Identifier: Apache-2.0
/// Answers as text for people or as JSON for programs.
///
/// Text: one `key: value unit` a line, groups indented; then `OK`, or `ERR NAME text` with a name
/// of core/error.h; after a round of `watch` an empty line. If the request had a CRC, the last line
/// ends with a blank, `#` and eight hexadecimal digits: the CRC-32 of the answer, or of the round,
/// before them. If progress was requested, lines `... what done/total` come first, without a CRC.
/// JSON, one object a line:
///
///   {"result": {...}, "ok": true, "error": "OK", "code": 0, "message": ""}
///
/// Lines before the answer have an "event": "progress", or "watch" after a "result". If bytes were
/// requested, they may come in parts before the answer, each after a line `... bytes N`, or the
/// event "bytes" with the number "bytes", at most REPLY_BYTES_MAX. If the request
/// had a CRC, "crc" comes last: eight hexadecimal digits, the CRC-32 of the line up to `, "crc"`.
/// "units" after the result has the units of its numbers by their names, with dots between the
/// names of groups; once for all members of a list: "parts[].last".
#ifndef VERGENCE_CONSOLE_LINE_REPLY_H
#define VERGENCE_CONSOLE_LINE_REPLY_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "console/command.h"
#include "console/line/request.h"
#include "core/json.h"

#ifdef __cplusplus
extern "C" {
#endif

enum {
    REPLY_DEPTH_MAX = 8,
    REPLY_UNITS_BYTES = 2048,
    REPLY_PATH_BYTES = 160,
    REPLY_PART_BYTES = 512,
    REPLY_BYTES_MAX = 32768,
};

/// Progress of a command that waits; the name of the other client's command follows.
#define REPLY_WAITING "waiting for another client's "

/// Where the bytes of an answer go.
struct reply_sink {
    void (*put)(void *self, const void *data, size_t bytes);
    void *self;
};

/// Each thread that answers has one and uses it for one answer after the other.
struct reply {
    struct command_reply items;  ///< interface for commands, which write to it
    struct reply_sink sink;
    char part[REPLY_PART_BYTES];  ///< bytes on their way to the sink
    size_t part_bytes;
    struct request request;
    bool terminal;  ///< lines end in CR LF; progress is a bar
    struct json json;
    bool begun;       ///< the result was begun
    int bar_columns;  ///< width of the bar on the terminal, to be erased; 0: none
    uint32_t crc;     ///< CRC of the line (text: of the answer) so far
    int depth;
    bool array[REPLY_DEPTH_MAX + 1];    ///< the group is an array
    bool in_line[REPLY_DEPTH_MAX + 1];  ///< the group's items share one line of text
    bool first[REPLY_DEPTH_MAX + 1];
    size_t path_end[REPLY_DEPTH_MAX + 1];
    char path[REPLY_PATH_BYTES];
    char units[REPLY_UNITS_BYTES];  ///< sequence of "path\0unit\0"
    size_t units_length;
};

void reply_init(struct reply *self);

/// Begins an answer, which goes to `sink`. `sink` and `request` are copied.
void reply_begin(struct reply *self, const struct reply_sink *sink, const struct request *request,
                 bool terminal);
/// Reports progress of a command as a bar, a line or an event; ignored after the first item and if
/// `total` is 0.
void reply_progress(struct reply *self, const char *what, uint32_t done, uint32_t total);
/// Sends bytes, at most REPLY_BYTES_MAX, before the first item. The request has `binary`.
void reply_bytes(struct reply *self, const void *data, size_t bytes);
/// Ends the answer, with a human-readable `message` if `error` is not 0.
void reply_end(struct reply *self, int error, const char *message);
/// Ends one round of `watch`; `reply_begin` begins the next.
void reply_end_round(struct reply *self);

#ifdef __cplusplus
}
#endif

#endif
