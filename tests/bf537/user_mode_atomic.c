// SPDX-License-Identifier: Apache-2.0
// The atomic operations that the compiler calls: Linux provides them, as one core has no
// instruction for it.
#include <bfin_fixed_code.h>
#include <stdbool.h>

#pragma GCC diagnostic ignored "-Wmissing-prototypes"  // the compiler has its own
#pragma GCC diagnostic ignored "-Wbuiltin-declaration-mismatch"

bool __atomic_compare_exchange_4(volatile void *object, void *expected, unsigned desired, bool weak,
                                 int success, int failure) {
    (void)weak;
    (void)success;
    (void)failure;
    unsigned *wanted = expected;
    const unsigned found = bfin_atomic_cas32((void *)(uintptr_t)object, *wanted, desired);
    const bool same = found == *wanted;
    *wanted = found;
    return same;
}

unsigned __atomic_fetch_add_4(volatile void *object, unsigned added, int order) {
    (void)order;
    return bfin_atomic_add32((void *)(uintptr_t)object, added) - added;
}
