// SPDX-License-Identifier: Apache-2.0
#include "bf537/clock.h"

#include <stdbool.h>
#include <stddef.h>

#include "bf537/mmr.h"

static volatile bool interrupted;  // since the last sleep

static uint64_t cycles(void) {
    uint32_t low, high;
    // Reading the lower half latches the upper one.
    __asm__ volatile("%0 = cycles; %1 = cycles2;" : "=d"(low), "=d"(high));
    return (uint64_t)high << 32 | low;
}

uint64_t bf537_now_us(void) {
    return cycles() / BF537_CORE_MHZ;
}

void bf537_end_sleep(void) {
    TCNTL = TCNTL_POWER;
    interrupted = true;
}

void bf537_sleep_until_us(uint64_t time_us) {
    const uint64_t now_us = bf537_now_us();
    if (time_us <= now_us) {
        return;
    }
    const uint64_t left_us = time_us - now_us, most_us = UINT32_MAX / BF537_CORE_MHZ;
    uint32_t enabled;
    // With interrupts masked, one that comes before `idle` still ends it.
    __asm__ volatile("cli %0;" : "=d"(enabled) : : "memory");
    if (!interrupted) {
        TCNTL = TCNTL_POWER;
        TSCALE = 0;
        TPERIOD = 0;
        TCOUNT = (uint32_t)(left_us < most_us ? left_us : most_us) * BF537_CORE_MHZ;
        TCNTL = TCNTL_POWER | TCNTL_ENABLE;
        __asm__ volatile("csync; idle; ssync;" ::: "memory");
    }
    __asm__ volatile("sti %0;" : : "d"(enabled) : "memory");
    TCNTL = TCNTL_POWER;
    interrupted = false;  // the caller looks at what has come
}

static uint64_t now_us(void *self) {
    (void)self;
    return bf537_now_us();
}

static void wait_until_us(void *self, uint64_t time_us) {
    (void)self;
    while (bf537_now_us() < time_us) {
        bf537_sleep_until_us(time_us);
    }
}

const struct hal_clock *bf537_clock(void) {
    static const struct hal_clock_operations operations = {now_us, wait_until_us, NULL};
    static const struct hal_clock clock = {&operations, NULL};
    return &clock;
}
