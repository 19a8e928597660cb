// SPDX-License-Identifier: Apache-2.0
#include "stereo/geometry/calibration_grammar.h"

#include <string.h>

#include "core/invariant.h"

// Short forms for the list below.
#define AT(member) offsetof(struct calibration, member)
#define TEXT(kind, name, member, meaning)                             \
    {                                                                 \
        name, CALIBRATION_FIELD_##kind, 1, 1, 0, 0, 0, "", meaning, { \
            AT(member), 0, 0                                          \
        }                                                             \
    }
#define DECIMALS_1(name, decimals, min, max, unit, meaning, a)                       \
    {                                                                                \
        name, CALIBRATION_FIELD_DECIMALS, 1, 1, decimals, min, max, unit, meaning, { \
            AT(a), 0, 0                                                              \
        }                                                                            \
    }
#define DECIMALS_2(name, decimals, min, max, unit, meaning, a, b)                    \
    {                                                                                \
        name, CALIBRATION_FIELD_DECIMALS, 1, 2, decimals, min, max, unit, meaning, { \
            AT(a), AT(b), 0                                                          \
        }                                                                            \
    }
#define DECIMALS_3(name, decimals, min, max, unit, meaning, a, b, c)                 \
    {                                                                                \
        name, CALIBRATION_FIELD_DECIMALS, 1, 3, decimals, min, max, unit, meaning, { \
            AT(a), AT(b), AT(c)                                                      \
        }                                                                            \
    }

// The ranges of the distortion coefficients grow with the order, because the terms they multiply
// shrink: a lens of 27,000 px focal length sees r < 0.05, so that r^6 < 2e-8. Decimals shrink as
// much, which keeps |value| * 10^decimals within DECIMAL_MAX and the effect of the last digit under
// 1e-4 px.
#define CAMERA(side)                                                                              \
    {#side "_size_px",                                                                            \
     CALIBRATION_FIELD_INTEGERS,                                                                  \
     1,                                                                                           \
     2,                                                                                           \
     0,                                                                                           \
     1,                                                                                           \
     LENS_SIDE_MAX_PX,                                                                            \
     "px",                                                                                        \
     "width and height of the " #side " image",                                                   \
     {AT(side.width_px), AT(side.height_px), 0}},                                                 \
        DECIMALS_2(#side "_focal_px", 9, 1, 1000000, "px", "focal lengths fx and fy", side.fx_px, \
                   side.fy_px),                                                                   \
        DECIMALS_2(#side "_centre_px", 9, -1000000, 1000000, "px",                                \
                   "principal point cx and cy; 0 0 is the centre of the top-left pixel",          \
                   side.cx_px, side.cy_px),                                                       \
        DECIMALS_1(#side "_k1", 12, -1000, 1000, "", "radial distortion, r^2", side.k1),          \
        DECIMALS_1(#side "_k2", 10, -100000, 100000, "", "radial distortion, r^4", side.k2),      \
        DECIMALS_2(#side "_tangential", 12, -100, 100, "", "tangential distortion p1 and p2",     \
                   side.p1, side.p2),                                                             \
        DECIMALS_1(#side "_k3", 8, -10000000, 10000000, "", "radial distortion, r^6", side.k3)

// The kind of a lens and the coefficients that only some kinds have.
#define KIND_COEFFICIENT(side, k, decimals, max, meaning)                        \
    {                                                                            \
#side "_" #k, CALIBRATION_FIELD_DECIMALS, 4, 1, decimals, -max, max, "", \
            "distortion of a lens that is not brown-conrady, " meaning, {        \
            AT(side.k), 0, 0                                                     \
        }                                                                        \
    }
#define KIND(side)                                                             \
    {#side "_lens",                                                            \
     CALIBRATION_FIELD_LENS,                                                   \
     4,                                                                        \
     1,                                                                        \
     0,                                                                        \
     0,                                                                        \
     0,                                                                        \
     "",                                                                       \
     "model of the lens: brown-conrady, rational or equidistant",              \
     {AT(side.kind), 0, 0}},                                                   \
        KIND_COEFFICIENT(side, k4, 12, 1000, "r^2 below the line or angle^8"), \
        KIND_COEFFICIENT(side, k5, 10, 100000, "r^4 below the line"),          \
        KIND_COEFFICIENT(side, k6, 8, 10000000, "r^6 below the line")

#define ORIGIN(kind, name, count, decimals, min, max, unit, meaning, member)           \
    {                                                                                  \
        name, CALIBRATION_FIELD_##kind, 2, count, decimals, min, max, unit, meaning, { \
            AT(origin.member), 0, 0                                                    \
        }                                                                              \
    }
#define AXIS(prefix, at, name, unit, which, meaning)                                \
    ORIGIN(AXIS, prefix "_" name "_" unit, 2, 3, -100000, 100000, unit,             \
           meaning ", mean and greatest deviation; none: no such axis; or unknown", \
           side[at].axis[CALIBRATION_##which])
#define SIDE(prefix, at)                                                                          \
    ORIGIN(NAME, prefix "_camera", 1, 0, 0, 0, "",                                                \
           "serial number or port of the camera, or unknown", side[at].camera),                   \
        ORIGIN(WINDOW, prefix "_window_px", 3, 0, 0, LENS_SIDE_MAX_PX, "px",                      \
               "column and row of the sensor where the image begins, and the step from pixel to " \
               "pixel; or unknown",                                                               \
               side[at].window),                                                                  \
        AXIS(prefix, at, "pan", "deg", PAN, "pan from the servo's middle"),                       \
        AXIS(prefix, at, "zoom", "counts", ZOOM, "zoom as the controller reads it"),              \
        AXIS(prefix, at, "focus", "counts", FOCUS, "focus as the controller reads it"),           \
        AXIS(prefix, at, "iris", "counts", IRIS, "iris as the controller reads it")
#define SIGMA(name, max, unit, meaning, member)                             \
    {                                                                       \
        name, CALIBRATION_FIELD_DECIMALS, 2, 1, 9, 0, max, unit, meaning, { \
            AT(member), 0, 0                                                \
        }                                                                   \
    }

static const struct calibration_field fields[] = {
    TEXT(ID, "id", id, "name of rig and occasion: letters, digits, . _ -"),
    TEXT(DATE, "date", date, "day of the calibration, YYYY-MM-DD, or unknown"),
    TEXT(NOTE, "note", note, "assumptions made, as text; may be empty"),
    TEXT(FLAG, "rectified", rectified, "yes: rows of both images already correspond; otherwise no"),
    CAMERA(left),
    CAMERA(right),
    DECIMALS_3("rotation_right_left_rad", 12, -4, 4, "rad",
               "rotation vector that turns points of the left frame into the right one",
               rotation_right_left_rad[0], rotation_right_left_rad[1], rotation_right_left_rad[2]),
    DECIMALS_3("translation_right_left_mm", 9, -100000, 100000, "mm",
               "position of the left camera in the right frame: x is normally negative",
               translation_right_left_mm[0], translation_right_left_mm[1],
               translation_right_left_mm[2]),
    DECIMALS_2("depth_range_mm", 3, 0, 1000000000, "mm",
               "nearest and farthest working depth of the left camera; 0 0: not stated",
               depth_near_mm, depth_far_mm),
    DECIMALS_1("rms_px", 6, 0, 1000, "px", "rms of the reprojection; 0: not stated", rms_px),
    ORIGIN(NAME, "instrument", 1, 0, 0, 0, "", "profile of the instrument, or unknown", instrument),
    SIDE("left", 0),
    SIDE("right", 1),
    SIGMA("scale_sigma", 1, "", "standard deviation common to all depths, relative; 0: not stated",
          scale_sigma),
    SIGMA("yaw_sigma_rad", 1, "rad",
          "standard deviation of the angle between the cameras; 0: not stated", yaw_sigma_rad),
    {"axes_in_sigma",
     CALIBRATION_FIELD_FLAG,
     3,
     1,
     0,
     0,
     0,
     "",
     "yes: the two above include how well the axes stand where this text says; otherwise no",
     {AT(axes_in_sigma), 0, 0}},
    KIND(left),
    KIND(right),
};

enum { FIELD_COUNT = sizeof fields / sizeof fields[0] };

const struct calibration_field *calibration_grammar_fields(int *count) {
    *count = FIELD_COUNT;
    return fields;
}

int calibration_grammar_count(int version) {
    int count = 0;
    while (count < FIELD_COUNT && fields[count].version <= version) {
        count++;
    }
    INVARIANT(count > 0 && (version < CALIBRATION_GRAMMAR_VERSIONS || count == FIELD_COUNT));
    return count;
}

int calibration_grammar_version(const struct calibration *calibration) {
    INVARIANT(calibration->left.kind < LENS_KINDS && calibration->right.kind < LENS_KINDS);
    if (calibration->left.kind != LENS_BROWN_CONRADY ||
        calibration->right.kind != LENS_BROWN_CONRADY) {
        return 4;
    }
    return !calibration->has_origin ? 1 : calibration->axes_in_sigma ? 3 : 2;
}

static size_t value_offset(const struct calibration_field *field, int i) {
    INVARIANT(i >= 0 && i < field->count && field->count <= CALIBRATION_FIELD_MAX_COUNT);
    INVARIANT(field->offset[i] + sizeof(int) <= sizeof(struct calibration));
    return field->offset[i];
}

double calibration_grammar_value(const struct calibration_field *field, int i,
                                 const struct calibration *calibration) {
    const char *source = (const char *)calibration + value_offset(field, i);
    if (field->kind == CALIBRATION_FIELD_INTEGERS) {
        int whole;
        memcpy(&whole, source, sizeof whole);
        return whole;
    }
    INVARIANT(field->kind == CALIBRATION_FIELD_DECIMALS);
    double value;
    memcpy(&value, source, sizeof value);
    return value;
}

void calibration_grammar_set(const struct calibration_field *field, int i, double value,
                             struct calibration *calibration) {
    char *target = (char *)calibration + value_offset(field, i);
    if (field->kind == CALIBRATION_FIELD_INTEGERS) {
        const int whole = (int)value;
        INVARIANT(whole == value);
        memcpy(target, &whole, sizeof whole);
        return;
    }
    INVARIANT(field->kind == CALIBRATION_FIELD_DECIMALS);
    memcpy(target, &value, sizeof value);
}

bool *calibration_grammar_flag(const struct calibration_field *field,
                               struct calibration *calibration) {
    INVARIANT(field->kind == CALIBRATION_FIELD_FLAG);
    return (bool *)(void *)((char *)calibration + field->offset[0]);
}

enum lens_kind *calibration_grammar_lens(const struct calibration_field *field,
                                         struct calibration *calibration) {
    INVARIANT(field->kind == CALIBRATION_FIELD_LENS);
    return (enum lens_kind *)(void *)((char *)calibration + field->offset[0]);
}

char *calibration_grammar_name(const struct calibration_field *field,
                               struct calibration *calibration) {
    INVARIANT(field->kind == CALIBRATION_FIELD_NAME && field->version == 2);
    return (char *)calibration + field->offset[0];
}

struct calibration_window *calibration_grammar_window(const struct calibration_field *field,
                                                      struct calibration *calibration) {
    INVARIANT(field->kind == CALIBRATION_FIELD_WINDOW);
    return (struct calibration_window *)(void *)((char *)calibration + field->offset[0]);
}

struct calibration_axis *calibration_grammar_axis(const struct calibration_field *field,
                                                  struct calibration *calibration) {
    INVARIANT(field->kind == CALIBRATION_FIELD_AXIS);
    return (struct calibration_axis *)(void *)((char *)calibration + field->offset[0]);
}
