// SPDX-License-Identifier: Apache-2.0
/// TFTP (RFC 1350, with the options blksize of RFC 2348 and tsize of RFC 2349): the transfer that
/// the boot loader of a board has too, so that a server is there. Nothing is authenticated or
/// encrypted.
#ifndef VERGENCE_DAEMON_SYSTEM_TFTP_H
#define VERGENCE_DAEMON_SYSTEM_TFTP_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "daemon/base/message.h"

#ifdef __cplusplus
extern "C" {
#endif

enum { TFTP_NAME_BYTES = 256 };

/// A file of a server: tftp:HOST/NAME, or tftp:HOST:PORT/NAME. HOST is an IPv4 address.
struct tftp_address {
    uint32_t host;  ///< address in network byte order, as is `port`
    uint16_t port;
    char name[TFTP_NAME_BYTES];  ///< "": none
    char text[TFTP_NAME_BYTES];  ///< all of it, for messages
};

/// What a transfer reports and asks; `self` goes to both.
struct tftp_observer {
    void (*progress)(void *self, uint64_t done, uint64_t total);
    bool (*should_stop)(void *self);
    void *self;
};

/// Whether a word begins with "tftp:".
bool tftp_is_address(const char *word);

/// 0, or ERROR_ARGUMENT with a message.
int tftp_parse(const char *text, struct tftp_address *address, struct message *message);

/// Writes a file of `bytes` bytes to the server. 0 once the server has confirmed all of it; with a
/// message ERROR_TIMEOUT: no answer; ERROR_CANCELLED; ERROR_IO, ERROR_MISSING, ERROR_REFUSED or
/// ERROR_FULL: of the server, or the file cannot be read. After an error the server may have a
/// part.
int tftp_put(const struct tftp_address *address, int fd, uint64_t bytes,
             const struct tftp_observer *observer, struct message *message);

/// Reads a file of the server into memory. 0 with its size in `*bytes`, or the same errors;
/// ERROR_TOO_LARGE: more than `capacity` bytes.
int tftp_get(const struct tftp_address *address, uint8_t *data, size_t capacity, size_t *bytes,
             const struct tftp_observer *observer, struct message *message);

#ifdef __cplusplus
}
#endif

#endif
