// SPDX-License-Identifier: Apache-2.0
#include "core/parallel.h"

#include <stddef.h>

static void run_in_order(void *self, void (*part)(void *context, int index), void *context,
                         int count) {
    (void)self;
    for (int index = 0; index < count; index++) {
        part(context, index);
    }
}

const struct parallel parallel_serial = {.run = run_in_order, .self = NULL, .threads = 1};
