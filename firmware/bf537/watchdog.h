// SPDX-License-Identifier: Apache-2.0
/// The processor's watchdog: a program that stops is restarted.
#ifndef VERGENCE_BF537_WATCHDOG_H
#define VERGENCE_BF537_WATCHDOG_H

/// Starts it: the program feeds it at least every two seconds.
void bf537_watchdog_start(void);
void bf537_watchdog_feed(void);
/// What made the last restart: the watchdog, a double fault, or neither. Static storage. To be read
/// before bf537_watchdog_start.
const char *bf537_watchdog_restart_text(void);
/// Lets it restart the board as soon as it can.
_Noreturn void bf537_watchdog_restart(void);

#endif
