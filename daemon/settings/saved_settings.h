// SPDX-License-Identifier: Apache-2.0
/// Saved settings of the instrument, kept in the store as an INI text: exposure, gain, window and
/// the positions that the axes were sent to. Values that the instrument does not have, or that were
/// never set, are absent.
///
///     version = 4
///     profile = rig
///     window = 640 480 2
///     object = 544.5:0.6
///     [left]
///     exposure = 7000 us
///     gain = 2.5 x
///     pan = 3.97 deg
///     zoom = 420 counts
///     zoom_to_focus = 300:1.5:0.5:3
///     [right]
///
/// A window that is not centred has four more numbers: column and row of the left, then of the
/// right sensor.
///
/// What was learned about the lenses (console/lens_table_text.h): the object, and for each lens
/// lines zoom_to_focus and iris_to_f_number, one for each entry in ascending order.
///
/// Older versions are still read: 3 had no tables, 2 had `left_exposure 7000 us`, 1 had
/// `left_exposure_us 7000`, `left_gain_q3 20` (1/8), `left_pan_urad 69290` and `left_zoom 420`,
/// both after a first line `vergence settings 2`.
#ifndef VERGENCE_DAEMON_SETTINGS_SAVED_SETTINGS_H
#define VERGENCE_DAEMON_SETTINGS_SAVED_SETTINGS_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "daemon/base/message.h"
#include "daemon/settings/saved_lens.h"
#include "rig/rig.h"

#ifdef __cplusplus
extern "C" {
#endif

/// The record's name in the store.
#define SAVED_SETTINGS_RECORD "settings"
enum {
    SAVED_SETTINGS_BYTES = 8192,  ///< largest text, with its end
    SAVED_SETTINGS_LINE_BYTES = SAVED_LENS_LINE_BYTES,
    SAVED_SETTINGS_LINES = 20,
};

enum saved_value {
    SAVED_EXPOSURE_US,
    SAVED_GAIN_Q3,
    SAVED_PAN_URAD,
    SAVED_ZOOM,  ///< this and the next in the order of enum lens_axis
    SAVED_FOCUS,
    SAVED_IRIS,
    SAVED_VALUES
};

struct saved_settings {
    char profile[sizeof((struct rig_profile *)0)->name];
    uint16_t width_px, height_px;  ///< window of the sensors; 0: not saved
    uint8_t skip;                  ///< one pixel in this many is read
    bool placed;                   ///< not centred, and:
    uint16_t column_px[RIG_SIDES], row_px[RIG_SIDES];
    int32_t values[RIG_SIDES][SAVED_VALUES]; /**< INT32_MIN: not saved */
    struct saved_lenses lenses;
};

/// Takes the values in force. The rig must be RIG_READY.
void saved_settings_take(const struct rig *rig, struct saved_settings *saved);

/// Prints the text, zero-terminated. Returns its length.
size_t saved_settings_print(const struct saved_settings *saved, char text[SAVED_SETTINGS_BYTES]);

/// Reads `length` bytes of what `saved_settings_print` prints, or printed in older versions.
/// ERROR_SYNTAX or ERROR_VERSION (a newer version) with a message; `saved` is undefined then.
int saved_settings_parse(const char *text, size_t length, struct saved_settings *saved,
                         struct message *message);

/// Whether this instrument can take all of these values. 0; ERROR_ARGUMENT (saved with another
/// profile), ERROR_NOT_CONNECTED or ERROR_RANGE with a message. The rig must be RIG_READY.
int saved_settings_check(const struct saved_settings *saved, struct rig *rig,
                         struct message *message);

/// The commands that restore these values, in order: first those of the cameras and of tables that
/// the rig has none of (`*of_cameras` of them), then those that move axes or replace tables.
/// Returns their number.
size_t saved_settings_commands(const struct saved_settings *saved, const struct rig *rig,
                               char lines[SAVED_SETTINGS_LINES][SAVED_SETTINGS_LINE_BYTES],
                               size_t *of_cameras);

#ifdef __cplusplus
}
#endif

#endif
