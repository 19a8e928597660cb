// SPDX-License-Identifier: Apache-2.0
/// A pool of threads behind `struct parallel`. Parts are handed out one by one to whoever is free;
/// since the parts of a run are independent, results do not depend on who takes which.
#ifndef VERGENCE_DAEMON_BASE_WORKERS_H
#define VERGENCE_DAEMON_BASE_WORKERS_H

#include "core/parallel.h"

#ifdef __cplusplus
extern "C" {
#endif

enum { WORKERS_MAX_THREADS = 256 };

struct workers;

/// Starts threads - 1 threads (the caller's own takes part as well); `threads` 0 means all
/// processors that this process may use. Fewer are started when the system refuses more. NULL when
/// memory runs out.
struct workers *workers_create(int threads);

/// Waits for the threads to end and frees the pool; NULL is allowed.
void workers_destroy(struct workers *workers);

/// The pool for core code; valid until destroyed. One run at a time: a part that calls run itself,
/// and a second thread that does, get their parts done on their own thread.
const struct parallel *workers_parallel(struct workers *workers);

#ifdef __cplusplus
}
#endif

#endif
