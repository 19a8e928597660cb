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
    WDOG_CNT = after_us * (bf537_system_hz() / 1000000);
    WDOG_CTL = WDOG_RESETS;
    ssync();
}

void bf537_watchdog_start(void) {
    SWRST = SWRST_BY_DOUBLE_FAULT;
    arm(PERIOD_US);
}

const char *bf537_watchdog_restart_text(void) {
    const uint16_t causes = SWRST;
    if ((causes & SWRST_DOUBLE_FAULT) != 0) {
        return "a fault while another one was reported";
    }
    return (causes & SWRST_WATCHDOG) != 0 ? "the watchdog: the program stopped"
                                          : "power on or reset";
}

_Noreturn void bf537_watchdog_restart(void) {
    arm(SOON_US);
    for (;;) {
        __asm__ volatile("idle;");
    }
}
