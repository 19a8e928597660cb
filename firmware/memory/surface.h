// SPDX-License-Identifier: Apache-2.0
/// The command `reconstruct`: the surface of the last pair, as the file surface.compact.
#ifndef VERGENCE_MEMORY_SURFACE_H
#define VERGENCE_MEMORY_SURFACE_H

#include <stddef.h>

#include "console/command.h"

const struct command *memory_surface_table(size_t *count);

#endif
