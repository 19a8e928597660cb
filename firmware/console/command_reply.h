// SPDX-License-Identifier: Apache-2.0
/// Adds items to the answer of a command: see struct command_reply_operations.
#ifndef VERGENCE_CONSOLE_COMMAND_REPLY_H
#define VERGENCE_CONSOLE_COMMAND_REPLY_H

#include "console/command.h"

static inline void reply_number(const struct command_call *call, const char *key, double value,
                                int decimals, const char *unit) {
    call->reply->operations->number(call->reply->self, key, value, decimals, unit);
}

static inline void reply_text(const struct command_call *call, const char *key, const char *value) {
    call->reply->operations->text(call->reply->self, key, value);
}

static inline void reply_group_begin(const struct command_call *call, const char *key, bool array) {
    call->reply->operations->begin(call->reply->self, key, array);
}

static inline void reply_group_end(const struct command_call *call) {
    call->reply->operations->end(call->reply->self);
}

#endif
