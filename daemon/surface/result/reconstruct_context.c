// SPDX-License-Identifier: Apache-2.0
#include "daemon/surface/result/reconstruct_context.h"

#include <stdarg.h>
#include <stdio.h>

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
                                struct surface_figures_spread *spread) {
    if (!context->has_spread) {
        return result_figures_spread(context->result, spread);
    }
    *spread = context->spread;
    return true;
}

const struct reconstruct_result *reconstruct_context_ply(
    const struct reconstruct_context *context) {
    return context->mesh != NULL && context->mesh_requested ? context->mesh : context->result;
}

const char *reconstruct_context_unit_name(const struct reconstruct_context *context) {
    static const char *const names[] = {"millimetres", "centimetres", "metres"};
    return names[context->mesh_unit];
}

float reconstruct_context_unit_um(const struct reconstruct_context *context) {
    static const float um[] = {1e3f, 1e4f, 1e6f};
    return um[context->mesh_unit];
}
