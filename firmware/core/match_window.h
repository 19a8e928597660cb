// SPDX-License-Identifier: Apache-2.0
/// Which disparities each tile of a band searches. Private to match*.c.
#ifndef VERGENCE_CORE_MATCH_WINDOW_H
#define VERGENCE_CORE_MATCH_WINDOW_H

#include "core/match_state.h"

/// Rows of the coarser level that `match_plan_windows` reads for a band: those below this one.
int match_window_rows(const struct match_level *level, int band_begin);

/// Plans the windows of the band that begins at row `band_begin` of a level, into `tiles`: all
/// disparities where there is no coarser level, else those near its surface around the tile.
/// `columns` is scratch for 2 x the coarser level's width, `above` the windows of the band before.
void match_plan_windows(const struct match_level *level, int band_begin, uint16_t *columns,
                        const struct match_tile *above, struct match_tile *tiles);

#endif
