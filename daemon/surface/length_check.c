// SPDX-License-Identifier: Apache-2.0
#include "daemon/surface/length_check.h"

#include <math.h>

#include "core/error.h"
#include "stereo/geometry/geometry.h"

const char length_unit_option[] =
    "state the unit of the file's lengths, --unit mm, --unit cm or --unit m";

int length_check_baseline(double baseline_mm, const char *name, const char *remedy,
                          struct message *message) {
    if (baseline_mm > LENGTH_MAX_BASELINE_MM) {
        return message_set(
            message, ERROR_BASELINE,
            "%s: baseline of %.6g mm is above %g mm, possibly mm taken for metres: %s", name,
            baseline_mm, LENGTH_MAX_BASELINE_MM, remedy);
    }
    if (baseline_mm >= LENGTH_MIN_BASELINE_MM) {
        return ERROR_OK;
    }
    return message_set(message, ERROR_BASELINE,
                       "%s: baseline of %.4g mm is below %g mm, possibly in metres: %s", name,
                       baseline_mm, LENGTH_MIN_BASELINE_MM, remedy);
}

int length_check_depth(double near_mm, double far_mm, const char *name, const char *remedy,
                       struct message *message) {
    if (near_mm == 0 || near_mm >= LENGTH_MIN_DEPTH_MM) {
        return ERROR_OK;
    }
    return message_set(
        message, ERROR_RANGE,
        "%s: depths %.6g to %.6g mm begin below %g mm, possibly in metres: write %.6g and %.6g%s",
        name, near_mm, far_mm, LENGTH_MIN_DEPTH_MM, near_mm * 1000, far_mm * 1000, remedy);
}

bool length_check_in_line(const struct calibration *calibration, struct message *message) {
    double R_right_left[9], centre_mm[3], axis[3];
    geometry_rotation_from_vector(calibration->rotation_right_left_rad, R_right_left);
    geometry_rotate_back(R_right_left, calibration->translation_right_left_mm, centre_mm);
    // The mean of both optical axes, in the left camera's frame; a centre of -R^T t.
    for (int i = 0; i < 3; i++) {
        axis[i] = R_right_left[6 + i] + (i == 2 ? 1.0 : 0.0);
    }
    const double along_mm = -geometry_dot(centre_mm, axis) / geometry_norm(axis);
    const double apart_mm = geometry_norm(centre_mm);
    const double beside_mm = sqrt(fmax(0, apart_mm * apart_mm - along_mm * along_mm));
    if (!(fabs(along_mm) > beside_mm)) {
        return false;
    }
    message_set(message, ERROR_OVERLAP,
                "the right camera is %.4g mm %s the left one and only %.4g mm beside it, so that "
                "rows cannot correspond: place the cameras side by side, or check the "
                "calibration's translation",
                fabs(along_mm), along_mm > 0 ? "in front of" : "behind", beside_mm);
    return true;
}
