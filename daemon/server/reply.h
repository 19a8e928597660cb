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
/// Lines before the answer have an "event": "progress", or "watch" after a "result". If the request
/// had a CRC, "crc" comes last: eight hexadecimal digits, the CRC-32 of the line up to `, "crc"`.
/// "units" after the result has the units of its numbers by their names, with dots between the
/// names of groups; once for all members of a list: "parts[].last".
#ifndef VERGENCE_DAEMON_SERVER_REPLY_H
#define VERGENCE_DAEMON_SERVER_REPLY_H

#include <stdint.h>
#include <stdio.h>

#include "console/command.h"
#include "daemon/base/json.h"
#include "daemon/server/output.h"
#include "daemon/server/request.h"

enum { REPLY_DEPTH_MAX = 8, REPLY_UNITS_BYTES = 2048, REPLY_PATH_BYTES = 160 };

/// Each thread that answers has one and uses it for one answer after the other.
struct reply {
    struct command_reply items;  ///< interface for commands, which write to it
    FILE *stream;                ///< writes to `output`
    struct output *output;
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

/// For answers without a CRC that go to `file`, which the caller closes.
void reply_open_file(struct reply *self, FILE *file);
/// For answers that go to outputs; reply_close frees it. False: out of memory.
bool reply_open(struct reply *self);
void reply_close(struct reply *self);

/// Begins an answer, which goes to `output` (NULL after reply_open_file). `request` is copied.
void reply_begin(struct reply *self, struct output *output, const struct request *request,
                 bool terminal);
/// Reports progress of a command as a bar, a line or an event; ignored after the first item and if
/// `total` is 0.
void reply_progress(struct reply *self, const char *what, uint32_t done, uint32_t total);
/// Ends the answer, with a human-readable `message` if `error` is not 0.
void reply_end(struct reply *self, int error, const char *message);
/// Ends one round of `watch`; `reply_begin` begins the next.
void reply_end_round(struct reply *self);

#endif
