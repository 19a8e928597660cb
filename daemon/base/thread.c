// SPDX-License-Identifier: Apache-2.0
#include "daemon/base/thread.h"

#include <stddef.h>

// A sanitizer's frames are several times as large.
#ifdef VERGENCE_LARGE_FRAMES
enum { STACK_FACTOR = 8 };
#else
enum { STACK_FACTOR = 1 };
#endif

bool thread_start(pthread_t *thread, void *(*run)(void *self), void *self) {
    pthread_attr_t attributes;
    if (pthread_attr_init(&attributes) != 0) {
        return false;
    }
    const bool started =
        pthread_attr_setstacksize(&attributes, (size_t)STACK_FACTOR * THREAD_STACK_BYTES) == 0 &&
        pthread_create(thread, &attributes, run, self) == 0;
    pthread_attr_destroy(&attributes);
    return started;
}
