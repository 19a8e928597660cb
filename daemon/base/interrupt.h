// SPDX-License-Identifier: Apache-2.0
/// Ctrl-C and similar signals: long work polls and stops cleanly.
#ifndef VERGENCE_DAEMON_BASE_INTERRUPT_H
#define VERGENCE_DAEMON_BASE_INTERRUPT_H

#include <stdbool.h>

#ifdef __cplusplus
extern "C" {
#endif

/// From here on SIGINT, SIGTERM and SIGHUP are recorded instead of ending the process; a second
/// signal of the same kind ends it at once, with a line about leftovers. A signal that is already
/// ignored (nohup) stays ignored.
void interrupt_catch(void);

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
