// SPDX-License-Identifier: Apache-2.0
/// Checks an image of the board, a FIT as U-Boot's mkimage makes it: a flattened device tree with
/// kernel, files and device tree below /images, each with its data and a SHA-256 sum; and in the
/// root the properties `timestamp` and `board`. Reads only what that needs.
#ifndef VERGENCE_DAEMON_SYSTEM_FIT_H
#define VERGENCE_DAEMON_SYSTEM_FIT_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "daemon/base/message.h"

#ifdef __cplusplus
extern "C" {
#endif

enum { FIT_BOARD_BYTES = 64, FIT_HEADER_BYTES = 40, FIT_TIME_BYTES = 32 };

struct fit {
    size_t bytes;        ///< size of the whole image
    uint32_t timestamp;  ///< time at which the image was made, in s since 1970
    char board[FIT_BOARD_BYTES];
    unsigned parts;
};

/// Whether data begins with the header of a FIT, of `*bytes` bytes in all.
bool fit_begins(const uint8_t header[FIT_HEADER_BYTES], size_t *bytes);

/// Checks the image at the beginning of `capacity` bytes, with all its sums. 0; ERROR_SYNTAX: not a
/// FIT, or damaged; ERROR_MISSING: without a needed part; ERROR_CRC: a sum differs; with a message.
int fit_check(const uint8_t *data, size_t capacity, struct fit *fit, struct message *message);

/// When an image was made, "2026-01-31 12:00:00 UTC".
void fit_time_text(uint32_t timestamp, char text[FIT_TIME_BYTES]);

#ifdef __cplusplus
}
#endif

#endif
