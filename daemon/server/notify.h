// SPDX-License-Identifier: Apache-2.0
/// Tells the service manager how the daemon stands (sd_notify's protocol: a datagram to the socket
/// that NOTIFY_SOCKET names).
#ifndef VERGENCE_DAEMON_SERVER_NOTIFY_H
#define VERGENCE_DAEMON_SERVER_NOTIFY_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/// Finds out whether somebody wants to know; before the process confines itself.
void notify_open(void);

/// How often a sign of life is due: each second, or twice in the time after which the manager gives
/// this process up (WATCHDOG_USEC, unless WATCHDOG_PID names another one), but not more often than
/// each 10 ms.
uint64_t notify_period_us(void);

/// Sends a line such as "READY=1". Nothing happens when nobody wants to know; never waits.
void notify_send(const char *state);

#ifdef __cplusplus
}
#endif

#endif
