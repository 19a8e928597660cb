// SPDX-License-Identifier: Apache-2.0
/// Lines with a CRC between the daemon and a client at a serial line, which may lose and change
/// bytes (`@framed`). Formats: request.h and reply.h.
#ifndef VERGENCE_CONSOLE_LINE_FRAMING_H
#define VERGENCE_CONSOLE_LINE_FRAMING_H

enum {
    FRAMING_IDLE = 0x16,     ///< SYN, sent at any position: a command is running
    FRAMING_IDLE_MS = 200,   ///< interval between two of these bytes
    FRAMING_QUIET_MS = 500,  ///< no byte for so long: nothing runs, and no answer is on its way
    /// ETB, sent like SYN by an instrument that has no timer for keepalives: it computes, and until
    /// its next byte only a silence of FRAMING_BUSY_MS means that it is gone. A simulated processor
    /// is much slower than its own clock.
    FRAMING_BUSY = 0x17,
    FRAMING_BUSY_MS = 120000,
};

/// Beginning of the message of ERROR_CRC to a line that was not run because it arrived damaged.
#define FRAMING_DAMAGED "no valid CRC-32 in the line"

#endif
