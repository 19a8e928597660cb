// SPDX-License-Identifier: Apache-2.0
/// A running simrig (tools/simrig) behind fake devices: /dev/i2c-N, /dev/videoN, /dev/ttyN and
/// /dev/gpiochipN of a board that drives the simulated rig. The fake kernel is the rig's board, by
/// the daemon's own client of its protocol (daemon/backends/sim).
///
/// Time is the rig's, for the whole program: it passes while somebody sleeps, waits for a device or
/// has the bus, and stands still otherwise. It begins at FAKE_RIG_BEGIN_US, where no machine's own
/// clock has come yet, so that waits of the C library that are by that clock
/// (pthread_cond_timedwait) are over when somebody ends them, and not before.
#ifndef VERGENCE_TESTS_FAKE_RIG_H
#define VERGENCE_TESTS_FAKE_RIG_H

#include <stdbool.h>
#include <stdint.h>

#define FAKE_RIG_BEGIN_US UINT64_C(1000000000000000)

/// Connects to unix:PATH or tcp:HOST:PORT. This and the functions below end the program with a
/// line when they cannot do what they are for.
void fake_rig_connect(const char *where);

/// The bus that the bridge hangs on.
void fake_rig_i2c(const char *path);
/// The port that the bridge passes frames to, as a driver of it that runs freely: SGRBG10, of the
/// size that it is asked for, stamped when they begin. It is busy with each for 5 ms.
void fake_rig_video(const char *path);
/// The lens controller's line, which understands 9600 bit/s, 8N1, and garbage else.
void fake_rig_serial(const char *path);
/// A chip whose wire `reset_line` resets the bridge while it is low, and whose wire `irq_line` is
/// the bridge's interrupt.
void fake_rig_gpio(const char *path, unsigned reset_line, unsigned irq_line);

/// Whether there is a rig, so that the time is its.
bool fake_rig_is_connected(void);
/// Whether this thread is in the midst of asking the rig; what waits for its answer goes by the
/// machine's clock.
bool fake_rig_asks(void);

uint64_t fake_rig_now_us(void);
/// Lets time pass until then; `news`: or until a device has something new.
void fake_rig_pass(uint64_t until_us, bool news);

#endif
