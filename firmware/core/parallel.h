// SPDX-License-Identifier: Apache-2.0
/// How core code runs parallel work without depending on threads. The parts of one call may run in
/// any order on any thread; results never depend on that. A part may wait only for what another one
/// that has begun is doing.
/// Also who is to be called while core code works.
#ifndef VERGENCE_CORE_PARALLEL_H
#define VERGENCE_CORE_PARALLEL_H

#include <stddef.h>

#ifdef __cplusplus
extern "C" {
#endif

struct parallel {
    /// Runs part(context, 0) .. part(context, count - 1) and returns when all are done.
    void (*run)(void *self, void (*part)(void *context, int index), void *context, int count);
    void *self;
    int threads;  // number of parts that may run at once, >= 1: a hint for splitting
    /// To be called repeatedly by a part that waits for another part in progress. May be NULL.
    void (*relax)(void *self);
};

/// Calls part(context, index). The program of a processor with little fast memory defines its own,
/// with a stack there. A part calls no `run`, which may do more between its parts than fits there.
void parallel_call(void (*part)(void *context, int index), void *context, int index);

/// One thread: the parts run in order on the caller's thread.
extern const struct parallel parallel_serial;

/// Who is called again and again by what takes seconds of a processor without floating point.
struct watch {
    void (*serve)(void *self);  // NULL: none
    void *self;
};

/// `watch` may be NULL.
static inline void watch_serve(const struct watch *watch) {
    if (watch != NULL && watch->serve != NULL) {
        watch->serve(watch->self);
    }
}

#ifdef __cplusplus
}
#endif

#endif
