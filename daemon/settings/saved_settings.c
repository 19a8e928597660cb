// SPDX-License-Identifier: Apache-2.0
#include "daemon/settings/saved_settings.h"

#include <inttypes.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/error.h"
#include "core/invariant.h"
#include "daemon/settings/ini_text.h"
#include "daemon/settings/quantity.h"
#include "device/mt9t001.h"

#define OLD_FIRST_LINE "vergence settings "

enum {
    VERSION_BARE = 1,    // lines `KEY VALUE` with the integers of the firmware
    VERSION_BLANKS = 2,  // lines `KEY VALUE`
    VERSION = 3,
    NOT_KEPT = INT32_MIN,
    SIZE_MIN_PX = 16,
    SIZE_MAX_PX = 16384,
    SKIP_MAX = 8,
    PAN_MAX_URAD = 1570796,
    POSITION_MAX = 65535,
};

static const char *const side_names[RIG_SIDES] = {"left", "right"};

static const struct {
    const char *name;
    enum quantity quantity;
    const char *bare_name;  ///< in VERSION_BARE
    int32_t min, max;
} values[SAVED_VALUES] = {
    [SAVED_EXPOSURE_US] = {"exposure", QUANTITY_US, "exposure_us", 1, RIG_EXPOSURE_MAX_US},
    [SAVED_GAIN_Q3] = {"gain", QUANTITY_GAIN, "gain_q3", MT9T001_GAIN_Q3_MIN, MT9T001_GAIN_Q3_MAX},
    [SAVED_PAN_URAD] = {"pan", QUANTITY_ANGLE, "pan_urad", -PAN_MAX_URAD, PAN_MAX_URAD},
    [SAVED_ZOOM] = {"zoom", QUANTITY_COUNTS, "zoom", 0, POSITION_MAX},
    [SAVED_FOCUS] = {"focus", QUANTITY_COUNTS, "focus", 0, POSITION_MAX},
    [SAVED_IRIS] = {"iris", QUANTITY_COUNTS, "iris", 0, POSITION_MAX},
};

static int32_t within(int64_t value, int32_t min, int32_t max) {
    return (int32_t)(value < min ? min : value > max ? max : value);
}

// ---- values in force

static void take_side(const struct rig *rig, unsigned side, int32_t *saved) {
    const struct rig_profile *profile = &rig->profile;
    if (rig->camera[side].exposure_us != 0) {
        // Rounded to rows, it may exceed the longest exposure that can be requested.
        saved[SAVED_EXPOSURE_US] = within(rig->camera[side].exposure_us, 1, RIG_EXPOSURE_MAX_US);
    }
    if (rig->camera[side].gain_q3 != 0) {
        saved[SAVED_GAIN_Q3] = rig->camera[side].gain_q3;
    }
    if (profile->servos && rig->camera[side].pan_q4 != 0) {
        // A cancelled turn may have ended outside the range, where its approach goes.
        saved[SAVED_PAN_URAD] =
            within(servo_angle_urad(&profile->servo[side], rig->camera[side].pan_q4),
                   profile->pan_min_urad, profile->pan_max_urad);
    }
    for (int axis = 0; axis < LENS_AXES; axis++) {
        saved[SAVED_ZOOM + axis] = rig->camera[side].lens.commanded[axis];
    }
}

static void clear(struct saved_settings *saved) {
    *saved = (struct saved_settings){.skip = 1};
    for (unsigned side = 0; side < RIG_SIDES; side++) {
        for (int i = 0; i < SAVED_VALUES; i++) {
            saved->values[side][i] = NOT_KEPT;
        }
    }
}

void saved_settings_take(const struct rig *rig, struct saved_settings *saved) {
    INVARIANT(rig->state == RIG_READY);
    clear(saved);
    memcpy(saved->profile, rig->profile.name, sizeof saved->profile);
    if (rig->profile.bridge) {
        const struct mt9t001_window *window = &rig->camera[RIG_LEFT].sensor.window;
        saved->width_px = window->width_px;
        saved->height_px = window->height_px;
        saved->skip = window->skip;
    } else {
        saved->width_px = rig->format.width_px;
        saved->height_px = rig->format.height_px;
    }
    for (unsigned side = 0; side < RIG_SIDES; side++) {
        take_side(rig, side, saved->values[side]);
    }
}

// ---- the text

size_t saved_settings_print(const struct saved_settings *saved, char text[SAVED_SETTINGS_BYTES]) {
    FILE *file = fmemopen(text, SAVED_SETTINGS_BYTES, "w");
    INVARIANT(file != NULL);
    fprintf(file, "version = %d\nprofile = %s\n", VERSION, saved->profile);
    if (saved->width_px != 0) {
        fprintf(file, "window = %u %u %u\n", (unsigned)saved->width_px, (unsigned)saved->height_px,
                (unsigned)saved->skip);
    }
    for (unsigned side = 0; side < RIG_SIDES; side++) {
        fprintf(file, "[%s]\n", side_names[side]);
        for (int i = 0; i < SAVED_VALUES; i++) {
            char value[QUANTITY_BYTES];
            if (saved->values[side][i] != NOT_KEPT) {
                quantity_print(values[i].quantity, saved->values[side][i], value);
                fprintf(file, "%s = %s\n", values[i].name, value);
            }
        }
    }
    const long length = ftell(file);
    INVARIANT(length > 0 && length < SAVED_SETTINGS_BYTES);
    fclose(file);
    return (size_t)length;
}

/// A text being read.
struct reading {
    struct saved_settings *saved;
    int version;  ///< 0: not yet known
};

static bool read_window(struct saved_settings *saved, const char *text) {
    unsigned width_px = 0, height_px = 0, skip = 0;
    int end = 0;
    if (sscanf(text, "%u %u %u%n", &width_px, &height_px, &skip, &end) != 3 || text[end] != '\0' ||
        width_px < SIZE_MIN_PX || width_px > SIZE_MAX_PX || height_px < SIZE_MIN_PX ||
        height_px > SIZE_MAX_PX || skip < 1 || skip > SKIP_MAX) {
        return false;
    }
    saved->width_px = (uint16_t)width_px;
    saved->height_px = (uint16_t)height_px;
    saved->skip = (uint8_t)skip;
    return true;
}

/// Reads a value of a side; versions before 3 have left_zoom for left.zoom.
static bool read_value(const struct reading *self, const char *key, const char *text) {
    const bool bare = self->version == VERSION_BARE;
    for (unsigned side = 0; side < RIG_SIDES; side++) {
        const size_t bytes = strlen(side_names[side]);
        if (strncmp(key, side_names[side], bytes) != 0 ||
            key[bytes] != (self->version < VERSION ? '_' : '.')) {
            continue;
        }
        for (int i = 0; i < SAVED_VALUES; i++) {
            int64_t value = 0;
            struct message why;
            if (strcmp(key + bytes + 1, bare ? values[i].bare_name : values[i].name) == 0 &&
                quantity_parse(bare ? QUANTITY_NUMBER : values[i].quantity, text, values[i].min,
                               values[i].max, &value, &why) == 0) {
                self->saved->values[side][i] = (int32_t)value;
                return true;
            }
        }
    }
    return false;
}

/// Gets the version, which is `min` to `max` in this form.
static int read_version(struct reading *self, const char *text, int min, int max,
                        struct message *message) {
    int64_t version = 0;
    struct message why;
    if (quantity_parse(QUANTITY_NUMBER, text, min, max, &version, &why) != 0) {
        return message_set(message, ERROR_VERSION,
                           "version %.20s of saved settings is not supported (this program reads "
                           "%d to %d)",
                           text, VERSION_BARE, VERSION);
    }
    self->version = (int)version;
    return 0;
}

static int read_line(void *cookie, const char *key, const char *value, int line,
                     struct message *message) {
    struct reading *self = cookie;
    struct saved_settings *saved = self->saved;
    bool good = false;
    if (self->version == 0) {
        return strcmp(key, "version") == 0
                   ? read_version(self, value, VERSION, VERSION, message)
                   : message_set(message, ERROR_SYNTAX, "line %d: version missing", line);
    }
    if (strcmp(key, "profile") == 0 && strlen(value) < sizeof saved->profile) {
        strcpy(saved->profile, value);
        good = true;
    } else {
        good =
            strcmp(key, "window") == 0 ? read_window(saved, value) : read_value(self, key, value);
    }
    return good ? 0
                : message_set(message, ERROR_SYNTAX, "line %d: invalid %.40s = %.100s", line, key,
                              value);
}

/// Makes `KEY = VALUE` of the lines `KEY VALUE` of versions before 3, and gets the version.
static int convert_old(char *text, size_t *length, struct reading *self, struct message *message) {
    const size_t bytes = strlen(OLD_FIRST_LINE);
    char *feed = strchr(text, '\n');
    if (feed == NULL || strncmp(text, OLD_FIRST_LINE, bytes) != 0) {
        return 0;
    }
    *feed = '\0';
    const int error = read_version(self, text + bytes, VERSION_BARE, VERSION_BLANKS, message);
    memset(text, '#', (size_t)(feed - text));
    *feed = '\n';
    bool in_key = true;
    for (char *at = feed; *at != '\0'; at++) {
        if (*at == '\n') {
            in_key = true;
        } else if (*at == ' ' && in_key) {
            *at = '=';
            in_key = false;
        }
    }
    *length = strlen(text);
    return error;
}

int saved_settings_parse(const char *text, size_t length, struct saved_settings *saved,
                         struct message *message) {
    char copy[SAVED_SETTINGS_BYTES];
    struct reading self = {.saved = saved};
    int line = 0;
    clear(saved);
    if (length >= sizeof copy) {
        return message_set(message, ERROR_SYNTAX, "too long");
    }
    memcpy(copy, text, length);
    copy[length] = '\0';
    int error = convert_old(copy, &length, &self, message);
    error = error != 0 ? error : ini_text_read(copy, length, read_line, &self, &line, message);
    return error == 0 && saved->profile[0] == '\0'
               ? message_set(message, ERROR_SYNTAX, "profile missing")
               : error;
}

// ---- whether an instrument can take the values

static int refuse(struct message *message, int error, const char *format, ...)
    __attribute__((format(printf, 3, 4)));
static int refuse(struct message *message, int error, const char *format, ...) {
    char why[MESSAGE_BYTES - 128];
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(why, sizeof why, format, arguments);
    va_end(arguments);
    return message_set(message, error,
                       "saved settings do not fit this instrument: %s (set it up, then use "
                       "\"settings save\")",
                       why);
}

static int check_window(const struct saved_settings *saved, const struct rig *rig,
                        struct message *message) {
    struct mt9t001_window window;
    const bool good = !rig->profile.bridge
                          ? saved->skip == 1
                          : mt9t001_centred_window(saved->width_px, saved->height_px, saved->skip,
                                                   1, &window) == 0;
    return saved->width_px == 0 || good
               ? 0
               : refuse(message, ERROR_RANGE, "unsupported window %u x %u px, skip %u",
                        (unsigned)saved->width_px, (unsigned)saved->height_px,
                        (unsigned)saved->skip);
}

static int check_pan(const struct saved_settings *saved, const struct rig *rig, unsigned side,
                     struct message *message) {
    const struct rig_profile *profile = &rig->profile;
    const int32_t pan_urad = saved->values[side][SAVED_PAN_URAD];
    if (pan_urad == NOT_KEPT) {
        return 0;
    }
    if (!profile->servos) {
        return refuse(message, ERROR_NOT_CONNECTED, "no pan servos");
    }
    uint16_t width_q4 = 0;
    char angle[QUANTITY_BYTES];
    quantity_print(QUANTITY_ANGLE, pan_urad, angle);
    const bool good = pan_urad >= profile->pan_min_urad && pan_urad <= profile->pan_max_urad &&
                      servo_width_q4(&profile->servo[side], pan_urad, &width_q4) == 0;
    return good ? 0
                : refuse(message, ERROR_RANGE, "%s pan %s out of range", side_names[side], angle);
}

static int check_lens(const struct saved_settings *saved, struct rig *rig, unsigned side,
                      struct message *message) {
    for (int axis = 0; axis < LENS_AXES; axis++) {
        const int32_t position = saved->values[side][SAVED_ZOOM + axis];
        const char *name = values[SAVED_ZOOM + axis].name;
        struct lens_limits limits;
        if (position == NOT_KEPT) {
            continue;
        }
        if (!rig_has_axis(&rig->profile, side, (enum lens_axis)axis) ||
            rig_lens_limits(rig, side, (enum lens_axis)axis, &limits) != 0) {
            return refuse(message, ERROR_NOT_CONNECTED, "no %s %s motor", side_names[side], name);
        }
        if (position < limits.min || position > limits.max) {
            return refuse(message, ERROR_RANGE,
                          "%s %s %" PRId32 " out of range (%" PRId32 " to %" PRId32 " counts)",
                          side_names[side], name, position, limits.min, limits.max);
        }
    }
    return 0;
}

int saved_settings_check(const struct saved_settings *saved, struct rig *rig,
                         struct message *message) {
    INVARIANT(rig->state == RIG_READY);
    if (strcmp(saved->profile, rig->profile.name) != 0) {
        return refuse(message, ERROR_ARGUMENT, "saved with the profile %s, this one is %s",
                      saved->profile, rig->profile.name);
    }
    int error = check_window(saved, rig, message);
    for (unsigned side = 0; side < RIG_SIDES && error == 0; side++) {
        error = check_pan(saved, rig, side, message);
        error = error != 0 ? error : check_lens(saved, rig, side, message);
    }
    return error;
}

// ---- commands

struct list {
    char (*lines)[SAVED_SETTINGS_LINE_BYTES];
    size_t count;
};

static void add(struct list *list, const char *format, ...) __attribute__((format(printf, 2, 3)));
static void add(struct list *list, const char *format, ...) {
    INVARIANT(list->count < SAVED_SETTINGS_LINES);
    va_list arguments;
    va_start(arguments, format);
    const int length =
        vsnprintf(list->lines[list->count++], SAVED_SETTINGS_LINE_BYTES, format, arguments);
    va_end(arguments);
    INVARIANT(length > 0 && length < SAVED_SETTINGS_LINE_BYTES);
}

static void add_cameras(const struct saved_settings *saved, const struct rig *rig,
                        struct list *list) {
    struct saved_settings now;
    saved_settings_take(rig, &now);
    // An unchanged window does not restart the cameras.
    const bool same = saved->width_px == now.width_px && saved->height_px == now.height_px &&
                      saved->skip == now.skip;
    if (saved->width_px != 0 && !same) {
        add(list, "window %u %u %u", (unsigned)saved->width_px, (unsigned)saved->height_px,
            (unsigned)saved->skip);
    }
    for (unsigned side = 0; side < RIG_SIDES; side++) {
        const int32_t *value = saved->values[side];
        if (value[SAVED_EXPOSURE_US] != NOT_KEPT) {
            add(list, "exposure %s %" PRId32, side_names[side], value[SAVED_EXPOSURE_US]);
        }
        if (value[SAVED_GAIN_Q3] != NOT_KEPT) {
            add(list, "gain %s %.3f", side_names[side], value[SAVED_GAIN_Q3] / 8.0);
        }
    }
}

/// With enough decimals to give the same angle in urad.
static double degrees(int32_t urad) {
    return urad * 180e-6 / 3.14159265358979323846;
}

static void add_axes(const struct saved_settings *saved, struct list *list) {
    const int32_t *left = saved->values[RIG_LEFT], *right = saved->values[RIG_RIGHT];
    const bool both = left[SAVED_PAN_URAD] != NOT_KEPT && right[SAVED_PAN_URAD] != NOT_KEPT;
    if (both) {
        add(list, "pan both %.6f %.6f", degrees(left[SAVED_PAN_URAD]),
            degrees(right[SAVED_PAN_URAD]));
    }
    for (unsigned side = 0; side < RIG_SIDES && !both; side++) {
        if (saved->values[side][SAVED_PAN_URAD] != NOT_KEPT) {
            add(list, "pan %s %.6f", side_names[side],
                degrees(saved->values[side][SAVED_PAN_URAD]));
        }
    }
    for (int i = SAVED_ZOOM; i <= SAVED_IRIS; i++) {
        if (left[i] != NOT_KEPT && left[i] == right[i]) {
            add(list, "%s both %" PRId32, values[i].name, left[i]);
            continue;
        }
        for (unsigned side = 0; side < RIG_SIDES; side++) {
            if (saved->values[side][i] != NOT_KEPT) {
                add(list, "%s %s %" PRId32, values[i].name, side_names[side],
                    saved->values[side][i]);
            }
        }
    }
}

size_t saved_settings_commands(const struct saved_settings *saved, const struct rig *rig,
                               char lines[SAVED_SETTINGS_LINES][SAVED_SETTINGS_LINE_BYTES],
                               size_t *of_cameras) {
    struct list list = {.lines = lines};
    add_cameras(saved, rig, &list);
    *of_cameras = list.count;
    add_axes(saved, &list);
    return list.count;
}
