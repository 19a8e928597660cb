// SPDX-License-Identifier: Apache-2.0
#include "daemon/surface/length_check.h"

#include "core/error.h"

const char length_unit_option[] =
    "--unit mm confirms it, --unit m or cm corrects a file that states no unit";

int length_check_baseline(double baseline_mm, const char *name, const char *remedy,
                          struct message *message) {
    if (baseline_mm >= LENGTH_MIN_BASELINE_MM) {
        return ERROR_OK;
    }
    return message_set(message, ERROR_BASELINE,
                       "%s: a baseline of %.4g, in mm? None below %g mm is taken for granted: %s",
                       name, baseline_mm, LENGTH_MIN_BASELINE_MM, remedy);
}

int length_check_depth(double near_mm, double far_mm, const char *name, const char *remedy,
                       struct message *message) {
    if (near_mm == 0 || near_mm >= LENGTH_MIN_DEPTH_MM) {
        return ERROR_OK;
    }
    return message_set(message, ERROR_RANGE,
                       "%s: from %.6g to %.6g, in mm? No depth below %g mm is searched: for metres "
                       "write %.6g and %.6g%s",
                       name, near_mm, far_mm, LENGTH_MIN_DEPTH_MM, near_mm * 1000, far_mm * 1000,
                       remedy);
}
