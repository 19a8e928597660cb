// SPDX-License-Identifier: Apache-2.0
#include "rig/commands.h"

#include "core/error.h"
#include "core/invariant.h"
#include "rig/rig.h"

unsigned commands_sides(const struct command_value *value) {
    static const unsigned sides[] = {1U << RIG_LEFT, 1U << RIG_RIGHT, 3U};
    INVARIANT(!value->given || (value->choice >= 0 && value->choice < 3));
    return value->given ? sides[value->choice] : 3U;
}

const char *commands_side_name(unsigned at) {
    INVARIANT(at < RIG_SIDES);
    return at == RIG_LEFT ? "left" : "right";
}

struct command_text commands_sentence(const struct command_call *call) {
    return command_text_begin(call->message, call->message_bytes);
}

void commands_put_number(const struct command_call *call, const char *key, double value,
                         int decimals, const char *unit) {
    call->reply->operations->number(call->reply->self, key, value, decimals, unit);
}

void commands_put_text(const struct command_call *call, const char *key, const char *value) {
    call->reply->operations->text(call->reply->self, key, value);
}

void commands_put_begin(const struct command_call *call, const char *key, bool array) {
    call->reply->operations->begin(call->reply->self, key, array);
}

void commands_put_end(const struct command_call *call) {
    call->reply->operations->end(call->reply->self);
}

int command_run(const struct command *command, const struct command_call *call) {
    INVARIANT(call->message_bytes > 0);
    struct command_text sentence = commands_sentence(call);
    if ((command->flags & COMMAND_NEEDS_RIG) != 0 && call->rig->state != RIG_READY) {
        command_text_add(&sentence, command->name);
        command_text_add(&sentence, call->rig->state == RIG_DOWN
                                        ? ": the instrument is down; \"bringup\" first"
                                        : ": the instrument is in its safe state");
        if (call->rig->state == RIG_SAFE && call->rig->trouble.error != 0) {
            command_text_add(&sentence, " (");
            command_text_add(&sentence, call->rig->trouble.text);
            command_text_add(&sentence, ")");
        }
        if (call->rig->state == RIG_SAFE) {
            command_text_add(&sentence, "; \"bringup\" again");
        }
        return ERROR_NOT_READY;
    }
    const int error = command->run(call);
    if (error != 0 && call->message[0] == '\0') {
        // A part's failure was told where it happened.
        const bool told = (command->flags & COMMAND_NO_RIG) == 0 &&
                          call->rig->trouble.error == error && call->rig->trouble.text[0] != '\0';
        command_text_add(&sentence, told ? call->rig->trouble.text : error_text(error));
    }
    return error;
}
