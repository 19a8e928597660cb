// SPDX-License-Identifier: Apache-2.0
#include "core/parallel.h"

#include <stddef.h>

__attribute__((weak)) void parallel_call(void (*part)(void *context, int index), void *context,
                                         int index) {
    part(context, index);
}

static void run_in_order(void *self, void (*part)(void *context, int index), void *context,
                         int count) {
    (void)self;
    for (int index = 0; index < count; index++) {
        parallel_call(part, context, index);
    }
}

const struct parallel parallel_serial = {.run = run_in_order, .self = NULL, .threads = 1};
