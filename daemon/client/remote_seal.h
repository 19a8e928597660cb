// SPDX-License-Identifier: Apache-2.0
/// What goes over a line that may damage it carries a CRC-32, in both directions; see
/// daemon/reply/request.h and reply.h for the form.
#ifndef VERGENCE_DAEMON_CLIENT_REMOTE_SEAL_H
#define VERGENCE_DAEMON_CLIENT_REMOTE_SEAL_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

enum remote_seal {
    REMOTE_SEAL_NONE,     ///< the line has none
    REMOTE_SEAL_DAMAGED,  ///< it does not belong to what stands before it
    REMOTE_SEAL_WHOLE
};

enum { REMOTE_SEAL_NO_ID = -1 };

/// Writes the line that asks for `command` in the way that `words` (of request.h) say, sealed. Its
/// first byte ends whatever the line has made up before. `request` has REMOTE_REQUEST_BYTES. False:
/// there is no room for it.
bool remote_seal_request(const char *words, const char *command, char *request);

/// Whether a line of JSON is as it was sent.
bool remote_seal_fits_json(const char *line);
/// Takes id and seal, which are the line's business alone, out of a line of JSON whose seal fits.
void remote_seal_strip_json(char *line);

/// Takes the seal off the last line of an answer in text. `crc` is that of the lines before it;
/// `*id` the number that the seal tells, or REMOTE_SEAL_NO_ID.
enum remote_seal remote_seal_take_text(char *line, uint32_t crc, int32_t *id);

#ifdef __cplusplus
}
#endif

#endif
