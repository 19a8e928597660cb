// SPDX-License-Identifier: Apache-2.0
/// A running simrig (tools/simrig) behind fake devices: /dev/i2c-N, /dev/videoN, /dev/ttyN and
/// /dev/gpiochipN of a board that drives the simulated rig. The fake kernel acts as the rig's board
/// through the daemon's own client of the protocol (daemon/backends/sim).
///
/// Time is the rig's for the whole program: it advances while a thread sleeps, waits for a device
/// or uses the bus, and stops otherwise. It starts at FAKE_RIG_BEGIN_US, which no machine's own
/// clock has reached, so that waits of the C library by that clock (pthread_cond_timedwait) end
/// only when another thread ends them.
#ifndef VERGENCE_TESTS_FAKE_RIG_H
#define VERGENCE_TESTS_FAKE_RIG_H

#include <stdbool.h>
#include <stdint.h>

#define FAKE_RIG_BEGIN_US UINT64_C(1000000000000000)

/// Connects to unix:PATH or tcp:HOST:PORT. This and the functions below end the program with a
/// message if they fail.
void fake_rig_connect(const char *where);

/// The bridge's bus.
void fake_rig_i2c(const char *path);
/// The port that the bridge passes frames to, as a free-running driver: SGRBG10, in the requested
/// size, stamped at the start of a frame. It is busy for 5 ms per frame.
void fake_rig_video(const char *path);
/// The lens controller's line: 9600 bit/s, 8N1; anything else is garbage to it.
void fake_rig_serial(const char *path);
/// A chip whose wire `reset_line` resets the bridge while low, and whose wire `irq_line` is the
/// bridge's interrupt.
void fake_rig_gpio(const char *path, unsigned reset_line, unsigned irq_line);

/// Whether a rig is connected, so that time is the rig's.
bool fake_rig_is_connected(void);
/// Whether this thread is in a request to the rig; waits for its answer use the machine's clock.
bool fake_rig_asks(void);

uint64_t fake_rig_now_us(void);
/// Advances the time until then; `news`: or until a device has an event.
void fake_rig_pass(uint64_t until_us, bool news);

#endif
