// SPDX-License-Identifier: Apache-2.0
#include <math.h>

#include "core/error.h"
#include "daemon/files/output_file.h"
#include "daemon/surface/result/write.h"

int write_pfm(const struct reconstruct_context *context, const char *path,
              struct message *message) {
    const struct match_output *match = &context->result->match;
    const int width = match->disparity_q8.width, height = match->disparity_q8.height;
    struct output_file file;
    output_file_open(&file, path);
    if (file.stream != NULL) {
        fprintf(file.stream, "Pf\n%d %d\n-1.0\n", width, height);
    }
    unsigned char row[4 * IMAGE_MAX_SIDE_PX];
    for (int y = height - 1; y >= 0; y--) {
        const int32_t *disparity_q8 = image_i32_row(&match->disparity_q8, y);
        const uint8_t *reason = image_u8_row(&match->reason, y);
        for (int x = 0; x < width; x++) {
            output_file_put_f32(row + 4 * x, reason[x] == REASON_VALID
                                                 ? (float)disparity_q8[x] / 256.0f
                                                 : INFINITY);
        }
        output_file_write(&file, row, 4 * (size_t)width);
    }
    return output_file_close(&file, message);
}
