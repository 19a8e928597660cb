// SPDX-License-Identifier: Apache-2.0
#include "daemon/server/surroundings.h"

#include <stdarg.h>
#include <stdio.h>

#include "core/invariant.h"

int surroundings_refuse(const struct command_call *call, int error, const char *format, ...) {
    INVARIANT(error < 0);
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(call->message, call->message_bytes, format, arguments);
    va_end(arguments);
    for (char *at = call->message; *at != '\0'; at++) {
        *at = (unsigned char)*at < ' ' || *at == 0x7F ? '?' : *at;
    }
    return error;
}
