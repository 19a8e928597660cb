// SPDX-License-Identifier: Apache-2.0
#include "daemon/base/thread.h"

bool thread_start(pthread_t *thread, void *(*run)(void *self), void *self) {
    pthread_attr_t attributes;
    if (pthread_attr_init(&attributes) != 0) {
        return false;
    }
    const bool started = pthread_attr_setstacksize(&attributes, THREAD_STACK_BYTES) == 0 &&
                         pthread_create(thread, &attributes, run, self) == 0;
    pthread_attr_destroy(&attributes);
    return started;
}
