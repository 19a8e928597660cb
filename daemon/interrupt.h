// SPDX-License-Identifier: Apache-2.0
/// Ctrl-C and its relatives: long work asks now and then and gives up in good order.
#ifndef VERGENCE_DAEMON_INTERRUPT_H
#define VERGENCE_DAEMON_INTERRUPT_H

#include <stdbool.h>

#ifdef __cplusplus
extern "C" {
#endif

/// From here on SIGINT, SIGTERM and SIGHUP are remembered instead of ending the process; a second
/// one of the same kind ends it at once, with a line about what it leaves. A signal that is ignored
/// already (nohup) stays ignored.
void interrupt_catch(void);

/// Whether one has come. May be asked from any thread.
bool interrupt_requested(void);

/// 128 + the signal's number (130 for Ctrl-C): the process's exit code. Only after one has come.
int interrupt_exit_code(void);

#ifdef __cplusplus
}
#endif

#endif
