// SPDX-License-Identifier: Apache-2.0
/// A thread pool behind `struct parallel`. Parts are handed out one by one to free threads; as the
/// parts of a run are independent, results do not depend on the distribution.
#ifndef VERGENCE_DAEMON_BASE_WORKERS_H
#define VERGENCE_DAEMON_BASE_WORKERS_H

#include "core/parallel.h"

#ifdef __cplusplus
extern "C" {
#endif

enum { WORKERS_MAX_THREADS = 256 };

struct workers;

/// Starts threads - 1 threads (the caller's thread takes part too); `threads` 0 means all
/// processors that this process may use. Fewer are started if the system refuses. NULL if out of
/// memory.
struct workers *workers_create(int threads);

/// Waits for the threads to end and frees the pool; NULL is allowed.
void workers_destroy(struct workers *workers);

/// The pool for core code; valid until destroyed. One run at a time: a part that calls run, and a
/// second thread that does, have their parts done on their own thread.
const struct parallel *workers_parallel(struct workers *workers);

#ifdef __cplusplus
}
#endif

#endif
