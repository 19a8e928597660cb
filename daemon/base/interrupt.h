// SPDX-License-Identifier: Apache-2.0
/// Ctrl-C and its relatives: long work asks now and then and gives up in good order.
#ifndef VERGENCE_DAEMON_BASE_INTERRUPT_H
#define VERGENCE_DAEMON_BASE_INTERRUPT_H

#include <stdbool.h>

#ifdef __cplusplus
extern "C" {
#endif

/// From here on SIGINT, SIGTERM and SIGHUP are remembered instead of ending the process; a second
/// one of the same kind ends it at once, with a line about what it leaves. A signal that is ignored
/// already (nohup) stays ignored.
void interrupt_catch(void);

/// From here on interrupt_requested() of this thread also asks `go_on`, which says false when what
/// the thread does is to end; NULL: nobody is asked any more.
void interrupt_ask(bool (*go_on)(void *self), void *self);

/// Whether a signal has come, or whoever is asked wants an end. May be asked from any thread.
bool interrupt_requested(void);

/// 128 + the signal's number (130 for Ctrl-C): the process's exit code. Only after a signal.
int interrupt_exit_code(void);

#ifdef __cplusplus
}
#endif

#endif
