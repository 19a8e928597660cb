// SPDX-License-Identifier: Apache-2.0
#include "daemon/files/output_file.h"
#include "daemon/surface/result/write.h"

int write_reasons(const struct reconstruct_context *context, const char *path,
                  struct message *message) {
    const struct image_u8 *reason = &context->result->match.reason;
    struct output_file file;
    output_file_open(&file, path);
    if (file.stream != NULL) {
        fputs("P5\n", file.stream);
        for (int code = 0; code < REASON_COUNT; code++) {
            fprintf(file.stream, "# %d %s\n", code, reason_text(code));
        }
        if (context->mismatch.text[0] != '\0') {
            fprintf(file.stream, "# accepted mismatch: %s\n", context->mismatch.text);
        }
        fprintf(file.stream, "%d %d\n255\n", reason->width, reason->height);
    }
    for (int y = 0; y < reason->height; y++) {
        output_file_write(&file, image_u8_row(reason, y), (size_t)reason->width);
    }
    return output_file_close(&file, message);
}
