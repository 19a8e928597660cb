// SPDX-License-Identifier: Apache-2.0
#include "daemon/surface/result/result_format.h"

#include <stdio.h>
#include <string.h>

#include "core/error.h"

const struct result_format result_formats[RESULT_FORMATS] = {
#define RESULT_FORMAT_ROW(name, file, program, metric, surface, bytes, holds) \
    [RESULT_##name] = {file, metric, surface, bytes},
    RESULT_FORMAT_LIST(RESULT_FORMAT_ROW)
#undef RESULT_FORMAT_ROW
};

bool result_format_listed(const char *list, const char *file_name) {
    const size_t length = strlen(file_name);
    for (const char *at = list; at != NULL; at = strchr(at, ',')) {
        at += *at == ',';
        if (strncmp(at, file_name, length) == 0 && (at[length] == ',' || at[length] == '\0')) {
            return true;
        }
    }
    return list == NULL;
}

static bool is_written(const char *name, size_t length,
                       result_writer *const writers[RESULT_FORMATS]) {
    for (int i = 0; i < RESULT_FORMATS; i++) {
        const char *file = result_formats[i].file_name;
        if (writers[i] != NULL && strlen(file) == length && strncmp(file, name, length) == 0) {
            return true;
        }
    }
    return false;
}

int result_format_check(const char *list, result_writer *const writers[RESULT_FORMATS],
                        struct message *message) {
    for (const char *at = list; at != NULL; at = strchr(at, ',')) {
        at += *at == ',';
        const size_t length = strcspn(at, ",");
        if (is_written(at, length, writers)) {
            continue;
        }
        char names[MESSAGE_BYTES] = "";
        for (int i = 0; i < RESULT_FORMATS; i++) {
            const size_t used = strlen(names);
            if (writers[i] != NULL) {
                snprintf(names + used, sizeof names - used, "%s%s", used > 0 ? ", " : "",
                         result_formats[i].file_name);
            }
        }
        return message_set(message, ERROR_ARGUMENT, "files: unknown file \"%.*s\" (expected %s)",
                           (int)(length < 80 ? length : 80), at, names);
    }
    return ERROR_OK;
}
