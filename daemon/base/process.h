// SPDX-License-Identifier: Apache-2.0
/// What a process is and has: its build, threads, signals.
#ifndef VERGENCE_DAEMON_BASE_PROCESS_H
#define VERGENCE_DAEMON_BASE_PROCESS_H

#include <pthread.h>
#include <stdbool.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/// "1.2.3"; static storage, like the others here.
const char *version_text(void);

/// Output of `git describe --always --dirty` at build time, or "unknown".
const char *version_build_id(void);

/// Date of the commit, "2026-01-31"; outside of a repository the day of the build.
const char *version_build_date(void);

/// Stack of a thread: the default depends on the limit of the main program's stack, or is 128 KiB
/// with some C libraries. A system without a memory management unit takes all of it at once. At
/// most 52 KiB are used, 19 KiB by a thread of `workers` (x86-64, painted while the console's tests
/// ran). Thread-local variables are part of it: there are few, and none is a buffer.
enum { THREAD_STACK_BYTES = 192 * 1024 };

/// As pthread_create with that stack; the caller joins it. False: out of memory, or too many
/// threads.
bool thread_start(pthread_t *thread, void *(*run)(void *self), void *self);

/// From here on SIGINT, SIGTERM and SIGHUP are recorded instead of ending the process; a second
/// signal of the same kind ends it at once, with a line about leftovers. A signal that is already
/// ignored (nohup) stays ignored.
void interrupt_catch(void);

/// Ends that, and forgets a signal that was caught: for a program that continues.
void interrupt_release(void);

/// From here on interrupt_requested() in this thread also calls `should_stop`, which returns true
/// if the thread's work is to stop. NULL: no callback.
void interrupt_ask(bool (*should_stop)(void *self), void *self);

/// Whether a signal has come or the callback of interrupt_ask asks to stop. Any thread.
bool interrupt_requested(void);

/// Exit code of the process: 128 + signal number (130 for Ctrl-C). Only after a signal.
int interrupt_exit_code(void);

#ifdef __cplusplus
}
#endif

#endif
