// SPDX-License-Identifier: Apache-2.0
#include "stereo/zoom/zoom_grammar.h"

#include "core/error.h"
#include "core/invariant.h"

// Short forms for the list below; `old_name` is that of version 1, where it had another one.
#define FIELD(name, old_name, kind, count, decimals, min, max, unit, meaning, member) \
    {                                                                                 \
        name, old_name, kind, 1, count, decimals, min, max, unit, meaning,            \
            offsetof(struct zoom_calibration, member)                                 \
    }
#define RIG(kind, name, meaning, member) \
    FIELD(name, NULL, KEYED_##kind, 1, 0, 0, 0, "", meaning, member)
#define END(kind, name, decimals, max, unit, meaning, member) \
    FIELD(name, NULL, KEYED_##kind, 1, decimals, 0, max, unit, meaning, member)
#define CAMERA_FIELD(side, at, kind, name, count, decimals, min, max, unit, meaning, member) \
    FIELD(side "_" name, NULL, KEYED_##kind, count, decimals, min, max, unit, meaning,       \
          camera[at].member)
#define RANGE(side, at, name, decimals, limit, unit, meaning, member) \
    CAMERA_FIELD(side, at, DECIMALS, name, 2, decimals, -limit, limit, unit, meaning, member.min)
#define SERIES ": irregularity, then Chebyshev's terms"
#define FUNCTION(side, at, name, decimals, limit, unit, meaning, which)               \
    FIELD(side "_" name, NULL, ZOOM_FIELD_FUNCTION, 1, decimals, -limit, limit, unit, \
          meaning SERIES, camera[at].function[ZOOM_##which])
#define CAMERA(side, at)                                                                           \
    CAMERA_FIELD(side, at, NAME, "camera", 1, 0, 0, 0, "",                                         \
                 "serial number or port of the camera, or unknown", name),                         \
        CAMERA_FIELD(side, at, INTEGERS, "sensor_px", 2, 0, 1, LENS_SIDE_MAX_PX, "px",             \
                     "width and height of the whole sensor", width_px),                            \
        CAMERA_FIELD(side, at, DECIMALS, "radius_px", 1, 6, 1, LENS_SIDE_MAX_PX, "px",             \
                     "R: the radius for which distortion is stated", radius_px),                   \
        CAMERA_FIELD(side, at, DECIMALS, "pixel_mm", 1, 9, 0, 1, "mm", "side of a pixel",          \
                     pixel_mm),                                                                    \
        RANGE(side, at, "zoom_counts", 3, 100000, "counts", "calibrated range of zoom positions",  \
              zoom),                                                                               \
        RANGE(side, at, "focus_counts", 3, 100000, "counts",                                       \
              "calibrated range of focus positions", focus),                                       \
        RANGE(side, at, "log_focal_range", 12, 20, "",                                             \
              "range of log f over the zoom positions: what the other functions refer to",         \
              log_focal),                                                                          \
        RANGE(side, at, "pan_rad", 9, 10, "rad", "calibrated range of pan, as commanded",          \
              pan_rad),                                                                            \
        FUNCTION(side, at, "focal", 9, 1000000, "px",                                              \
                 "focal length at infinity, of the zoom position", FOCAL),                         \
        FIELD(side "_focus_dioptre", side "_vergence", ZOOM_FIELD_FUNCTION, 1, 12, -1000, 1000,    \
              "1/m", "reciprocal of the distance in focus" SERIES,                                 \
              camera[at].function[ZOOM_FOCUS_DIOPTRE]),                                            \
        FIELD(side "_focus_dioptre_by_count", side "_focus_vergence", KEYED_DECIMALS,              \
              ZOOM_FOCUS_TERMS, 12, -1000, 1000, "1/m",                                            \
              "what the focus position adds to it: first and second term",                         \
              camera[at].focus_dioptre_by_count),                                                  \
        FUNCTION(side, at, "centre_x", 9, 1000000, "px", "column of the principal point",          \
                 CENTRE_X),                                                                        \
        FUNCTION(side, at, "centre_y", 9, 1000000, "px", "row of the principal point", CENTRE_Y),  \
        FUNCTION(side, at, "radial_2", 9, 100000, "px", "distortion at R: k1 R^3 / F^2",           \
                 RADIAL_2),                                                                        \
        FUNCTION(side, at, "radial_4", 9, 100000, "px", "distortion at R: k2 R^5 / F^4",           \
                 RADIAL_4),                                                                        \
        FUNCTION(side, at, "radial_6", 9, 100000, "px", "distortion at R: k3 R^7 / F^6",           \
                 RADIAL_6),                                                                        \
        FUNCTION(side, at, "tangential_1", 9, 100000, "px", "distortion at R: p1 R^2 / F",         \
                 TANGENTIAL_1),                                                                    \
        FUNCTION(side, at, "tangential_2", 9, 100000, "px", "distortion at R: p2 R^2 / F",         \
                 TANGENTIAL_2),                                                                    \
        FUNCTION(side, at, "pupil", 9, 100000, "mm", "shift of the entrance pupil along the axis", \
                 PUPIL),                                                                           \
        CAMERA_FIELD(side, at, DECIMALS, "axis_direction", 2, 12, -1, 1, "",                       \
                     "x and z of the pan axis (x, 1, z)", mount[ZOOM_AXIS_DIRECTION_X]),           \
        CAMERA_FIELD(side, at, DECIMALS, "axis_point_mm", 2, 9, -100000, 100000, "mm",             \
                     "x and z where the pan axis meets y = 0", mount[ZOOM_AXIS_POINT_X]),          \
        CAMERA_FIELD(side, at, DECIMALS, "pan_scale", 1, 12, -1, 1, "",                            \
                     "the turned angle is (1 + this) times the commanded one",                     \
                     mount[ZOOM_PAN_SCALE]),                                                       \
        CAMERA_FIELD(side, at, DECIMALS, "rotation_rad", 3, 12, -4, 4, "rad",                      \
                     "rotation vector from the camera's frame at pan 0 to the instrument's",       \
                     mount[ZOOM_ROTATION_X]),                                                      \
        CAMERA_FIELD(side, at, DECIMALS, "position_mm", 3, 9, -100000, 100000, "mm",               \
                     "entrance pupil at pan 0 and the smallest focal length",                      \
                     mount[ZOOM_POSITION_X]),                                                      \
        CAMERA_FIELD(side, at, DECIMALS, "reading_sigma_counts", 1, 6, 0, 1000, "counts",          \
                     "standard deviation of a position that was read", reading_sigma_counts),      \
        CAMERA_FIELD(side, at, DECIMALS, "drift_sigma_counts", 1, 6, 0, 1000, "counts",            \
                     "standard deviation of the drift between calibration and use",                \
                     drift_sigma_counts),                                                          \
        CAMERA_FIELD(side, at, DECIMALS, "pan_sigma_rad", 1, 9, 0, 1, "rad",                       \
                     "standard deviation of the angle at which the servo rests", pan_sigma_rad),   \
        CAMERA_FIELD(side, at, DECIMALS, "creep_sigma_rad", 1, 9, 0, 1, "rad",                     \
                     "standard deviation of the angle by which it moves from there",               \
                     creep_sigma_rad)

static const struct keyed_field fields[] = {
    RIG(ID, "id", "name of rig and occasion: letters, digits, . _ -", id),
    RIG(DATE, "date", "day of the calibration, YYYY-MM-DD, or unknown", date),
    RIG(NOTE, "note", "assumptions made, as text; may be empty", note),
    RIG(NAME, "instrument", "profile of the instrument, or unknown", instrument),
    CAMERA("left", 0),
    CAMERA("right", 1),
    END(DECIMALS, "scale_sigma", 9, 1, "", "standard deviation of all lengths, relative",
        scale_sigma),
    END(INTEGERS, "settings", 0, 100000, "", "settings of zoom and focus seen",
        validation.settings),
    END(INTEGERS, "boards", 0, 1000000, "", "boards seen", validation.boards),
    END(INTEGERS, "corners", 0, 100000000, "", "corners used", validation.corners),
    END(INTEGERS, "rejected_corners", 0, 100000000, "", "corners rejected as outliers",
        validation.rejected_corners),
    END(DECIMALS, "rms_px", 6, 1000, "px", "rms of the reprojection; 0: not stated",
        validation.rms_px),
    END(DECIMALS, "held_out_px", 6, 100000, "px",
        "epipolar error at settings that were left out; 0: not checked", validation.held_out_px),
    END(DECIMALS, "held_out_focal", 9, 1000, "", "relative error of f there",
        validation.held_out_focal),
    FIELD("chi_square_z", NULL, KEYED_DECIMALS, 1, 3, -1000000, 1000000, "",
          "standard score of the fit: beyond 4 the model does not fit", validation.chi_square_z),
};

static int parse(struct keyed_reader *reader, const struct keyed_field *field, const char *name,
                 struct keyed_span values, void *address) {
    struct zoom_function *function = address;
    bool more = true;
    int code = keyed_parse_number(reader, name, &values, &more, field->decimals, 0, field->max,
                                  &function->irregularity);
    for (function->terms = 0; code == ERROR_OK && more; function->terms++) {
        if (function->terms == ZOOM_TERMS_MAX) {
            return keyed_refuse(reader, ERROR_SYNTAX, name, "too many terms");
        }
        code = keyed_parse_number(reader, name, &values, &more, field->decimals, field->min,
                                  field->max, &function->term[function->terms]);
    }
    return code;
}

static void print(struct keyed_writer *writer, const struct keyed_field *field,
                  const void *address) {
    const struct zoom_function *function = address;
    INVARIANT(field->kind == ZOOM_FIELD_FUNCTION);
    INVARIANT(function->terms >= 0 && function->terms <= ZOOM_TERMS_MAX);
    keyed_put_number(writer, field->decimals, function->irregularity);
    for (int i = 0; i < function->terms; i++) {
        keyed_put_number(writer, field->decimals, function->term[i]);
    }
}

// False for a NaN, too.
static bool fits(double value, int64_t min, int64_t max) {
    return value >= (double)min && value <= (double)max;
}

static bool is_legal(const struct keyed_field *field, const void *address) {
    const struct zoom_function *function = address;
    bool legal = function->terms >= 0 && function->terms <= ZOOM_TERMS_MAX &&
                 fits(function->irregularity, 0, field->max);
    for (int i = 0; legal && i < function->terms; i++) {
        legal = fits(function->term[i], field->min, field->max);
    }
    return legal;
}

const struct keyed_table zoom_grammar = {
    .magic = ZOOM_GRAMMAR_MAGIC,
    .versions = ZOOM_GRAMMAR_VERSION,
    .magic_wanted = "the first line must be " ZOOM_GRAMMAR_MAGIC "2",
    .version_wanted = "unknown version (expected 1 or 2)",
    .fields = fields,
    .count = sizeof fields / sizeof fields[0],
    .parse = parse,
    .print = print,
    .is_legal = is_legal,
};
