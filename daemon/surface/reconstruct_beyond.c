// SPDX-License-Identifier: Apache-2.0
#include "daemon/surface/reconstruct_beyond.h"

#include <stddef.h>
#include <string.h>

/// Single mismatches are not worth a note.
static const double noted_percent = 0.5;

void reconstruct_beyond_note(struct reconstruct_context *context) {
    const struct reconstruct_result *result = context->result;
    const double pixels = (double)result->plan.width_px * result->plan.height_px;
    const double percent = 100.0 * result->reason_count[REASON_BEYOND] / pixels;
    if (percent >= noted_percent) {
        reconstruct_context_warn(
            context,
            "%.1f %% of the pixels have disparities beyond infinity (0 or less): they are in the "
            "maps, without a depth; a calibration says where infinity is",
            percent);
    }
}

bool reconstruct_beyond_skips(const struct reconstruct_result *result, const char *file_name) {
    static const char *const of_surface[] = {"mesh.glb", "mesh.ply", "points.pcd"};
    if (result->triangle_count > 0 || result->reason_count[REASON_BEYOND] == 0) {
        return false;
    }
    for (size_t i = 0; i < sizeof of_surface / sizeof of_surface[0]; i++) {
        if (strcmp(file_name, of_surface[i]) == 0) {
            return true;
        }
    }
    return false;
}
