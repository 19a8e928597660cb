// SPDX-License-Identifier: Apache-2.0
/// Answers as text for people or as JSON for programs.
///
/// Text: `key: value unit` a line, what belongs together indented; then `OK`, or `ERR NAME text`
/// with a name of core/error.h, or between the rounds of a watch an empty line. Where the request
/// was sealed a blank, #, its id and a comma if it had one, and eight digits follow: the CRC-32 of
/// the answer, or of the round, before them. Where progress was asked for, lines
/// `... what done/total` come first, and have no seal. JSON, one object a line:
///
///   {"result": {...}, "ok": true, "error": "OK", "code": 0, "message": ""}
///
/// with "id" first where the request had one, "event" instead of "result" for what comes before the
/// answer ("progress", "watch"), and "crc" last where the request was sealed: eight digits, the
/// CRC-32 of the line before `, "crc"`. Units of the result's numbers are in "units" behind it, by
/// the names of the items, those of groups with dots between; of a list's members once for all of
/// them: "parts[].last".
#ifndef VERGENCE_DAEMON_REPLY_REPLY_H
#define VERGENCE_DAEMON_REPLY_REPLY_H

#include <stdint.h>
#include <stdio.h>

#include "console/command.h"
#include "daemon/base/json.h"
#include "daemon/reply/output.h"
#include "daemon/reply/request.h"

#ifdef __cplusplus
extern "C" {
#endif

enum { REPLY_DEPTH_MAX = 8, REPLY_UNITS_BYTES = 2048, REPLY_PATH_BYTES = 160 };

/// One at a time for each thread that answers; used again for each answer.
struct reply {
    struct command_reply items;  ///< what commands write to
    FILE *stream;                ///< into `output`
    struct output *output;
    struct request request;
    bool terminal;  ///< lines end in CR LF; progress is a bar
    struct json json;
    bool begun;      ///< the result
    bool keeps;      ///< what is written is to be had again
    bool bar_shown;  ///< a bar is to be wiped
    uint32_t crc;    ///< of the line so far
    int depth;
    bool array[REPLY_DEPTH_MAX + 1];    ///< this group is one
    bool in_line[REPLY_DEPTH_MAX + 1];  ///< its items stand on one line of text
    bool first[REPLY_DEPTH_MAX + 1];
    size_t path_end[REPLY_DEPTH_MAX + 1];
    char path[REPLY_PATH_BYTES];
    char units[REPLY_UNITS_BYTES];  ///< "path\0unit\0" in a row
    size_t units_length;
};

/// False: no memory.
bool reply_open(struct reply *self);
void reply_close(struct reply *self);

/// Begins an answer.
void reply_begin(struct reply *self, struct output *output, const struct request *request,
                 bool terminal);
/// How far a command is; only before its first item, as a bar or as an event.
void reply_progress(struct reply *self, const char *what, uint32_t done, uint32_t total);
/// Ends it; `message` for people in case of an error.
void reply_end(struct reply *self, int error, const char *message);
/// Ends one round of a command that is repeated; `reply_begin` begins the next.
void reply_end_round(struct reply *self);

#ifdef __cplusplus
}
#endif

#endif
