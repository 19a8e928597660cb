// SPDX-License-Identifier: Apache-2.0
#include "daemon/surface/length_check.h"

#include "core/error.h"

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
