// SPDX-License-Identifier: Apache-2.0
/// A library that stands between a program and the kernel: it plays devices that the machine does
/// not have, writes down the system calls, and makes any of them fail.
///
/// A test links it as a shared library (its symbols come before those of the C library then) and
/// uses this header. A program that knows nothing of it gets it by LD_PRELOAD and is set up by
/// VERGENCE_FAKE_KERNEL (fake_script.h).
///
/// Seen are the calls on the devices below and on real files whose path begins with a watched
/// prefix; all others pass by untouched. Every seen call is one line of the record:
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

/// Forgets devices, watches, failures and the record, and gives real time back. Files that are
/// still open stay open and are no longer known.
void fake_kernel_reset(void);

/// Real files under this prefix are seen from now on. At most 4 prefixes.
void fake_kernel_watch(const char *prefix);

/// The device `path` is connected while `file` is there from now on; descriptors that are open when
/// it goes stay dead. False: there is no such device.
bool fake_kernel_plug(const char *path, const char *file);

/// All lines since the last reset or `fake_kernel_forget`, each with its end. Lives until the next
/// seen call.
const char *fake_kernel_record(void);
/// Every line is appended to this file as well, from now on: for a program that may be killed.
void fake_kernel_record_to(const char *path);
/// Calls since then.
unsigned fake_kernel_calls(void);
/// Begins a new record; failures that were asked for stay.
void fake_kernel_forget(void);

/// The `nth` (from 1, from now) seen call whose line contains `what` ("": all but sleeps) and the
/// `times - 1` fitting ones after it fail with `error` and do nothing. `times` 0: for ever. At most
/// 8 at a time.
void fake_kernel_fail(const char *what, unsigned nth, int error, unsigned times);
/// The same, but the process is killed (SIGKILL) in place of the call.
void fake_kernel_kill(const char *what, unsigned nth);
/// The same, but the call never returns: its thread hangs, others go on.
void fake_kernel_hang(const char *what, unsigned nth);
/// Every seen call whose line contains `what` takes `ms` longer, of real time, from now on.
void fake_kernel_slow(const char *what, unsigned ms);
/// The same for a write or read: half the bytes (at least one) are moved, without an error.
void fake_kernel_short(const char *what, unsigned nth, unsigned times);
/// Whether a failure that was asked for has come to pass since the last reset.
bool fake_kernel_failed(void);

/// From now on the monotonic clock stands still but for waits, which end at once and move it on.
/// It begins at `now_us`.
void fake_kernel_virtual_time(uint64_t now_us);
/// The monotonic clock as the program sees it.
uint64_t fake_kernel_now_us(void);
/// Moves the virtual clock.
void fake_kernel_advance(uint64_t us);
/// Every seen call takes so long (of virtual time only): what a busy system does to deadlines.
void fake_kernel_call_takes(uint64_t us);

#ifdef __cplusplus
}
#endif

#endif
