// SPDX-License-Identifier: Apache-2.0
// Reaction to a programming error in core, for programs on an operating system.
#include <stdio.h>
#include <stdlib.h>

#include "core/invariant.h"
#include "daemon/base/process.h"

void invariant_failed(const char *file, int line, const char *condition) {
    fprintf(stderr, "vergence: internal error at %s:%d: %s (build %s)\n", file, line, condition,
            version_build_id());
    abort();
}
