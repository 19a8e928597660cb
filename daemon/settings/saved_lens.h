// SPDX-License-Identifier: Apache-2.0
/// The tables of what was learned about the lenses, in the saved settings. Each entry has a line of
/// its own, as lines of INI files are short.
#ifndef VERGENCE_DAEMON_SETTINGS_SAVED_LENS_H
#define VERGENCE_DAEMON_SETTINGS_SAVED_LENS_H

#include <stdbool.h>
#include <stddef.h>
#include <stdio.h>

#include "rig/rig.h"

#ifdef __cplusplus
extern "C" {
#endif

enum {
    SAVED_LENS_LINE_BYTES = 513,  ///< size of a buffer for a command, with its end
    SAVED_LENS_LINES = 5,
};

/// Part of the saved settings.
struct saved_lenses {
    struct lens_learned learned[RIG_SIDES];
    struct lens_object object;
};

/// Takes what the rig has learned, in any state of the rig.
void saved_lens_take(const struct rig *rig, struct saved_lenses *saved);

/// Prints the object, and the tables of a side.
void saved_lens_print_object(const struct saved_lenses *saved, FILE *file);
void saved_lens_print(const struct saved_lenses *saved, unsigned side, FILE *file);

/// Reads a line of the object (key "object") or of a side's tables ("left.zoom_to_focus"); false:
/// not such a line, or invalid.
bool saved_lens_read(struct saved_lenses *saved, const char *key, const char *text);

/// Appends the commands that set the tables that are saved: those that this rig has none of
/// (`missing`), or those that differ from the rig's. At most SAVED_LENS_LINES. Returns the new
/// number of lines.
size_t saved_lens_commands(const struct saved_lenses *saved, const struct rig *rig, bool missing,
                           char (*lines)[SAVED_LENS_LINE_BYTES], size_t count);

#ifdef __cplusplus
}
#endif

#endif
