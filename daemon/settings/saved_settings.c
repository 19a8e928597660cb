// SPDX-License-Identifier: Apache-2.0
#include "daemon/settings/saved_settings.h"

#include <inttypes.h>
#include <stdio.h>
#include <string.h>

#include "core/error.h"
#include "core/invariant.h"
#include "core/math.h"
#include "daemon/settings/ini_text.h"
#include "daemon/settings/quantity.h"
#include "daemon/settings/saved_lens.h"
#include "device/mt9t001.h"

#define OLD_FIRST_LINE "vergence settings "

enum {
    VERSION_BARE = 1,    // lines `KEY VALUE` with the integers of the firmware
    VERSION_BLANKS = 2,  // lines `KEY VALUE`
    VERSION_INI = 3,     // no tables of the lenses yet
    VERSION = 4,
    NOT_KEPT = INT32_MIN,
    SIZE_MIN_PX = 16,
    SIZE_MAX_PX = 16384,
    SKIP_MAX = 8,
    PAN_MAX_URAD = 1570796,
    POSITION_MAX = 65535,
};

static const struct {
    const char *name;
    enum quantity quantity;
    const char *bare_name;  ///< name in files of VERSION_BARE
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
    if (value < min) {
        return min;
    }
    return (int32_t)(value > max ? max : value);
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

static void take_window(const struct rig *rig, struct saved_settings *saved) {
    const struct mt9t001_window *window = &rig->camera[RIG_LEFT].sensor.window;
    struct mt9t001_window centred;
    const int error =
        mt9t001_centred_window(window->width_px, window->height_px, window->skip, 1, &centred);
    INVARIANT(error == ERROR_OK);
    saved->width_px = window->width_px;
    saved->height_px = window->height_px;
    saved->skip = window->skip;
    for (unsigned side = 0; side < RIG_SIDES; side++) {
        window = &rig->camera[side].sensor.window;
        saved->column_px[side] = window->column_px;
        saved->row_px[side] = window->row_px;
        saved->placed = saved->placed || window->column_px != centred.column_px ||
                        window->row_px != centred.row_px;
    }
}

void saved_settings_take(const struct rig *rig, struct saved_settings *saved) {
    INVARIANT(rig->state == RIG_READY);
    clear(saved);
    memcpy(saved->profile, rig->profile.name, sizeof saved->profile);
    if (rig->profile.bridge) {
        take_window(rig, saved);
    } else {
        saved->width_px = rig->format.width_px;
        saved->height_px = rig->format.height_px;
    }
    for (unsigned side = 0; side < RIG_SIDES; side++) {
        take_side(rig, side, saved->values[side]);
    }
    saved_lens_take(rig, &saved->lenses);
}

// ---- the text

size_t saved_settings_print(const struct saved_settings *saved, char text[SAVED_SETTINGS_BYTES]) {
    FILE *file = fmemopen(text, SAVED_SETTINGS_BYTES, "w");
    INVARIANT(file != NULL);
    fprintf(file, "version = %d\nprofile = %s\n", VERSION, saved->profile);
    if (saved->width_px != 0) {
        fprintf(file, "window = %u %u %u", (unsigned)saved->width_px, (unsigned)saved->height_px,
                (unsigned)saved->skip);
        for (unsigned side = 0; side < RIG_SIDES && saved->placed; side++) {
            fprintf(file, " %u %u", (unsigned)saved->column_px[side],
                    (unsigned)saved->row_px[side]);
        }
        fprintf(file, "\n");
    }
    saved_lens_print_object(&saved->lenses, file);
    for (unsigned side = 0; side < RIG_SIDES; side++) {
        fprintf(file, "[%s]\n", rig_side_names[side]);
        for (int i = 0; i < SAVED_VALUES; i++) {
            char value[QUANTITY_BYTES];
            if (saved->values[side][i] != NOT_KEPT) {
                quantity_print(values[i].quantity, saved->values[side][i], value);
                fprintf(file, "%s = %s\n", values[i].name, value);
            }
        }
        saved_lens_print(&saved->lenses, side, file);
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
    enum { SIZE = 3, ALL = SIZE + 2 * RIG_SIDES };
    static const struct {
        unsigned min, max;
    } limits[ALL] = {
        {SIZE_MIN_PX, SIZE_MAX_PX}, {SIZE_MIN_PX, SIZE_MAX_PX}, {1, SKIP_MAX},   {0, SIZE_MAX_PX},
        {0, SIZE_MAX_PX},           {0, SIZE_MAX_PX},           {0, SIZE_MAX_PX}};
    unsigned numbers[ALL];
    int count = 0, bytes = 0;
    while (count < ALL && sscanf(text, "%u%n", &numbers[count], &bytes) == 1) {
        if (numbers[count] < limits[count].min || numbers[count] > limits[count].max) {
            return false;
        }
        text += bytes;
        count++;
    }
    if (*text != '\0' || (count != SIZE && count != ALL)) {
        return false;
    }
    saved->width_px = (uint16_t)numbers[0];
    saved->height_px = (uint16_t)numbers[1];
    saved->skip = (uint8_t)numbers[2];
    saved->placed = count == ALL;
    for (unsigned side = 0; side < RIG_SIDES && saved->placed; side++) {
        saved->column_px[side] = (uint16_t)numbers[SIZE + 2 * side];
        saved->row_px[side] = (uint16_t)numbers[SIZE + 2 * side + 1];
    }
    return true;
}

/// Reads a value of a side; versions before 3 have left_zoom for left.zoom.
static bool read_value(const struct reading *self, const char *key, const char *text) {
    const bool bare = self->version == VERSION_BARE;
    INVARIANT(self->version >= VERSION_BARE && self->version <= VERSION);
    for (unsigned side = 0; side < RIG_SIDES; side++) {
        const size_t bytes = strlen(rig_side_names[side]);
        if (strncmp(key, rig_side_names[side], bytes) != 0 ||
            key[bytes] != (self->version < VERSION_INI ? '_' : '.')) {
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
    return ERROR_OK;
}

static int read_line(void *cookie, const char *key, const char *value, int line,
                     struct message *message) {
    struct reading *self = cookie;
    struct saved_settings *saved = self->saved;
    bool good = false;
    if (self->version == 0) {
        return strcmp(key, "version") == 0
                   ? read_version(self, value, VERSION_INI, VERSION, message)
                   : message_set(message, ERROR_SYNTAX, "line %d: version missing", line);
    }
    if (strcmp(key, "profile") == 0 && strlen(value) < sizeof saved->profile) {
        strcpy(saved->profile, value);
        good = true;
    } else {
        good = strcmp(key, "window") == 0
                   ? read_window(saved, value)
                   : read_value(self, key, value) ||
                         (self->version >= VERSION && saved_lens_read(&saved->lenses, key, value));
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
        return ERROR_OK;
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
    error =
        error != ERROR_OK ? error : ini_text_read(copy, length, read_line, &self, &line, message);
    return error == ERROR_OK && saved->profile[0] == '\0'
               ? message_set(message, ERROR_SYNTAX, "profile missing")
               : error;
}

// ---- whether an instrument can take the values

/// Range of a value on this instrument; false: it does not have the part.
static bool range_of(struct rig *rig, unsigned side, int value, int32_t *min, int32_t *max) {
    const struct rig_profile *profile = &rig->profile;
    struct lens_limits limits = {.min = values[value].min, .max = values[value].max};
    bool there = true;
    if (value == SAVED_PAN_URAD) {
        there = profile->servos;
        limits = (struct lens_limits){.min = profile->pan_min_urad, .max = profile->pan_max_urad};
    } else if (value >= SAVED_ZOOM) {
        const int axis = value - SAVED_ZOOM;
        there = rig_has_axis(profile, side, (enum lens_axis)axis) &&
                rig_lens_limits(rig, side, (enum lens_axis)axis, &limits) == 0;
    }
    *min = limits.min;
    *max = limits.max;
    return there;
}

static int check_side(const struct saved_settings *saved, struct rig *rig, unsigned side,
                      struct message *why) {
    if (saved->lenses.learned[side].focus.count + saved->lenses.learned[side].iris.count > 0 &&
        !rig_has_lens(&rig->profile, side)) {
        return message_set(why, ERROR_NOT_CONNECTED, "no motors for the tables of the %s lens",
                           rig_side_names[side]);
    }
    for (int i = 0; i < SAVED_VALUES; i++) {
        const int32_t value = saved->values[side][i];
        char text[QUANTITY_BYTES], range[QUANTITY_RANGE_BYTES];
        int32_t min = 0, max = 0;
        if (value == NOT_KEPT) {
            continue;
        }
        if (!range_of(rig, side, i, &min, &max)) {
            return message_set(why, ERROR_NOT_CONNECTED, "no motor for %s %s", rig_side_names[side],
                               values[i].name);
        }
        if (value < min || value > max) {
            quantity_print(values[i].quantity, value, text);
            quantity_print_range(values[i].quantity, min, max, range);
            return message_set(why, ERROR_RANGE, "%s %s %s out of range (%s)", rig_side_names[side],
                               values[i].name, text, range);
        }
    }
    return ERROR_OK;
}

static bool fits_sensors(const struct saved_settings *saved) {
    struct mt9t001_window window;
    bool fits =
        mt9t001_centred_window(saved->width_px, saved->height_px, saved->skip, 1, &window) == 0;
    for (unsigned side = 0; side < RIG_SIDES && saved->placed; side++) {
        fits = fits && saved->column_px[side] % 2 == 0 && saved->row_px[side] % 2 == 0 &&
               saved->column_px[side] + saved->width_px <= MT9T001_WIDTH_PX &&
               saved->row_px[side] + saved->height_px <= MT9T001_HEIGHT_PX;
    }
    return fits;
}

static int check_all(const struct saved_settings *saved, struct rig *rig, struct message *why) {
    if (strcmp(saved->profile, rig->profile.name) != 0) {
        return message_set(why, ERROR_ARGUMENT, "saved with the profile %s, this one is %s",
                           saved->profile, rig->profile.name);
    }
    const bool fits =
        rig->profile.bridge ? fits_sensors(saved) : saved->skip == 1 && !saved->placed;
    if (saved->width_px != 0 && !fits) {
        return message_set(why, ERROR_RANGE, "unsupported window %u x %u px, skip %u",
                           (unsigned)saved->width_px, (unsigned)saved->height_px,
                           (unsigned)saved->skip);
    }
    const int error = check_side(saved, rig, RIG_LEFT, why);
    return error != ERROR_OK ? error : check_side(saved, rig, RIG_RIGHT, why);
}

int saved_settings_check(const struct saved_settings *saved, struct rig *rig,
                         struct message *message) {
    struct message why;
    INVARIANT(rig->state == RIG_READY);
    const int error = check_all(saved, rig, &why);
    return error == ERROR_OK
               ? 0
               : message_set(message, error,
                             "saved settings do not fit this instrument: %.800s (set it up, "
                             "then use \"settings save\")",
                             why.text);
}

// ---- commands

/// The value in the unit of its command, with enough decimals to give the same integer.
static const char *in_command(int value, int32_t number, char text[QUANTITY_BYTES]) {
    const double degrees = number * 1e-6 * MATH_DEGREE_PER_RAD;
    if (value == SAVED_GAIN_Q3 || value == SAVED_PAN_URAD) {
        snprintf(text, QUANTITY_BYTES, "%.*f", value == SAVED_GAIN_Q3 ? 3 : 6,
                 value == SAVED_GAIN_Q3 ? number / 8.0 : degrees);
    } else {
        snprintf(text, QUANTITY_BYTES, "%" PRId32, number);
    }
    return text;
}

/// Appends the commands for a value of both sides.
static size_t add(const struct saved_settings *saved, int value,
                  char (*lines)[SAVED_SETTINGS_LINE_BYTES], size_t count) {
    const int32_t left = saved->values[RIG_LEFT][value], right = saved->values[RIG_RIGHT][value];
    const bool both = left != NOT_KEPT && right != NOT_KEPT;
    char text[RIG_SIDES][QUANTITY_BYTES];
    for (unsigned side = 0; side < RIG_SIDES; side++) {
        in_command(value, saved->values[side][value], text[side]);
    }
    INVARIANT(count + RIG_SIDES <= SAVED_SETTINGS_LINES);
    // Axes of both sides move at once.
    if (value == SAVED_PAN_URAD && both) {
        snprintf(lines[count++], sizeof lines[0], "pan %s right=%s", text[RIG_LEFT],
                 text[RIG_RIGHT]);
        return count;
    }
    if (value > SAVED_PAN_URAD && both && left == right) {
        snprintf(lines[count++], sizeof lines[0], "%s %s", values[value].name, text[RIG_LEFT]);
        return count;
    }
    for (unsigned side = 0; side < RIG_SIDES; side++) {
        if (saved->values[side][value] != NOT_KEPT) {
            snprintf(lines[count++], sizeof lines[0], "%s %s side=%s", values[value].name,
                     text[side], rig_side_names[side]);
        }
    }
    return count;
}

static bool are_windows_equal(const struct saved_settings *a, const struct saved_settings *b) {
    return a->width_px == b->width_px && a->height_px == b->height_px && a->skip == b->skip &&
           a->placed == b->placed &&
           (!a->placed || (memcmp(a->column_px, b->column_px, sizeof a->column_px) == 0 &&
                           memcmp(a->row_px, b->row_px, sizeof a->row_px) == 0));
}

/// Appends the command for both windows, then that for a right window elsewhere.
static size_t add_window(const struct saved_settings *saved,
                         char (*lines)[SAVED_SETTINGS_LINE_BYTES]) {
    size_t count = 0;
    for (unsigned side = 0; side < RIG_SIDES; side++) {
        char *line = lines[count];
        int length =
            snprintf(line, sizeof lines[0], "window %u %u skip=%u", (unsigned)saved->width_px,
                     (unsigned)saved->height_px, (unsigned)saved->skip);
        if (!saved->placed) {
            return 1;
        }
        length += snprintf(line + length, sizeof lines[0] - (size_t)length, " column=%u row=%u",
                           (unsigned)saved->column_px[side], (unsigned)saved->row_px[side]);
        if (side == RIG_RIGHT) {
            snprintf(line + length, sizeof lines[0] - (size_t)length, " side=right");
        }
        count++;
        if (saved->column_px[RIG_LEFT] == saved->column_px[RIG_RIGHT] &&
            saved->row_px[RIG_LEFT] == saved->row_px[RIG_RIGHT]) {
            break;
        }
    }
    return count;
}

size_t saved_settings_commands(const struct saved_settings *saved, const struct rig *rig,
                               char lines[SAVED_SETTINGS_LINES][SAVED_SETTINGS_LINE_BYTES],
                               size_t *of_cameras) {
    struct saved_settings now;
    size_t count = 0;
    saved_settings_take(rig, &now);
    // An unchanged window does not restart the cameras.
    if (saved->width_px != 0 && !are_windows_equal(saved, &now)) {
        count = add_window(saved, lines);
    }
    for (int i = 0; i < SAVED_PAN_URAD; i++) {
        count = add(saved, i, lines, count);
    }
    // What was learned since the start counts more than what was saved before.
    count = saved_lens_commands(&saved->lenses, rig, true, lines, count);
    *of_cameras = count;
    for (int i = SAVED_PAN_URAD; i < SAVED_VALUES; i++) {
        count = add(saved, i, lines, count);
    }
    return saved_lens_commands(&saved->lenses, rig, false, lines, count);
}
