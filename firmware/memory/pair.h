// SPDX-License-Identifier: Apache-2.0
/// Commands that take a pair and measure it, in memory that is lent once.
#ifndef VERGENCE_MEMORY_PAIR_H
#define VERGENCE_MEMORY_PAIR_H

#include <stddef.h>

#include "console/command.h"
#include "core/arena.h"
#include "rig/pair.h"

/// Lends memory for merged frames and for all that a reconstruction needs and gives.
void memory_pair_begin(void *memory, size_t bytes);

/// The last pair, and the name of its files; NULL: none.
const struct pair *memory_pair_last(const char **name);
/// The arena, with all but the pair released.
struct arena *memory_pair_arena(void);

const struct command *memory_pair_table(size_t *count);

#endif
