// SPDX-License-Identifier: Apache-2.0
// What a program with an operating system does when core finds a mistake of ours.
#include <stdio.h>
#include <stdlib.h>

#include "core/invariant.h"
#include "daemon/base/version.h"

void invariant_failed(const char *file, int line, const char *condition) {
    fprintf(stderr, "vergence: internal error at %s:%d: %s (build %s)\n", file, line, condition,
            version_build_id());
    abort();
}
