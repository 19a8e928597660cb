// SPDX-License-Identifier: Apache-2.0
/// One level of the matcher: memory, bands, and the coarser levels it asks for rows. Private to
/// match*.c.
#ifndef VERGENCE_STEREO_MATCH_MATCH_LEVEL_H
#define VERGENCE_STEREO_MATCH_MATCH_LEVEL_H

#include "stereo/match/match_state.h"

/// Where memory is counted, and taken when there is an arena.
struct match_memory {
    struct arena *arena;  // NULL: only count
    size_t need_bytes;
    bool failed;
};

/// Sets the geometry of all levels for a full-size image, from state->options and state->method.
void match_set_levels(struct match_state *state, int width, int height);

/// Takes what all levels and threads need.
void match_take_memory(struct match_state *state, struct match_memory *memory);

/// Makes everything ready for the first band.
void match_begin_levels(struct match_state *state);

/// Runs bands of a level, and of coarser ones where they are needed, until `rows` rows are done.
void match_advance(struct match_level *level, int rows);

/// Smooths the output and fills the rows that the finest level stands for, when all is done.
void match_finish(struct match_state *state);

#endif
