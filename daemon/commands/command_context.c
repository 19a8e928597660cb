// SPDX-License-Identifier: Apache-2.0
#include "daemon/commands/command_context.h"

#include <stdarg.h>
#include <stdio.h>

#include "core/error.h"
#include "core/invariant.h"
#include "daemon/settings/config.h"

int command_fail(const struct command_call *call, int error, const char *format, ...) {
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

int command_fail_store(const struct command_call *call, int error, const char *subject,
                       const char *action) {
    const char *why = error_text(error);
    if (error == ERROR_REFUSED) {
        why = "permission denied: check its owner, and whether its disk is read-only";
    } else if (error == ERROR_IO) {
        why =
            "its disk has failed, or the directory was removed: restore it and restart the daemon";
    }
    return command_fail(call, error, "%s: cannot %s the store %s: %s", subject, action,
                        context_of(call)->config->store, why);
}
