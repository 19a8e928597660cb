// SPDX-License-Identifier: Apache-2.0
#include "core/invariant.h"

__attribute__((weak)) void invariant_failed(const char *file, int line, const char *condition) {
    (void)file;
    (void)line;
    (void)condition;
    __builtin_trap();
}
