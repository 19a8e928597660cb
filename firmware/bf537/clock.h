// SPDX-License-Identifier: Apache-2.0
/// Time from the processor's cycle counter. The processor sleeps while it waits.
#ifndef VERGENCE_BF537_CLOCK_H
#define VERGENCE_BF537_CLOCK_H

#include <stdint.h>

#include "hal/clock.h"

/// Reads the clocks as the boot loader has set them. Call it before anything else of these drivers.
void bf537_clock_begin(void);

/// Clock of the peripherals.
uint32_t bf537_system_hz(void);

/// Microseconds since reset.
uint64_t bf537_now_us(void);

/// Sleeps until an interrupt, at most until `time_us`. Returns at once if that time has passed, or
/// if an interrupt came after the last sleep: what it brought may not have been seen yet.
void bf537_sleep_until_us(uint64_t time_us);
/// Ends a sleep, or the next one: for the interrupt.
void bf537_end_sleep(void);

/// The interface of this clock. Static storage.
const struct hal_clock *bf537_clock(void);

#endif
