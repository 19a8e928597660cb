// SPDX-License-Identifier: Apache-2.0
/// Threads with a stack that does not depend on the system: without a word it is what the limit of
/// the program's own stack says, or 128 KiB with some C libraries, and bringing up takes more.
#ifndef VERGENCE_DAEMON_BASE_THREAD_H
#define VERGENCE_DAEMON_BASE_THREAD_H

#include <pthread.h>
#include <stdbool.h>

#ifdef __cplusplus
extern "C" {
#endif

/// Some 250 KiB are in use at most (x86-64).
enum { THREAD_STACK_BYTES = 1024 * 1024 };

/// As pthread_create, to be joined. False: no memory, or too many threads.
bool thread_start(pthread_t *thread, void *(*run)(void *self), void *self);

#ifdef __cplusplus
}
#endif

#endif
