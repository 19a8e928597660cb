// SPDX-License-Identifier: Apache-2.0
/// Frees an I2C bus on which a transfer was broken off, without writing a register by accident.
///
/// The textbook's way (UM10204, 3.1.16) is nine clocks with SDA let go, and STOP. It is not safe: a
/// device that was being written to takes the clocks for data. If the last byte of a word had n
/// bits when the transfer broke off, 9 - n clocks complete the word, and it is stored, with ones
/// (or whatever is on SDA) for the missing bits. To clock only while SDA is low does not help when
/// it is a third party that holds SDA: then zeros are stored.
///
/// What is done instead, and why nothing can be stored by it. The bridge stores a word at the FALL
/// of SCL after the eighth bit of its last byte (fpga/rtl/i2c_target.v), and devices of other
/// makers do at that edge or the next. So recovery makes no fall of SCL while a device may be in a
/// transfer:
///
/// 1. Both lines are let go. That can raise SCL, which at most shifts one more bit in, or be STOP.
/// 2. If both wires are high, and stay so: START and STOP follow, within one high phase of SCL.
///    START ends what any device was doing, in whatever bit it was. No fall of SCL.
/// 3. Else the lines are left alone until nothing has moved for `quiet_us`. The bridge leaves every
///    transfer after 31 ms of silence, lets SDA go, and then waits for START, deaf to clocks. When
///    the wires come up meanwhile: as in 2.
/// 4. If SDA is low still, it is not the bridge that holds it. Now come the clocks, nine at most,
///    until SDA is high, and then START and STOP within that high phase: some devices go on with
///    their next byte otherwise. The holder is sending or acknowledging, so it stores nothing; the
///    bridge is deaf.
/// 5. SCL that is held down cannot be helped: ERROR_I2C_STUCK.
///
/// Where the backend has no access to the lines, 3 is all that there is; it frees the bridge.
/// The one assumption: no other master is on the bus.
#ifndef VERGENCE_DEVICE_I2C_RECOVERY_H
#define VERGENCE_DEVICE_I2C_RECOVERY_H

#include <stdbool.h>
#include <stdint.h>

#include "hal/clock.h"
#include "hal/i2c.h"

#ifdef __cplusplus
extern "C" {
#endif

/// Whether a transfer with this error may have been broken off anywhere, and devices may still be
/// in it: the bus is to be recovered before the next one. ERROR_IO is among them, since that is all
/// that some adapters say of a transfer that was lost.
bool i2c_recovery_is_due(int error);

/// Recovers the bus. `quiet_us` (> 0): a silence after which no device that stores is in a
/// transfer. 0: both wires are high (or cannot be seen), all devices wait for START.
/// ERROR_I2C_STUCK: a wire stays low. Other errors: the backend's. Takes 0.1 ms when the wires are
/// free, `quiet_us` and 0.3 ms when they do not move, and never more than 2 * `quiet_us` + 10 ms.
int i2c_recovery_run(const struct hal_i2c *bus, const struct hal_clock *clock, uint32_t quiet_us);

#ifdef __cplusplus
}
#endif

#endif
