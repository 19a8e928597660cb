// SPDX-License-Identifier: Apache-2.0
#include "core/parallel.h"

static void run_in_order(void *self, void (*part)(void *context, int index), void *context,
                         int count) {
    (void)self;
    for (int index = 0; index < count; index++) {
        part(context, index);
    }
}

const struct parallel parallel_serial = {.run = run_in_order, .self = 0, .threads = 1};
