// SPDX-License-Identifier: Apache-2.0
#include "daemon/commands/surroundings.h"

#include <stdarg.h>
#include <stdio.h>

#include "core/error.h"
#include "core/invariant.h"
#include "daemon/settings/config.h"

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

int surroundings_refuse_store(const struct command_call *call, int error, const char *subject,
                              const char *done) {
    const char *why = error_text(error);
    if (error == ERROR_REFUSED) {
        why = "it may not be read or written; see who owns it, and whether its disk is read-only";
    } else if (error == ERROR_IO) {
        why =
            "its disk has failed, or the directory was taken away; mend it and start the daemon "
            "again";
    }
    return surroundings_refuse(call, error, "%s cannot be %s in the store %s: %s", subject, done,
                               surroundings_of(call)->config->store, why);
}
