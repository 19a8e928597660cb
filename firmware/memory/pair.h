// SPDX-License-Identifier: Apache-2.0
/// Commands that take a pair and measure it, in memory that is lent once.
#ifndef VERGENCE_MEMORY_PAIR_H
#define VERGENCE_MEMORY_PAIR_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "console/command.h"
#include "core/arena.h"
#include "rig/pair.h"

/// Lends memory for merged frames and for all that a reconstruction needs and gives.
void memory_pair_begin(const struct arena *lent);

/// The last pair, and the name of its files; NULL: none.
const struct pair *memory_pair_last(const char **name);
/// The arena, with all but the pair released.
struct arena *memory_pair_arena(void);
/// The arena behind a surface.
struct arena *memory_pair_arena_rest(void);

/// Pairs that a measurement keeps beside the last one.
enum memory_kept { MEMORY_KEPT_WIDE, MEMORY_KEPT_PAIR, MEMORY_KEPT };

/// Forgets all pairs, and takes memory to keep those of a measurement with frames of this size
/// until memory_pair_end_keeping; they are there until the capture after that. False: not enough.
bool memory_pair_begin_keeping(int width_px, int height_px);
void memory_pair_end_keeping(void);
/// Keeps a copy of the last pair, in place of one kept before.
void memory_pair_keep(enum memory_kept kept);
/// The last pair, or one that is kept, by its number; NULL: none has it.
const struct pair *memory_pair_numbered(uint32_t number);

const struct command *memory_pair_table(size_t *count);

#endif
