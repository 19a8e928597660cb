// SPDX-License-Identifier: Apache-2.0
/// Optional prefix of a command: @ and options separated by commas, which select the form of the
/// answer. `@json,progress,crc=1A2B3C4D pan 3 side=left`.
///
///   json      answer with one JSON object on a line
///   text      answer with text: items, then OK or ERR NAME text
///   progress  long commands report progress, on separate lines
///   binary    bytes may follow the answer, as its item "bytes" says, or come before it in parts,
///             see reply.h: the client reads them
///   crc=H     must be last. CRC-32 of the line without this option and the blank after it: a line
///             with a wrong CRC is rejected. The answer has a CRC too, see reply.h
///
/// `@json` or `@text` without a command applies to all lines that follow.
#ifndef VERGENCE_CONSOLE_LINE_REQUEST_H
#define VERGENCE_CONSOLE_LINE_REQUEST_H

#include <stdbool.h>
#include <stddef.h>

#ifdef __cplusplus
extern "C" {
#endif

enum { REQUEST_PREFIX_MAX = 64 };

struct request {
    bool json, progress, framed, binary;
    const char *command;  ///< the rest of the line
};

/// Parses the prefix of a line. The caller sets `request` to the options that apply to the whole
/// connection; it receives those of this line and `command`, which points into `line`. 0, or
/// ERROR_SYNTAX or ERROR_CRC with `message`; `request` then has the options parsed so far, for the
/// answer.
int request_parse(const char *line, struct request *request, char *message, size_t message_bytes);

#ifdef __cplusplus
}
#endif

#endif
