// SPDX-License-Identifier: Apache-2.0
#include "daemon/backends/linux/v4l2_control.h"

#include <errno.h>
#include <linux/videodev2.h>
#include <stdbool.h>
#include <stddef.h>

#include "core/error.h"
#include "core/invariant.h"
#include "daemon/backends/linux/device_file.h"

enum { EXPOSURE_UNIT_US = 100, PARTS = 1000 };

/// Description of a control.
struct control {
    uint32_t id;            ///< control id of the value
    uint32_t automatic_id;  ///< control that must be `manual` for the value to apply
    int32_t manual;
    uint32_t also_id;  ///< also set to 0 if the camera has it; 0: none
};

static const struct control controls[] = {
    // With exposure priority a camera lengthens the frame interval to expose longer.
    [HAL_CAMERA_EXPOSURE_US] = {V4L2_CID_EXPOSURE_ABSOLUTE, V4L2_CID_EXPOSURE_AUTO,
                                V4L2_EXPOSURE_MANUAL, V4L2_CID_EXPOSURE_AUTO_PRIORITY},
    [HAL_CAMERA_GAIN_PART] = {V4L2_CID_GAIN, V4L2_CID_AUTOGAIN, 0, 0},
    [HAL_CAMERA_FOCUS_PART] = {V4L2_CID_FOCUS_ABSOLUTE, V4L2_CID_FOCUS_AUTO, 0, 0},
};

/// What a camera sets automatically, in the order of HAL_CAMERA_AUTO_*.
static const struct {
    uint32_t id;
    int32_t off, also_off;
} automatics[] = {
    {V4L2_CID_EXPOSURE_AUTO, V4L2_EXPOSURE_MANUAL, V4L2_EXPOSURE_SHUTTER_PRIORITY},
    {V4L2_CID_AUTOGAIN, 0, 0},
    {V4L2_CID_FOCUS_AUTO, 0, 0},
    {V4L2_CID_AUTO_WHITE_BALANCE, 0, 0},
};

static int error_of(int error_number) {
    switch (error_number) {
        case EINVAL:
        case ENOTTY:
            return ERROR_UNSUPPORTED;
        case ERANGE:
            return ERROR_RANGE;
        default:
            return device_file_error(error_number);
    }
}

static int write_control(int fd, uint32_t id, int32_t value) {
    struct v4l2_control control = {.id = id, .value = value};
    return device_file_control(fd, VIDIOC_S_CTRL, &control) < 0 ? error_of(errno) : ERROR_OK;
}

/// Writes a control that only some cameras have.
static int write_if_there(int fd, uint32_t id, int32_t value) {
    const int error = write_control(fd, id, value);
    return error == ERROR_UNSUPPORTED ? ERROR_OK : error;
}

/// Scales `value` of 0 .. `parts` to the range, rounded to the nearest step.
static int32_t scale_up(const struct v4l2_queryctrl *range, int64_t value, int64_t parts) {
    const int64_t span = (int64_t)range->maximum - range->minimum;
    const int64_t step = range->step > 0 ? range->step : 1;
    const int64_t steps = (span * value + parts * step / 2) / (parts * step);
    const int64_t max = span / step;
    return (int32_t)(range->minimum + (steps < max ? steps : max) * step);
}

static int32_t scale_down(const struct v4l2_queryctrl *range, int32_t value) {
    const int64_t span = (int64_t)range->maximum - range->minimum;
    const int64_t part = ((int64_t)value - range->minimum) * PARTS;
    const int64_t scaled = (part + span / 2) / span;
    if (scaled < 0) {
        return 0;
    }
    return (int32_t)(scaled > PARTS ? PARTS : scaled);
}

/// The camera's raw value for a value of the interface.
static int raw_value(enum hal_camera_control control, const struct v4l2_queryctrl *range,
                     int32_t value, int32_t *raw) {
    if (control != HAL_CAMERA_EXPOSURE_US) {
        *raw = scale_up(range, value, PARTS);
        return value >= 0 && value <= PARTS ? ERROR_OK : ERROR_RANGE;
    }
    // Rounded to the nearest unit, then to the nearest step.
    const int64_t units = ((int64_t)value + EXPOSURE_UNIT_US / 2) / EXPOSURE_UNIT_US;
    if (value <= 0 || units < range->minimum || units > range->maximum) {
        return ERROR_RANGE;
    }
    *raw = scale_up(range, units - range->minimum, (int64_t)range->maximum - range->minimum);
    return ERROR_OK;
}

/// Reports the nearest exposure to one that is too short or too long; relative values are never out
/// of range.
static void report_nearest(enum hal_camera_control control, const struct v4l2_queryctrl *range,
                           int32_t value, int32_t *nearest) {
    const int64_t min = range->minimum > 0 ? range->minimum : 1;
    const int64_t units = value < min * EXPOSURE_UNIT_US ? min : range->maximum;
    const int64_t nearest_us = units * EXPOSURE_UNIT_US;
    if (control == HAL_CAMERA_EXPOSURE_US && nearest_us > 0 && nearest_us <= INT32_MAX) {
        *nearest = (int32_t)nearest_us;
    }
}

/// An exposure in us; 0 (unknown) if it does not fit.
static int32_t exposure_us_of(int32_t units) {
    return units > 0 && units <= INT32_MAX / EXPOSURE_UNIT_US ? units * EXPOSURE_UNIT_US : 0;
}

static int read_control(int fd, uint32_t id, int32_t *value) {
    struct v4l2_control now = {.id = id};
    if (device_file_control(fd, VIDIOC_G_CTRL, &now) < 0) {
        return error_of(errno);
    }
    *value = now.value;
    return ERROR_OK;
}

/// Whether the camera sets this automatically. A camera without such a control does not.
static int read_automatic(int fd, size_t which, bool *on) {
    int32_t value = automatics[which].off;
    const int error = read_control(fd, automatics[which].id, &value);
    *on = value != automatics[which].off && value != automatics[which].also_off;
    return error == ERROR_UNSUPPORTED ? ERROR_OK : error;
}

static int switch_automatic_off(int fd, int32_t *found) {
    int32_t bits = 0;
    for (size_t i = 0; i < sizeof automatics / sizeof automatics[0]; i++) {
        bool on = false;
        int error = read_automatic(fd, i, &on);
        if (error == ERROR_OK && on) {
            bits |= 1 << i;
            // A driver that does not allow it keeps it on.
            (void)write_control(fd, automatics[i].id, automatics[i].off);
            error = read_automatic(fd, i, &on);
            bits |= on ? 1 << (i + HAL_CAMERA_AUTO_STILL) : 0;
        }
        if (error != ERROR_OK) {
            return error;
        }
    }
    *found = bits;
    return ERROR_OK;
}

/// Reads the current exposure, unless the camera chooses it automatically.
static int find_exposure(int fd, int32_t *exposure_us) {
    bool on = false;
    int32_t units = 0;
    int error = read_automatic(fd, 0, &on);
    if (error == ERROR_OK && !on) {
        error = read_control(fd, V4L2_CID_EXPOSURE_ABSOLUTE, &units);
    }
    if (error == ERROR_OK) {
        *exposure_us = exposure_us_of(units);
    }
    return error;
}

/// The range of a control that the camera has.
static int read_range(int fd, uint32_t id, struct v4l2_queryctrl *range) {
    *range = (struct v4l2_queryctrl){.id = id};
    if (device_file_control(fd, VIDIOC_QUERYCTRL, range) < 0) {
        return error_of(errno);
    }
    return (range->flags & V4L2_CTRL_FLAG_DISABLED) != 0 || range->maximum <= range->minimum
               ? ERROR_UNSUPPORTED
               : ERROR_OK;
}

static int find_part(int fd, enum hal_camera_control control, int32_t *part) {
    const struct control *entry = &controls[control];
    struct v4l2_queryctrl range;
    int32_t automatic = entry->manual, value = 0;
    int error = read_range(fd, entry->id, &range);
    if (error == ERROR_OK) {
        error = read_control(fd, entry->automatic_id, &automatic);
        error = error == ERROR_UNSUPPORTED ? ERROR_OK : error;
    }
    if (error == ERROR_OK) {
        error = automatic == entry->manual ? read_control(fd, entry->id, &value)
                                           : (int)ERROR_UNSUPPORTED;
    }
    if (error == ERROR_OK) {
        *part = scale_down(&range, value);
    }
    return error;
}

static int find_focus_steps(int fd, int32_t *steps) {
    struct v4l2_queryctrl range;
    const int error = read_range(fd, V4L2_CID_FOCUS_ABSOLUTE, &range);
    if (error == ERROR_OK) {
        const int64_t span = (int64_t)range.maximum - range.minimum;
        const int64_t count = span / (range.step > 0 ? range.step : 1);
        *steps = count < INT32_MAX ? (int32_t)count : INT32_MAX;
    }
    if (error == ERROR_UNSUPPORTED) {
        *steps = 0;
    }
    return error == ERROR_UNSUPPORTED ? ERROR_OK : error;
}

/// The controls that change no value: they report what they find.
static int find(int fd, enum hal_camera_control control, int32_t *applied) {
    switch (control) {
        case HAL_CAMERA_EXPOSURE_FOUND_US:
            return find_exposure(fd, applied);
        case HAL_CAMERA_GAIN_FOUND_PART:
            return find_part(fd, HAL_CAMERA_GAIN_PART, applied);
        case HAL_CAMERA_FOCUS_FOUND_PART:
            return find_part(fd, HAL_CAMERA_FOCUS_PART, applied);
        case HAL_CAMERA_FOCUS_STEPS:
            return find_focus_steps(fd, applied);
        default:
            INVARIANT(control == HAL_CAMERA_AUTOMATIC_OFF);
            return switch_automatic_off(fd, applied);
    }
}

int v4l2_control_set(int fd, enum hal_camera_control control, int32_t value, int32_t *applied) {
    INVARIANT(fd >= 0);
    if ((size_t)control >= sizeof controls / sizeof controls[0]) {
        return find(fd, control, applied);
    }
    const struct control *entry = &controls[control];
    struct v4l2_queryctrl range;
    struct v4l2_control now = {.id = entry->id};
    int error = read_range(fd, entry->id, &range);
    if (error != ERROR_OK) {
        return error;
    }
    error = raw_value(control, &range, value, &now.value);
    if (error != ERROR_OK) {
        report_nearest(control, &range, value, applied);
        return error;
    }
    error = write_if_there(fd, entry->automatic_id, entry->manual);
    if (error == ERROR_OK && entry->also_id != 0) {
        error = write_if_there(fd, entry->also_id, 0);
    }
    if (error == ERROR_OK) {
        error = write_control(fd, entry->id, now.value);
    }
    if (error != ERROR_OK) {
        return error;
    }
    // Read back what the camera actually set.
    if (device_file_control(fd, VIDIOC_G_CTRL, &now) < 0) {
        return error_of(errno);
    }
    *applied = control == HAL_CAMERA_EXPOSURE_US ? exposure_us_of(now.value)
                                                 : scale_down(&range, now.value);
    return ERROR_OK;
}
