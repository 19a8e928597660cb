// SPDX-License-Identifier: Apache-2.0
/// Reports the daemon's state to the service manager (sd_notify protocol: datagrams to the socket
/// that NOTIFY_SOCKET names).
#ifndef VERGENCE_DAEMON_SERVER_NOTIFY_H
#define VERGENCE_DAEMON_SERVER_NOTIFY_H

#include <stdint.h>

/// Reads whether a service manager expects reports. Call before the process confines itself.
void notify_open(void);

/// Heartbeat period: 1 s, or half the service manager's limit if that is shorter (WATCHDOG_USEC,
/// unless WATCHDOG_PID names another process), but at least 10 ms.
uint64_t notify_period_us(void);

/// Sends a line such as "READY=1". Does nothing without a service manager; never blocks.
void notify_send(const char *state);

#endif
