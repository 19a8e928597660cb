// SPDX-License-Identifier: Apache-2.0
#include "daemon/surface/result/reconstruct_context.h"

#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#include "core/error.h"

void reconstruct_context_warn(struct reconstruct_context *context, const char *format, ...) {
    if (context->warning_count == RECONSTRUCT_CONTEXT_WARNINGS) {
        return;
    }
    char text[MESSAGE_BYTES];
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(text, sizeof text, format, arguments);
    va_end(arguments);
    message_set(&context->warnings[context->warning_count++], 0, "%s", text);
}

bool reconstruct_context_spread(const struct reconstruct_context *context,
                                struct result_figures_quantiles *spread) {
    if (!context->has_spread) {
        return result_figures_spread(context->result, spread);
    }
    *spread = context->spread;
    return true;
}

const struct reconstruct_result *reconstruct_context_ply(
    const struct reconstruct_context *context) {
    const struct reconstruct_mesh *mesh = context->mesh;
    return mesh != NULL && mesh->requested ? &mesh->result : context->result;
}

const char *reconstruct_context_unit_name(const struct reconstruct_context *context) {
    static const char *const names[] = {"millimetres", "centimetres", "metres"};
    return names[context->mesh_unit];
}

float reconstruct_context_unit_um(const struct reconstruct_context *context) {
    static const float um[] = {1e3f, 1e4f, 1e6f};
    return um[context->mesh_unit];
}

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
                               "files: unknown file \"%.*s\" (expected %s)",
                               (int)(length < 80 ? length : 80), at, names);
        }
    }
    return ERROR_OK;
}
