// SPDX-License-Identifier: Apache-2.0
/// What a process is and has: its build, signals.
#ifndef VERGENCE_DAEMON_BASE_PROCESS_H
#define VERGENCE_DAEMON_BASE_PROCESS_H

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
