// SPDX-License-Identifier: Apache-2.0
#include "daemon/files/output_file.h"
#include "daemon/surface/result/result_json.h"
#include "daemon/surface/result/write.h"

int write_result(const struct reconstruct_context *context, const char *path,
                 struct message *message) {
    struct output_file file;
    output_file_open(&file, path);
    if (file.stream != NULL) {
        result_json_print(context, file.stream);
    }
    return output_file_close(&file, message);
}
