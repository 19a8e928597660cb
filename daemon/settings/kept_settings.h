// SPDX-License-Identifier: Apache-2.0
/// What somebody has set the instrument to, as it is kept in the store: exposure, gain and window,
/// and where the axes were sent. A canonical text of lines `KEY VALUE`: printing what was read
/// gives the same bytes. What an instrument does not have, or nobody has set, is not in it.
#ifndef VERGENCE_DAEMON_SETTINGS_KEPT_SETTINGS_H
#define VERGENCE_DAEMON_SETTINGS_KEPT_SETTINGS_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "daemon/base/message.h"
#include "rig/rig.h"

#ifdef __cplusplus
extern "C" {
#endif

/// The record's name in the store.
#define KEPT_SETTINGS_RECORD "settings"
enum {
    KEPT_SETTINGS_BYTES = 1024,  ///< of the text, with its end, at most
    KEPT_SETTINGS_LINE_BYTES = 96,
    KEPT_SETTINGS_LINES = 16,
};

enum kept_value {
    KEPT_EXPOSURE_US,
    KEPT_GAIN_Q3,
    KEPT_PAN_URAD,
    KEPT_ZOOM,  ///< this and the next in the order of enum lens_axis
    KEPT_FOCUS,
    KEPT_IRIS,
    KEPT_VALUES
};

struct kept_settings {
    char profile[sizeof((struct rig_profile *)0)->name];
    uint16_t width_px, height_px;           ///< of the sensors' part that frames show; 0: not kept
    uint8_t skip;                           ///< every so many pixels of it
    int32_t values[RIG_SIDES][KEPT_VALUES]; /**< INT32_MIN: not kept */
};

/// What is in force now. The rig must be RIG_READY.
void kept_settings_take(const struct rig *rig, struct kept_settings *kept);

/// Prints all of it, with an end. Returns the length.
size_t kept_settings_print(const struct kept_settings *kept, char text[KEPT_SETTINGS_BYTES]);

/// Reads what `kept_settings_print` prints, `length` bytes. ERROR_SYNTAX or ERROR_RANGE with a
/// message that says which line; `kept` is undefined then.
int kept_settings_parse(const char *text, size_t length, struct kept_settings *kept,
                        struct message *message);

/// Whether this instrument can be set so, all of it. 0; ERROR_ARGUMENT (they are another
/// profile's), ERROR_NOT_CONNECTED, ERROR_RANGE, with a message. The rig must be RIG_READY.
int kept_settings_check(const struct kept_settings *kept, struct rig *rig, struct message *message);

/// The commands that set the instrument so, in the order in which they are to be given: first those
/// of the cameras (`*of_cameras` of them), then those that move axes. Returns their number.
size_t kept_settings_commands(const struct kept_settings *kept, const struct rig *rig,
                              char lines[KEPT_SETTINGS_LINES][KEPT_SETTINGS_LINE_BYTES],
                              size_t *of_cameras);

#ifdef __cplusplus
}
#endif

#endif
