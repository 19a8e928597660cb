// SPDX-License-Identifier: Apache-2.0
/// The processor's watchdog: a program that stops is restarted.
#ifndef VERGENCE_BF537_WATCHDOG_H
#define VERGENCE_BF537_WATCHDOG_H

#include <stdbool.h>

/// Starts it: the program feeds it at least every two seconds.
void bf537_watchdog_start(void);
void bf537_watchdog_feed(void);
/// Whether it made the last restart.
bool bf537_watchdog_has_restarted(void);
/// Lets it restart the board as soon as it can.
_Noreturn void bf537_watchdog_restart(void);

#endif
