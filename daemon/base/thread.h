// SPDX-License-Identifier: Apache-2.0
/// Threads with a stack of known size.
#ifndef VERGENCE_DAEMON_BASE_THREAD_H
#define VERGENCE_DAEMON_BASE_THREAD_H

#include <pthread.h>
#include <stdbool.h>

#ifdef __cplusplus
extern "C" {
#endif

/// Stack of a thread: the default depends on the limit of the main program's stack, or is 128 KiB
/// with some C libraries. A system without a memory management unit takes all of it at once. At
/// most 52 KiB are used, 19 KiB by a thread of `workers` (x86-64, painted while the console's tests
/// ran). Thread-local variables are part of it: there are few, and none is a buffer.
enum { THREAD_STACK_BYTES = 192 * 1024 };

/// As pthread_create with that stack; the caller joins it. False: out of memory, or too many
/// threads.
bool thread_start(pthread_t *thread, void *(*run)(void *self), void *self);

#ifdef __cplusplus
}
#endif

#endif
