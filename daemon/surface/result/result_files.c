// SPDX-License-Identifier: Apache-2.0
#include "daemon/surface/result/result_files.h"

#include <stdio.h>
#include <string.h>

#include "core/error.h"

bool result_files_has(const char *list, const char *file_name) {
    const size_t length = strlen(file_name);
    for (const char *at = list; at != NULL; at = strchr(at, ',')) {
        at += *at == ',';
        if (strncmp(at, file_name, length) == 0 && (at[length] == ',' || at[length] == '\0')) {
            return true;
        }
    }
    return false;
}

int result_files_check(const char *list, const struct result_writer *writers, int count,
                       struct message *message) {
    for (const char *at = list; at != NULL; at = strchr(at, ',')) {
        at += *at == ',';
        const size_t length = strcspn(at, ",");
        bool known = false;
        for (int i = 0; i < count && !known; i++) {
            const char *name = writers[i].file_name;
            known = strlen(name) == length && strncmp(name, at, length) == 0;
        }
        if (!known) {
            char names[MESSAGE_BYTES] = "";
            for (int i = 0; i < count; i++) {
                const size_t used = strlen(names);
                snprintf(names + used, sizeof names - used, "%s%s", i > 0 ? ", " : "",
                         writers[i].file_name);
            }
            return message_set(message, ERROR_ARGUMENT,
                               "unknown file \"%.*s\" in --files (expected %s)",
                               (int)(length < 80 ? length : 80), at, names);
        }
    }
    return ERROR_OK;
}
