// SPDX-License-Identifier: Apache-2.0
/// Progress bars on a terminal.
#ifndef VERGENCE_CONSOLE_LINE_PROGRESS_BAR_H
#define VERGENCE_CONSOLE_LINE_PROGRESS_BAR_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

enum {
    SCREEN_COLUMNS = 80,  ///< assumed width of a terminal whose size is unknown
    PROGRESS_BAR_TEXT_MAX = 44,
    PROGRESS_BAR_BYTES = 128,
};

/// Writes "WHAT [####....]  42 %", to be shown over the current line of a terminal of `columns`
/// columns: `done` of `total` (> 0). `what` gets `text_columns` (1 .. PROGRESS_BAR_TEXT_MAX), fewer
/// in a narrow window; control characters in it become ?. Returns the columns used.
int progress_bar_draw(char bar[PROGRESS_BAR_BYTES], size_t columns, int text_columns,
                      const char *what, uint64_t done, uint64_t total);

/// Writes what erases a bar of `width` columns; 0: nothing.
void progress_bar_erase(char text[PROGRESS_BAR_BYTES], int width);

#ifdef __cplusplus
}
#endif

#endif
