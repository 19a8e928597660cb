// SPDX-License-Identifier: Apache-2.0
/// Threads with a fixed stack size. The default depends on the limit of the main program's stack,
/// or is 128 KiB with some C libraries, which is too small for bring-up.
#ifndef VERGENCE_DAEMON_BASE_THREAD_H
#define VERGENCE_DAEMON_BASE_THREAD_H

#include <pthread.h>
#include <stdbool.h>

#ifdef __cplusplus
extern "C" {
#endif

/// At most about 250 KiB are used (x86-64).
enum { THREAD_STACK_BYTES = 1024 * 1024 };

/// As pthread_create; the caller joins it. False: out of memory, or too many threads.
bool thread_start(pthread_t *thread, void *(*run)(void *self), void *self);

#ifdef __cplusplus
}
#endif

#endif
