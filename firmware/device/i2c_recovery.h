// SPDX-License-Identifier: Apache-2.0
/// Frees an I2C bus after an interrupted transfer, without writing a register by accident.
///
/// The textbook procedure (UM10204, 3.1.16) is nine clocks with SDA released, then STOP. It is not
/// safe: a device that was being written to takes the clocks as data. If the last byte of a word
/// had n bits when the transfer was interrupted, 9 - n clocks complete the word, and it is stored
/// with ones (or whatever is on SDA) for the missing bits. Clocking only while SDA is low does not
/// help if a third device holds SDA: then zeros are stored.
///
/// This procedure cannot store anything, for the following reason. The bridge stores a word at the
/// FALL of SCL after the eighth bit of its last byte (fpga/rtl/i2c_target.v), and other devices do
/// so at that edge or the next. So recovery makes no fall of SCL while a device may be in a
/// transfer:
///
/// 1. Release both lines. This can raise SCL, which at most shifts one more bit in, or is a STOP.
/// 2. If both lines are high and stay so: START and STOP follow within one high phase of SCL.
///    START aborts any transfer at any bit. No fall of SCL.
/// 3. Otherwise leave the lines alone until nothing has changed for `quiet_us`. The bridge leaves
///    every transfer after 31 ms of silence, releases SDA, and then waits for START and ignores
///    clocks. If the lines rise meanwhile: as in 2.
/// 4. If SDA is still low, the bridge does not hold it. Now send clocks, nine at most, until SDA
///    is high, and then START and STOP within that high phase: some devices otherwise continue
///    with their next byte. The device that holds SDA is sending or acknowledging, so it stores
///    nothing; the bridge ignores the clocks.
/// 5. If SCL is held low, nothing helps: ERROR_I2C_STUCK.
///
/// If the backend cannot access the lines, only step 3 is done, which frees the bridge. The only
/// assumption: there is no other master on the bus.
#ifndef VERGENCE_DEVICE_I2C_RECOVERY_H
#define VERGENCE_DEVICE_I2C_RECOVERY_H

#include <stdbool.h>
#include <stdint.h>

#include "hal/clock.h"
#include "hal/i2c.h"

#ifdef __cplusplus
extern "C" {
#endif

/// Whether a transfer with this error may have been interrupted anywhere, so that devices may still
/// be in it: recover the bus before the next transfer. This includes ERROR_IO, which is all that
/// some adapters report about a lost transfer.
bool i2c_recovery_is_due(int error);

/// Recovers the bus. `quiet_us` (> 0): a silence after which no device that stores is in a
/// transfer. Returns 0: both lines are high (or cannot be seen), and all devices wait for START.
/// ERROR_I2C_STUCK: a line stays low. Other errors: those of the backend. Takes 0.1 ms if the lines
/// are free, `quiet_us` plus 0.3 ms if they do not change, and never more than 2 * `quiet_us` + 10
/// ms.
int i2c_recovery_run(const struct hal_i2c *bus, const struct hal_clock *clock, uint32_t quiet_us);

#ifdef __cplusplus
}
#endif

#endif
