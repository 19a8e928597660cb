// SPDX-License-Identifier: Apache-2.0
/// What ends the program: exceptions, hardware errors, broken invariants, a stack that ran over. A
/// report goes to the console; after the restart, which the watchdog makes, `board` shows the
/// reason.
#ifndef VERGENCE_BF537_FAULT_H
#define VERGENCE_BF537_FAULT_H

#include <stddef.h>

/// Why the program was started: "power on or reset", or the fault that ended it. Called at the
/// start, as the reason is kept for one restart. Static storage.
const char *bf537_fault_last(void);

/// Ends the program if a stack has run over its end.
void bf537_fault_check_stack(void);

/// Ends the program if the data cache is on: frames by DMA would not be what the processor reads.
void bf537_fault_check_cache(void);

/// The stack, and that of parts of the work: its size, and its largest depth so far.
struct bf537_stack {
    size_t bytes, used_bytes;
};
struct bf537_stack bf537_stack(void);
struct bf537_stack bf537_l1_stack(void);

#endif
