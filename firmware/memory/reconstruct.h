// SPDX-License-Identifier: Apache-2.0
/// The command `reconstruct`: the surface of the last pair, as the file surface.compact.
#ifndef VERGENCE_MEMORY_RECONSTRUCT_H
#define VERGENCE_MEMORY_RECONSTRUCT_H

#include <stddef.h>

#include "console/command.h"

const struct command *memory_reconstruct_table(size_t *count);

#endif
