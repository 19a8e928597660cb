// SPDX-License-Identifier: Apache-2.0
#include "daemon/settings/saved_settings.h"

#include <inttypes.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#include "core/error.h"
#include "core/invariant.h"
#include "daemon/settings/quantity.h"
#include "device/mt9t001.h"

#define FIRST_LINE "vergence settings "

enum {
    VERSION_BARE = 1,  // integers of the firmware, without units
    VERSION = 2,
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

static const char *name_of(int value, int version) {
    return version == VERSION_BARE ? values[value].bare_name : values[value].name;
}

static enum quantity quantity_of(int value, int version) {
    return version == VERSION_BARE ? QUANTITY_NUMBER : values[value].quantity;
}

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

void saved_settings_take(const struct rig *rig, struct saved_settings *saved) {
    INVARIANT(rig->state == RIG_READY);
    *saved = (struct saved_settings){.skip = 1};
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
        for (int i = 0; i < SAVED_VALUES; i++) {
            saved->values[side][i] = NOT_KEPT;
        }
        take_side(rig, side, saved->values[side]);
    }
}

// ---- the text

static size_t print(const struct saved_settings *saved, int version,
                    char text[SAVED_SETTINGS_BYTES]) {
    int length = snprintf(text, SAVED_SETTINGS_BYTES, FIRST_LINE "%d\nprofile %s\n", version,
                          saved->profile);
    if (saved->width_px != 0) {
        length +=
            snprintf(text + length, SAVED_SETTINGS_BYTES - (size_t)length, "window %u %u %u\n",
                     (unsigned)saved->width_px, (unsigned)saved->height_px, (unsigned)saved->skip);
    }
    for (unsigned side = 0; side < RIG_SIDES; side++) {
        for (int i = 0; i < SAVED_VALUES; i++) {
            char value[QUANTITY_BYTES];
            if (saved->values[side][i] == NOT_KEPT) {
                continue;
            }
            quantity_print(quantity_of(i, version), saved->values[side][i], value);
            length += snprintf(text + length, SAVED_SETTINGS_BYTES - (size_t)length, "%s_%s %s\n",
                               side_names[side], name_of(i, version), value);
        }
    }
    INVARIANT(length > 0 && length < SAVED_SETTINGS_BYTES);
    return (size_t)length;
}

size_t saved_settings_print(const struct saved_settings *saved, char text[SAVED_SETTINGS_BYTES]) {
    return print(saved, VERSION, text);
}

static bool is_name(const char *name) {
    static const char characters[] =
        "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789-_.";
    const size_t length = strlen(name);
    return length > 0 && length < sizeof((struct saved_settings *)0)->profile &&
           strspn(name, characters) == length;
}

/// Width, height and skip, each followed by a blank or the end.
static bool read_window(char *text, struct saved_settings *saved) {
    static const int64_t min[] = {SIZE_MIN_PX, SIZE_MIN_PX, 1};
    static const int64_t max[] = {SIZE_MAX_PX, SIZE_MAX_PX, SKIP_MAX};
    int64_t numbers[3];
    for (int i = 0; i < 3; i++) {
        char *end = text + strcspn(text, " ");
        const bool last = *end == '\0';
        *end = '\0';
        if (last != (i == 2) ||
            quantity_parse(QUANTITY_NUMBER, text, min[i], max[i], &numbers[i]) != QUANTITY_GOOD) {
            return false;
        }
        text = end + 1;
    }
    saved->width_px = (uint16_t)numbers[0];
    saved->height_px = (uint16_t)numbers[1];
    saved->skip = (uint8_t)numbers[2];
    return true;
}

static bool read_value(const char *key, const char *text, int version,
                       struct saved_settings *saved) {
    for (unsigned side = 0; side < RIG_SIDES; side++) {
        const size_t bytes = strlen(side_names[side]);
        for (int i = 0; i < SAVED_VALUES; i++) {
            int64_t value = 0;
            if (strncmp(key, side_names[side], bytes) != 0 || key[bytes] != '_' ||
                strcmp(key + bytes + 1, name_of(i, version)) != 0) {
                continue;
            }
            if (quantity_parse(quantity_of(i, version), text, values[i].min, values[i].max,
                               &value) != QUANTITY_GOOD) {
                return false;
            }
            saved->values[side][i] = (int32_t)value;
            return true;
        }
    }
    return false;
}

/// Any line but the first; false: not valid.
static bool read_line(char *line, int version, struct saved_settings *saved) {
    char *blank = strchr(line, ' ');
    if (blank == NULL) {
        return false;
    }
    *blank = '\0';
    char *value = blank + 1;
    if (strcmp(line, "profile") == 0) {
        if (!is_name(value)) {
            return false;
        }
        strcpy(saved->profile, value);
        return true;
    }
    return strcmp(line, "window") == 0 ? read_window(value, saved)
                                       : read_value(line, value, version, saved);
}

/// The version that the first line names; 0: not one that is known.
static int read_version(const char *line) {
    const size_t bytes = sizeof FIRST_LINE - 1;
    const bool known = strncmp(line, FIRST_LINE, bytes) == 0 && line[bytes] >= '0' + VERSION_BARE &&
                       line[bytes] <= '0' + VERSION && line[bytes + 1] == '\0';
    return known ? line[bytes] - '0' : 0;
}

/// Copies the next line without its end, and moves `*at` behind it; false: not a whole line.
static bool next_line(const char *text, size_t length, size_t *at,
                      char line[SAVED_SETTINGS_LINE_BYTES]) {
    const char *end = memchr(text + *at, '\n', length - *at);
    const size_t bytes = end != NULL ? (size_t)(end - text) - *at : 0;
    if (end == NULL || bytes >= SAVED_SETTINGS_LINE_BYTES ||
        memchr(text + *at, '\0', bytes) != NULL) {
        return false;
    }
    memcpy(line, text + *at, bytes);
    line[bytes] = '\0';
    *at += bytes + 1;
    return true;
}

int saved_settings_parse(const char *text, size_t length, struct saved_settings *saved,
                         struct message *message) {
    char again[SAVED_SETTINGS_BYTES];
    *saved = (struct saved_settings){.skip = 1};
    for (unsigned side = 0; side < RIG_SIDES; side++) {
        for (int i = 0; i < SAVED_VALUES; i++) {
            saved->values[side][i] = NOT_KEPT;
        }
    }
    int number = 0, version = 0;
    for (size_t at = 0; at < length;) {
        char line[SAVED_SETTINGS_LINE_BYTES];
        bool valid = next_line(text, length, &at, line);
        number++;
        if (valid && number == 1) {
            version = read_version(line);
            valid = version != 0;
        } else if (valid) {
            valid = read_line(line, version, saved);
        }
        if (!valid) {
            return message_set(message, ERROR_SYNTAX, "invalid line %d", number);
        }
    }
    // The order, each line once, no leading zeros: as printed.
    if (saved->profile[0] == '\0' || print(saved, version, again) != length ||
        memcmp(text, again, length) != 0) {
        return message_set(message, ERROR_SYNTAX, "not in the canonical form");
    }
    return 0;
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

static bool has_axis(const struct rig *rig, unsigned side, int axis) {
    const enum rig_profile_lenses lenses = rig->profile.lenses;
    const bool lens = lenses == RIG_LENSES_V3LC || (lenses == RIG_LENSES_V1LC && side == RIG_LEFT);
    return lens && (rig->camera[side].lens.abilities.axes >> axis & 1) != 0;
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
        if (!has_axis(rig, side, axis) ||
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

/// `number` / `parts` with `decimals` decimals; `parts` is 10 to that power.
static const char *decimal(int64_t number, int64_t parts, int decimals, char text[32]) {
    const int64_t size = number < 0 ? -number : number;
    snprintf(text, 32, "%s%" PRId64 ".%0*" PRId64, number < 0 ? "-" : "", size / parts, decimals,
             size % parts);
    return text;
}

/// With enough decimals to give the same angle in urad.
static const char *degrees(int32_t urad, char text[32]) {
    enum { DECIMALS = 6, PARTS = 1000000 };
    const double parts = urad * 180.0 / 3.14159265358979323846;
    return decimal((int64_t)(parts < 0 ? parts - 0.5 : parts + 0.5), PARTS, DECIMALS, text);
}

static void add_cameras(const struct saved_settings *saved, const struct rig *rig,
                        struct list *list) {
    enum { GAIN_PARTS = 8, THOUSANDTHS = 1000 };
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
        char text[32];
        const int32_t *value = saved->values[side];
        if (value[SAVED_EXPOSURE_US] != NOT_KEPT) {
            add(list, "exposure %s %" PRId32, side_names[side], value[SAVED_EXPOSURE_US]);
        }
        if (value[SAVED_GAIN_Q3] != NOT_KEPT) {
            const int64_t gain = (int64_t)value[SAVED_GAIN_Q3] * (THOUSANDTHS / GAIN_PARTS);
            add(list, "gain %s %s", side_names[side], decimal(gain, THOUSANDTHS, 3, text));
        }
    }
}

static void add_axes(const struct saved_settings *saved, struct list *list) {
    char text[RIG_SIDES][32];
    const int32_t *left = saved->values[RIG_LEFT], *right = saved->values[RIG_RIGHT];
    if (left[SAVED_PAN_URAD] != NOT_KEPT && right[SAVED_PAN_URAD] != NOT_KEPT) {
        add(list, "pan both %s %s", degrees(left[SAVED_PAN_URAD], text[RIG_LEFT]),
            degrees(right[SAVED_PAN_URAD], text[RIG_RIGHT]));
    }
    for (unsigned side = 0; side < RIG_SIDES; side++) {
        const int32_t pan_urad = saved->values[side][SAVED_PAN_URAD];
        if (pan_urad != NOT_KEPT && saved->values[1 - side][SAVED_PAN_URAD] == NOT_KEPT) {
            add(list, "pan %s %s", side_names[side], degrees(pan_urad, text[side]));
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
