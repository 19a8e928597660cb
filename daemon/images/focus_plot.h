// SPDX-License-Identifier: Apache-2.0
/// Sharpness against the position of the focus ring, for people (SVG) and programs (CSV).
#ifndef VERGENCE_DAEMON_IMAGES_FOCUS_PLOT_H
#define VERGENCE_DAEMON_IMAGES_FOCUS_PLOT_H

#include <stdio.h>

#include "focus/focus_search.h"

#ifdef __cplusplus
extern "C" {
#endif

/// The search of one lens.
struct focus_plot {
    const char *name;   ///< name of the lens: "left"
    const char *about;  ///< one line on how it was measured; may be empty
    const struct focus_search *search;
};

/// Writes a drawing: one panel a lens, with its samples by leg, the curve through those of the
/// sweep, both peaks, and where the ring is. Errors of `stream` are left in ferror.
void focus_plot_svg(FILE *stream, const struct focus_plot *plots, int count);

/// Writes a table: one line a sample, in the order in which they were taken. Columns: lens, leg
/// (sweep, pass, approach, rest), position in counts, sharpness (relative variance or mean squared
/// gradient) of each measure with its standard deviation, mean above black and saturated share in
/// parts of a thousand, time in ms since the search began.
void focus_plot_csv(FILE *stream, const struct focus_plot *plots, int count);

#ifdef __cplusplus
}
#endif

#endif
