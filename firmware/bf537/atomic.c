// SPDX-License-Identifier: Apache-2.0
// The atomic operations that the compiler calls: with one core, masked interrupts make them.
#include <stdbool.h>
#include <stdint.h>

#pragma GCC diagnostic ignored "-Wmissing-prototypes"  // the compiler has its own
#pragma GCC diagnostic ignored "-Wbuiltin-declaration-mismatch"

static uint32_t mask_interrupts(void) {
    uint32_t enabled;
    __asm__ volatile("cli %0;" : "=d"(enabled));
    return enabled;
}

static void restore_interrupts(uint32_t enabled) {
    __asm__ volatile("sti %0;" : : "d"(enabled) : "memory");
}

bool __atomic_compare_exchange_4(volatile void *object, void *expected, unsigned desired, bool weak,
                                 int success, int failure) {
    (void)weak;
    (void)success;
    (void)failure;
    volatile unsigned *at = object;
    unsigned *wanted = expected;
    const uint32_t enabled = mask_interrupts();
    const unsigned found = *at;
    *at = found == *wanted ? desired : found;
    restore_interrupts(enabled);
    const bool same = found == *wanted;
    *wanted = found;
    return same;
}

unsigned __atomic_fetch_add_4(volatile void *object, unsigned added, int order) {
    (void)order;
    volatile unsigned *at = object;
    const uint32_t enabled = mask_interrupts();
    const unsigned found = *at;
    *at = found + added;
    restore_interrupts(enabled);
    return found;
}
