// SPDX-License-Identifier: Apache-2.0
#include "console/line/progress_bar.h"

#include <string.h>

#include "core/decimal.h"
#include "core/invariant.h"
#include "core/utf8.h"

enum {
    CELLS_MAX = 40,
    FRAME = 9,  // columns of a bar besides its text and cells
    PERCENT_DIGITS = 3,
};

/// Appends `count` times the same byte.
static char *fill(char *to, char byte, size_t count) {
    memset(to, byte, count);
    return to + count;
}

int progress_bar_draw(char bar[PROGRESS_BAR_BYTES], size_t columns, int text_columns,
                      const char *what, uint64_t done, uint64_t total) {
    INVARIANT(total > 0 && text_columns > 0 && text_columns <= PROGRESS_BAR_TEXT_MAX);
    // A bar that reached the last column would wrap and be drawn repeatedly.
    const int room = columns > FRAME + 4 ? (int)columns - 1 - FRAME : 3;
    const int shown = text_columns < room * 3 / 4 ? text_columns : room * 3 / 4;
    const int cells = room - shown < CELLS_MAX ? room - shown : CELLS_MAX;
    const uint64_t reached = done < total ? done : total;
    const size_t full = (size_t)(reached * (uint64_t)cells / total);
    char name[PROGRESS_BAR_TEXT_MAX + 1], percent[DECIMAL_TEXT_BYTES];
    utf8_copy_printable(what, name, (size_t)shown + 1);
    const size_t name_bytes = strlen(name);
    const size_t digits = decimal_print_integer((int64_t)(reached * 100 / total), percent);
    char *to = fill(bar, '\r', 1);
    memcpy(to, name, name_bytes);
    to = fill(to + name_bytes, ' ', (size_t)shown - name_bytes);
    to = fill(fill(to, ' ', 1), '[', 1);
    to = fill(fill(to, '#', full), '.', (size_t)cells - full);
    to = fill(fill(to, ']', 1), ' ', 1 + PERCENT_DIGITS - digits);
    memcpy(to, percent, digits);
    memcpy(to + digits, " %", sizeof " %");
    return shown + cells + FRAME;
}

void progress_bar_erase(char text[PROGRESS_BAR_BYTES], int width) {
    INVARIANT(width >= 0 && width + 3 <= PROGRESS_BAR_BYTES);
    char *to = text;
    if (width > 0) {
        to = fill(fill(fill(to, '\r', 1), ' ', (size_t)width), '\r', 1);
    }
    *to = '\0';
}
