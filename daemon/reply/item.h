// SPDX-License-Identifier: Apache-2.0
/// Adds items to the answer of a command: see struct command_reply_operations.
#ifndef VERGENCE_DAEMON_REPLY_ITEM_H
#define VERGENCE_DAEMON_REPLY_ITEM_H

#include "console/command.h"

static inline void item_number(const struct command_call *call, const char *key, double value,
                               int decimals, const char *unit) {
    call->reply->operations->number(call->reply->self, key, value, decimals, unit);
}

static inline void item_text(const struct command_call *call, const char *key, const char *value) {
    call->reply->operations->text(call->reply->self, key, value);
}

static inline void item_begin(const struct command_call *call, const char *key, bool array) {
    call->reply->operations->begin(call->reply->self, key, array);
}

static inline void item_end(const struct command_call *call) {
    call->reply->operations->end(call->reply->self);
}

#endif
