// SPDX-License-Identifier: Apache-2.0
/// The command `measure`: from cold to the surface, as the file surface.compact.
#ifndef VERGENCE_MEMORY_MEASURE_H
#define VERGENCE_MEMORY_MEASURE_H

#include <stddef.h>

#include "console/command.h"

const struct command *memory_measure_table(size_t *count);

#endif
