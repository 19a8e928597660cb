// SPDX-License-Identifier: Apache-2.0
#include <inttypes.h>
#include <stdio.h>

#include "daemon/surface/result/write.h"

void write_comments(const struct reconstruct_context *context, const char *mark, FILE *stream) {
    fprintf(stream, "%s vergence %s build %s\n", mark, context->version, context->build_id);
    fprintf(stream, "%s calibration %s crc %08" PRIx32 "\n", mark, context->calibration->id,
            context->result->calibration_crc);
    if (context->depth_sigma_common_mm >= 0) {
        fprintf(stream, "%s depth_sigma_common_mm %.3f\n", mark, context->depth_sigma_common_mm);
    }
    if (context->mismatch.text[0] != '\0') {
        fprintf(stream, "%s accepted mismatch: %s\n", mark, context->mismatch.text);
    }
    for (int line = 0; context->capture.session != NULL && line < CAPTURE_INFO_LINES; line++) {
        char text[CAPTURE_INFO_BYTES];
        capture_info_line(&context->capture, line, text);
        fprintf(stream, "%s %s%s\n", mark, line == 0 ? "capture " : "", text);
    }
}
