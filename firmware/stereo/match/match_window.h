// SPDX-License-Identifier: Apache-2.0
/// Chooses the disparities that each tile of a band searches. Private to match*.c.
#ifndef VERGENCE_STEREO_MATCH_MATCH_WINDOW_H
#define VERGENCE_STEREO_MATCH_MATCH_WINDOW_H

#include "stereo/match/match_state.h"

/// Number of rows of the coarser level that `match_plan_windows` reads for a band: those below this
/// one.
int match_window_rows(const struct match_level *level, int band_begin);

/// Chooses the windows of the band that begins at row `band_begin` of a level, into `tiles`: all
/// disparities if there is no coarser level, else those near its surface around the tile. `above`:
/// the windows of the band before. Overwrites `scratch` of one thread.
void match_plan_windows(const struct match_level *level, int band_begin,
                        const struct match_scratch *scratch, const struct match_tile *above,
                        struct match_tile *tiles);

#endif
