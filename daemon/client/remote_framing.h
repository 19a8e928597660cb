// SPDX-License-Identifier: Apache-2.0
/// CRC-32 framing of lines on a connection that may damage them, in both directions; the format is
/// in daemon/server/request.h and reply.h.
#ifndef VERGENCE_DAEMON_CLIENT_REMOTE_FRAMING_H
#define VERGENCE_DAEMON_CLIENT_REMOTE_FRAMING_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

enum remote_framing {
    REMOTE_FRAMING_NONE,     ///< the line has no CRC
    REMOTE_FRAMING_DAMAGED,  ///< the CRC does not match
    REMOTE_FRAMING_WHOLE
};

/// Writes the request line for `command` with the options `words` (of request.h) and a CRC. Its
/// first byte ends any garbage before it. `request` has REMOTE_REQUEST_BYTES. False: it does not
/// fit.
bool remote_framing_request(const char *words, const char *command, char *request);

/// Whether the CRC of a line of JSON matches.
bool remote_framing_fits_json(const char *line);
/// Removes the CRC from a line of JSON whose CRC matches.
void remote_framing_strip_json(char *line);

/// Removes the CRC from the last line of a text answer. `crc` is that of the lines before it.
enum remote_framing remote_framing_take_text(char *line, uint32_t crc);

#ifdef __cplusplus
}
#endif

#endif
