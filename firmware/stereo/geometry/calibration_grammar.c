// SPDX-License-Identifier: Apache-2.0
#include "stereo/geometry/calibration_grammar.h"

#include "core/error.h"
#include "core/invariant.h"
#include "stereo/geometry/calibration_types.h"

// A field with its first version, and short forms for the list below.
#define FIELD(name, kind, version, count, decimals, min, max, unit, meaning, member) \
    {                                                                                \
        name, NULL, kind, version, count, decimals, min, max, unit, meaning,         \
            offsetof(struct calibration, member)                                     \
    }
#define TEXT(kind, name, member, meaning) \
    FIELD(name, KEYED_##kind, 1, 1, 0, 0, 0, "", meaning, member)
#define DECIMALS(name, count, decimals, min, max, unit, meaning, member) \
    FIELD(name, KEYED_DECIMALS, 1, count, decimals, min, max, unit, meaning, member)

// The ranges of the distortion coefficients grow with the order, because the terms they multiply
// shrink: a lens of 27,000 px focal length sees r < 0.05, so that r^6 < 2e-8. Decimals shrink as
// much, which keeps |value| * 10^decimals within DECIMAL_MAX and the effect of the last digit under
// 1e-4 px.
#define CAMERA(side)                                                                           \
    FIELD(#side "_size_px", KEYED_INTEGERS, 1, 2, 0, 1, LENS_SIDE_MAX_PX, "px",                \
          "width and height of the " #side " image", side.width_px),                           \
        DECIMALS(#side "_focal_px", 2, 9, 1, 1000000, "px", "focal lengths fx and fy",         \
                 side.fx_px),                                                                  \
        DECIMALS(#side "_centre_px", 2, 9, -1000000, 1000000, "px",                            \
                 "principal point cx and cy; 0 0 is the centre of the top-left pixel",         \
                 side.cx_px),                                                                  \
        DECIMALS(#side "_k1", 1, 12, -1000, 1000, "", "radial distortion, r^2", side.k1),      \
        DECIMALS(#side "_k2", 1, 10, -100000, 100000, "", "radial distortion, r^4", side.k2),  \
        DECIMALS(#side "_tangential", 2, 12, -100, 100, "", "tangential distortion p1 and p2", \
                 side.p1),                                                                     \
        DECIMALS(#side "_k3", 1, 8, -10000000, 10000000, "", "radial distortion, r^6", side.k3)

// The kind of a lens and the coefficients that only some kinds have.
#define KIND_COEFFICIENT(side, k, decimals, max, meaning)              \
    FIELD(#side "_" #k, KEYED_DECIMALS, 4, 1, decimals, -max, max, "", \
          "distortion of a lens that is not brown-conrady, " meaning, side.k)
#define KIND(side)                                                                 \
    FIELD(#side "_lens", CALIBRATION_FIELD_LENS, 4, 1, 0, 0, 0, "",                \
          "model of the lens: brown-conrady, rational or equidistant", side.kind), \
        KIND_COEFFICIENT(side, k4, 12, 1000, "r^2 below the line or angle^8"),     \
        KIND_COEFFICIENT(side, k5, 10, 100000, "r^4 below the line"),              \
        KIND_COEFFICIENT(side, k6, 8, 10000000, "r^6 below the line")

#define AXIS(prefix, at, name, unit, which, meaning)                                         \
    FIELD(prefix "_" name "_" unit, CALIBRATION_FIELD_AXIS, 2, 2, CALIBRATION_AXIS_DECIMALS, \
          -100000, 100000, unit,                                                             \
          meaning ", mean and greatest deviation; none: no such axis; or unknown",           \
          origin.side[at].axis[CALIBRATION_##which])
#define SIDE(prefix, at)                                                                         \
    FIELD(prefix "_camera", KEYED_NAME, 2, 1, 0, 0, 0, "",                                       \
          "serial number or port of the camera, or unknown", origin.side[at].camera),            \
        FIELD(prefix "_window_px", CALIBRATION_FIELD_WINDOW, 2, 3, 0, 0, LENS_SIDE_MAX_PX, "px", \
              "column and row of the sensor where the image begins, and the step from pixel to " \
              "pixel; or unknown",                                                               \
              origin.side[at].window),                                                           \
        AXIS(prefix, at, "pan", "deg", PAN, "pan from the servo's middle"),                      \
        AXIS(prefix, at, "zoom", "counts", ZOOM, "zoom as the controller reads it"),             \
        AXIS(prefix, at, "focus", "counts", FOCUS, "focus as the controller reads it"),          \
        AXIS(prefix, at, "iris", "counts", IRIS, "iris as the controller reads it")
#define SIGMA(name, unit, meaning, member) \
    FIELD(name, KEYED_DECIMALS, 2, 1, 9, 0, 1, unit, meaning, member)

static const struct keyed_field fields[] = {
    TEXT(ID, "id", id, "name of rig and occasion: letters, digits, . _ -"),
    TEXT(DATE, "date", date, "day of the calibration, YYYY-MM-DD, or unknown"),
    TEXT(NOTE, "note", note, "assumptions made, as text; may be empty"),
    TEXT(FLAG, "rectified", rectified, "yes: rows of both images already correspond; otherwise no"),
    CAMERA(left),
    CAMERA(right),
    DECIMALS("rotation_right_left_rad", 3, 12, -4, 4, "rad",
             "rotation vector that turns points of the left frame into the right one",
             rotation_right_left_rad),
    DECIMALS("translation_right_left_mm", 3, 9, -100000, 100000, "mm",
             "position of the left camera in the right frame: x is normally negative",
             translation_right_left_mm),
    DECIMALS("depth_range_mm", 2, 3, 0, 1000000000, "mm",
             "nearest and farthest working depth of the left camera; 0 0: not stated",
             depth_near_mm),
    DECIMALS("rms_px", 1, 6, 0, 1000, "px", "rms of the reprojection; 0: not stated", rms_px),
    FIELD("instrument", KEYED_NAME, 2, 1, 0, 0, 0, "", "profile of the instrument, or unknown",
          origin.instrument),
    SIDE("left", 0),
    SIDE("right", 1),
    SIGMA("scale_sigma", "", "standard deviation common to all depths, relative; 0: not stated",
          scale_sigma),
    SIGMA("yaw_sigma_rad", "rad",
          "standard deviation of the angle between the cameras; 0: not stated", yaw_sigma_rad),
    FIELD("axes_in_sigma", KEYED_FLAG, 3, 1, 0, 0, 0, "",
          "yes: the two above include how well the axes stand where this text says; otherwise no",
          axes_in_sigma),
    KIND(left),
    KIND(right),
};

// ---- what only this text has

static int parse_lens(struct keyed_reader *reader, const char *name, struct keyed_span value,
                      enum lens_kind *kind) {
    for (int i = 0; i < LENS_KINDS; i++) {
        if (keyed_span_is(value, lens_kind_name((enum lens_kind)i))) {
            *kind = (enum lens_kind)i;
            return ERROR_OK;
        }
    }
    return keyed_refuse(reader, ERROR_SYNTAX, name,
                        "must be brown-conrady, rational or equidistant");
}

static int parse_window(struct keyed_reader *reader, const struct keyed_field *field,
                        const char *name, struct keyed_span values,
                        struct calibration_window *window) {
    double numbers[3];
    *window = (struct calibration_window){0, 0, 0};
    if (keyed_span_is(values, KEYED_LINE_UNKNOWN)) {
        return ERROR_OK;
    }
    INVARIANT(field->count == 3);
    const int code = keyed_text_parse_numbers(reader, field, name, values, true, numbers);
    if (code != ERROR_OK) {
        return code;
    }
    *window = (struct calibration_window){(int)numbers[0], (int)numbers[1], (int)numbers[2]};
    return window->skip == 0 ? keyed_refuse(reader, ERROR_RANGE, name, "the step must not be 0")
                             : ERROR_OK;
}

static int parse_axis(struct keyed_reader *reader, const struct keyed_field *field,
                      const char *name, struct keyed_span values, struct calibration_axis *axis) {
    double numbers[2];
    *axis = (struct calibration_axis){.kind = CALIBRATION_AXIS_UNKNOWN};
    if (keyed_span_is(values, KEYED_LINE_UNKNOWN)) {
        return ERROR_OK;
    }
    if (keyed_span_is(values, CALIBRATION_GRAMMAR_NO_AXIS)) {
        axis->kind = CALIBRATION_AXIS_NONE;
        return ERROR_OK;
    }
    INVARIANT(field->count == 2);
    const int code = keyed_text_parse_numbers(reader, field, name, values, true, numbers);
    if (code == ERROR_OK) {
        *axis = (struct calibration_axis){CALIBRATION_AXIS_KNOWN, numbers[0], numbers[1]};
    }
    return code;
}

static int parse(struct keyed_reader *reader, const struct keyed_field *field, const char *name,
                 struct keyed_span values, void *address) {
    switch (field->kind) {
        case CALIBRATION_FIELD_LENS:
            return parse_lens(reader, name, values, address);
        case CALIBRATION_FIELD_WINDOW:
            return parse_window(reader, field, name, values, address);
        default:
            INVARIANT(field->kind == CALIBRATION_FIELD_AXIS);
            return parse_axis(reader, field, name, values, address);
    }
}

static void print_window(struct keyed_writer *writer, const struct calibration_window *window) {
    if (window->skip == 0) {
        keyed_put_value(writer, KEYED_LINE_UNKNOWN);
        return;
    }
    INVARIANT(window->skip > 0 && window->column_px >= 0 && window->row_px >= 0);
    keyed_put_number(writer, 0, window->column_px);
    keyed_put_number(writer, 0, window->row_px);
    keyed_put_number(writer, 0, window->skip);
}

static void print_axis(struct keyed_writer *writer, const struct keyed_field *field,
                       const struct calibration_axis *axis) {
    if (axis->kind == CALIBRATION_AXIS_KNOWN) {
        keyed_put_number(writer, field->decimals, axis->mean);
        keyed_put_number(writer, field->decimals, axis->spread);
    } else {
        keyed_put_value(writer, axis->kind == CALIBRATION_AXIS_NONE ? CALIBRATION_GRAMMAR_NO_AXIS
                                                                    : KEYED_LINE_UNKNOWN);
    }
}

static void print(struct keyed_writer *writer, const struct keyed_field *field,
                  const void *address) {
    switch (field->kind) {
        case CALIBRATION_FIELD_LENS:
            keyed_put_value(writer, lens_kind_name(*(const enum lens_kind *)address));
            break;
        case CALIBRATION_FIELD_WINDOW:
            print_window(writer, address);
            break;
        default:
            print_axis(writer, field, address);
            break;
    }
}

static bool is_legal(const struct keyed_field *field, const void *address) {
    if (field->kind == CALIBRATION_FIELD_WINDOW) {
        const struct calibration_window *window = address;
        return window->column_px >= 0 && window->row_px >= 0 && window->skip >= 0 &&
               window->column_px <= field->max && window->row_px <= field->max &&
               window->skip <= field->max;
    }
    if (field->kind == CALIBRATION_FIELD_AXIS) {
        const struct calibration_axis *axis = address;
        const double min = (double)field->min, max = (double)field->max;
        return axis->mean >= min && axis->mean <= max && axis->spread >= 0 && axis->spread <= max;
    }
    return true;  // lens_validate checks the kind of a lens
}

const struct keyed_table calibration_grammar = {
    .magic = CALIBRATION_GRAMMAR_MAGIC,
    .versions = CALIBRATION_GRAMMAR_VERSIONS,
    .magic_wanted = "the first line must be " CALIBRATION_GRAMMAR_MAGIC "1",
    .version_wanted = "unknown version (expected 1 to 4)",
    .fields = fields,
    .count = sizeof fields / sizeof fields[0],
    .parse = parse,
    .print = print,
    .is_legal = is_legal,
};
