// SPDX-License-Identifier: Apache-2.0
#include "bf537/clock.h"

#include <stdbool.h>
#include <stddef.h>

#include "bf537/mmr.h"

enum { INPUT_HZ = 25000000, HZ_PER_MHZ = 1000000 };  // the EZ-KIT's crystal

static uint32_t core_mhz, system_hz;
static volatile bool interrupted;  // since the last sleep

void bf537_clock_begin(void) {
    const uint32_t control = PLL_CTL, divide = PLL_DIV;
    const uint32_t multiplier = control >> PLL_MULTIPLIER_SHIFT & PLL_MULTIPLIER_MASK;
    const uint32_t input_hz = (control & PLL_HALF_INPUT) != 0 ? INPUT_HZ / 2 : INPUT_HZ;
    const uint32_t pll_hz = input_hz * (multiplier != 0 ? multiplier : PLL_MULTIPLIER_MASK + 1);
    const bool bypass = (control & PLL_BYPASS) != 0;
    core_mhz = (bypass ? INPUT_HZ : pll_hz >> (divide >> 4 & 3)) / HZ_PER_MHZ;
    system_hz = bypass ? INPUT_HZ : pll_hz / (divide & 15);
}

uint32_t bf537_system_hz(void) {
    return system_hz;
}

static uint64_t cycles(void) {
    uint32_t low, high;
    // Reading the lower half latches the upper one.
    __asm__ volatile("%0 = cycles; %1 = cycles2;" : "=d"(low), "=d"(high));
    return (uint64_t)high << 32 | low;
}

uint64_t bf537_now_us(void) {
    return cycles() / core_mhz;
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
    const uint64_t left_us = time_us - now_us, most_us = UINT32_MAX / core_mhz;
    uint32_t enabled;
    __asm__ volatile("cli %0;" : "=d"(enabled) : : "memory");
    if (!interrupted) {
        TCNTL = TCNTL_POWER;
        TSCALE = 0;
        TPERIOD = 0;
        TCOUNT = (uint32_t)(left_us < most_us ? left_us : most_us) * core_mhz;
        TCNTL = TCNTL_POWER | TCNTL_ENABLE;
        __asm__ volatile("csync;" ::: "memory");
    }
    while (!interrupted) {
        // Fetched together, so that no interrupt comes between them and is slept through.
        __asm__ volatile(".align 8; sti %0; idle; ssync; cli %0;" : "+d"(enabled) : : "memory");
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
