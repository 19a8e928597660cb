// SPDX-License-Identifier: Apache-2.0
/// A library between a program and the kernel: it emulates devices that the machine does not have,
/// records system calls, and can make any of them fail.
///
/// A test links it as a shared library (so that its symbols precede the C library's) and uses this
/// header. Other programs load it with LD_PRELOAD and are configured by VERGENCE_FAKE_KERNEL
/// (fake_script.h).
///
/// It handles calls on the devices below and on real files whose path begins with a watched prefix;
/// all others pass unchanged. Every handled call is one line of the record:
///
///     NAME CALL DETAILS        for example    i2c-1 ioctl I2C_RDWR w5d:00 r5d:2
///
/// NAME is the file's name without its directory. One process, any thread.
#ifndef VERGENCE_TESTS_FAKE_KERNEL_H
#define VERGENCE_TESTS_FAKE_KERNEL_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/// Removes devices, watches, failures and the record, and returns to real time. Open files stay
/// open and are no longer handled.
void fake_kernel_reset(void);

/// Handles real files under this prefix from now on. At most 4 prefixes.
void fake_kernel_watch(const char *prefix);

/// From now on the device `path` is connected while `file` exists; descriptors that are open when
/// it disappears stay dead. False: no such device.
bool fake_kernel_plug(const char *path, const char *file);

/// All lines since the last reset or `fake_kernel_forget`, each with its end. Valid until the next
/// handled call.
const char *fake_kernel_record(void);
/// Also appends every line to this file from now on, for a program that may be killed.
void fake_kernel_record_to(const char *path);
/// Calls since then.
unsigned fake_kernel_calls(void);
/// Starts a new record; requested failures remain.
void fake_kernel_forget(void);

/// The `nth` (from 1, from now) handled call whose line contains `what` ("": all but sleeps) and
/// the `times - 1` matching ones after it fail with `error` and have no effect. `times` 0: forever.
/// At most 8 at a time.
void fake_kernel_fail(const char *what, unsigned nth, int error, unsigned times);
/// The same, but the process is killed (SIGKILL) instead of the call.
void fake_kernel_kill(const char *what, unsigned nth);
/// The same, but the call never returns: its thread hangs, others continue.
void fake_kernel_hang(const char *what, unsigned nth);
/// From now on every handled call whose line contains `what` takes `ms` longer in real time.
void fake_kernel_slow(const char *what, unsigned ms);
/// The same for a write or read: half the bytes (at least one) are transferred, without an error.
void fake_kernel_short(const char *what, unsigned nth, unsigned times);
/// Whether a requested failure has occurred since the last reset.
bool fake_kernel_failed(void);

/// From now on the monotonic clock only advances by waits, which end at once. It starts at
/// `now_us`.
void fake_kernel_virtual_time(uint64_t now_us);
/// The monotonic clock as the program sees it.
uint64_t fake_kernel_now_us(void);
/// Advances the virtual clock.
void fake_kernel_advance(uint64_t us);
/// Every handled call takes this long in virtual time: the effect of a busy system on deadlines.
void fake_kernel_call_takes(uint64_t us);

#ifdef __cplusplus
}
#endif

#endif
