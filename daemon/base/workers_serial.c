// SPDX-License-Identifier: Apache-2.0
// The pool of a system without threads: the caller does all parts.
#include <stddef.h>

#include "core/invariant.h"
#include "daemon/base/workers.h"

struct workers {
    const struct parallel *parallel;
};

struct workers *workers_create(int threads) {
    static struct workers workers = {&parallel_serial};
    INVARIANT(threads >= 0);
    return &workers;
}

void workers_destroy(struct workers *workers) {
    (void)workers;
}

const struct parallel *workers_parallel(struct workers *workers) {
    return workers->parallel;
}
