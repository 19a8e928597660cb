// SPDX-License-Identifier: Apache-2.0
#include "daemon/reconstruct_context.h"

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
