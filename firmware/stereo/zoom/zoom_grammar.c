// SPDX-License-Identifier: Apache-2.0
#include "stereo/zoom/zoom_grammar.h"

#include <string.h>

#include "core/invariant.h"

// Short forms for the list below.
#define RIG(kind, name, meaning, member)                                          \
    {                                                                             \
        {name, name}, ZOOM_FIELD_RIG, ZOOM_FIELD_##kind, 1, 0, 0, 0, "", meaning, \
            offsetof(struct zoom_calibration, member)                             \
    }
#define END(kind, name, decimals, max, unit, meaning, member)                                \
    {                                                                                        \
        {name, name}, ZOOM_FIELD_END, ZOOM_FIELD_##kind, 1, decimals, 0, max, unit, meaning, \
            offsetof(struct zoom_calibration, member)                                        \
    }
#define CAMERA(kind, name, count, decimals, min, max, unit, meaning, member)                       \
    {                                                                                              \
        {"left_" name, "right_" name}, ZOOM_FIELD_CAMERA, ZOOM_FIELD_##kind, count, decimals, min, \
            max, unit, meaning, offsetof(struct zoom_camera, member)                               \
    }
#define RANGE(name, decimals, limit, unit, meaning, member) \
    CAMERA(DECIMALS, name, 2, decimals, -limit, limit, unit, meaning, member.min)
#define FUNCTION(name, decimals, limit, unit, meaning, which) \
    CAMERA(FUNCTION, name, 1, decimals, -limit, limit, unit,  \
           meaning ": irregularity, then Chebyshev's terms", function[ZOOM_##which])

static const struct zoom_field fields[] = {
    RIG(ID, "id", "name of rig and occasion: letters, digits, . _ -", id),
    RIG(DATE, "date", "day of the calibration, YYYY-MM-DD, or unknown", date),
    RIG(NOTE, "note", "assumptions made, as text; may be empty", note),
    RIG(NAME, "instrument", "profile of the instrument, or unknown", instrument),
    CAMERA(NAME, "camera", 1, 0, 0, 0, "", "serial number or port of the camera, or unknown", name),
    CAMERA(INTEGERS, "sensor_px", 2, 0, 1, LENS_SIDE_MAX_PX, "px",
           "width and height of the whole sensor", width_px),
    CAMERA(DECIMALS, "radius_px", 1, 6, 1, LENS_SIDE_MAX_PX, "px",
           "R: the radius for which distortion is stated", radius_px),
    CAMERA(DECIMALS, "pixel_mm", 1, 9, 0, 1, "mm", "side of a pixel", pixel_mm),
    RANGE("zoom_counts", 3, 100000, "counts", "calibrated range of zoom positions", zoom),
    RANGE("focus_counts", 3, 100000, "counts", "calibrated range of focus positions", focus),
    RANGE("log_focal_range", 12, 20, "",
          "range of log f over the zoom positions: what the other functions refer to", log_focal),
    RANGE("pan_rad", 9, 10, "rad", "calibrated range of pan, as commanded", pan_rad),
    FUNCTION("focal", 9, 1000000, "px", "focal length at infinity, of the zoom position", FOCAL),
    FUNCTION("focus_dioptre", 12, 1000, "1/m", "reciprocal of the distance in focus",
             FOCUS_DIOPTRE),
    CAMERA(DECIMALS, "focus_dioptre_by_count", ZOOM_FOCUS_TERMS, 12, -1000, 1000, "1/m",
           "what the focus position adds to it: first and second term", focus_dioptre_by_count),
    FUNCTION("centre_x", 9, 1000000, "px", "column of the principal point", CENTRE_X),
    FUNCTION("centre_y", 9, 1000000, "px", "row of the principal point", CENTRE_Y),
    FUNCTION("radial_2", 9, 100000, "px", "distortion at R: k1 R^3 / F^2", RADIAL_2),
    FUNCTION("radial_4", 9, 100000, "px", "distortion at R: k2 R^5 / F^4", RADIAL_4),
    FUNCTION("radial_6", 9, 100000, "px", "distortion at R: k3 R^7 / F^6", RADIAL_6),
    FUNCTION("tangential_1", 9, 100000, "px", "distortion at R: p1 R^2 / F", TANGENTIAL_1),
    FUNCTION("tangential_2", 9, 100000, "px", "distortion at R: p2 R^2 / F", TANGENTIAL_2),
    FUNCTION("pupil", 9, 100000, "mm", "shift of the entrance pupil along the axis", PUPIL),
    CAMERA(DECIMALS, "axis_direction", 2, 12, -1, 1, "", "x and z of the pan axis (x, 1, z)",
           mount[ZOOM_AXIS_DIRECTION_X]),
    CAMERA(DECIMALS, "axis_point_mm", 2, 9, -100000, 100000, "mm",
           "x and z where the pan axis meets y = 0", mount[ZOOM_AXIS_POINT_X]),
    CAMERA(DECIMALS, "pan_scale", 1, 12, -1, 1, "",
           "the turned angle is (1 + this) times the commanded one", mount[ZOOM_PAN_SCALE]),
    CAMERA(DECIMALS, "rotation_rad", 3, 12, -4, 4, "rad",
           "rotation vector from the camera's frame at pan 0 to the instrument's",
           mount[ZOOM_ROTATION_X]),
    CAMERA(DECIMALS, "position_mm", 3, 9, -100000, 100000, "mm",
           "entrance pupil at pan 0 and the smallest focal length", mount[ZOOM_POSITION_X]),
    CAMERA(DECIMALS, "reading_sigma_counts", 1, 6, 0, 1000, "counts",
           "standard deviation of a position that was read", reading_sigma_counts),
    CAMERA(DECIMALS, "drift_sigma_counts", 1, 6, 0, 1000, "counts",
           "standard deviation of the drift between calibration and use", drift_sigma_counts),
    CAMERA(DECIMALS, "pan_sigma_rad", 1, 9, 0, 1, "rad",
           "standard deviation of the angle at which the servo rests", pan_sigma_rad),
    CAMERA(DECIMALS, "creep_sigma_rad", 1, 9, 0, 1, "rad",
           "standard deviation of the angle by which it moves from there", creep_sigma_rad),
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
    {{"chi_square_z", "chi_square_z"},
     ZOOM_FIELD_END,
     ZOOM_FIELD_DECIMALS,
     1,
     3,
     -1000000,
     1000000,
     "",
     "standard score of the fit: beyond 4 the model does not fit",
     offsetof(struct zoom_calibration, validation.chi_square_z)},
};

const struct zoom_field *zoom_grammar_fields(int *count) {
    *count = sizeof fields / sizeof fields[0];
    INVARIANT(fields[0].part == ZOOM_FIELD_RIG && fields[*count - 1].part == ZOOM_FIELD_END);
    return fields;
}

const char *zoom_grammar_name(const struct zoom_field *field, int side, int version) {
    static const char *const renamed[][2] = {
        {"left_focus_dioptre", "left_vergence"},
        {"right_focus_dioptre", "right_vergence"},
        {"left_focus_dioptre_by_count", "left_focus_vergence"},
        {"right_focus_dioptre_by_count", "right_focus_vergence"},
    };
    INVARIANT(version >= 1 && version <= ZOOM_GRAMMAR_VERSION);
    for (size_t i = 0; version == 1 && i < sizeof renamed / sizeof renamed[0]; i++) {
        if (strcmp(field->name[side], renamed[i][0]) == 0) {
            return renamed[i][1];
        }
    }
    return field->name[side];
}

void *zoom_grammar_address(const struct zoom_field *field, int side,
                           struct zoom_calibration *calibration) {
    INVARIANT(side == 0 || (side == 1 && field->part == ZOOM_FIELD_CAMERA));
    char *base =
        field->part == ZOOM_FIELD_CAMERA ? (char *)&calibration->camera[side] : (char *)calibration;
    INVARIANT(field->offset < sizeof *calibration);
    return base + field->offset;
}
