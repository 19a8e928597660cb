// SPDX-License-Identifier: Apache-2.0
#include "bf537/watchdog.h"

#include "bf537/clock.h"
#include "bf537/mmr.h"

enum { PERIOD_US = 2000000, SOON_US = 1000 };

void bf537_watchdog_feed(void) {
    WDOG_STAT = 0;
}

static void arm(uint32_t after_us) {
    WDOG_CTL = WDOG_OFF;
    WDOG_CNT = after_us * (BF537_SYSTEM_HZ / 1000000);
    WDOG_CTL = WDOG_RESETS;
    ssync();
}

void bf537_watchdog_start(void) {
    arm(PERIOD_US);
}

bool bf537_watchdog_has_restarted(void) {
    return (SWRST & SWRST_WATCHDOG) != 0;
}

_Noreturn void bf537_watchdog_restart(void) {
    arm(SOON_US);
    for (;;) {
        __asm__ volatile("idle;");
    }
}
