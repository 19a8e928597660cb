// SPDX-License-Identifier: Apache-2.0
#include "console/commands.h"

#include <stdarg.h>

#include "core/error.h"
#include "core/invariant.h"
#include "core/utf8.h"
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

int commands_not_ready(const struct command_call *call, const char *name) {
    const struct rig *rig = call->rig;
    struct command_text sentence = commands_sentence(call);
    INVARIANT(rig->state != RIG_READY);
    command_text_add(&sentence, name);
    if (rig->state == RIG_DOWN) {
        command_text_add(&sentence, ": the instrument is down (run \"bringup\")");
        return ERROR_NOT_READY;
    }
    command_text_add(&sentence, ": the instrument is in its safe state");
    // A cancelled command leaves no text, as the user wanted it.
    if (rig->last_error.error != ERROR_OK && rig->last_error.text[0] != '\0') {
        command_text_join(&sentence, ": ", rig->last_error.text);
    }
    command_text_add(&sentence, " (run \"bringup\")");
    return ERROR_NOT_READY;
}

static const struct rig_error *find_recorded(const struct rig *rig, int error) {
    if (rig->rejected.error == error) {
        return &rig->rejected;
    }
    return rig->last_error.error == error ? &rig->last_error : NULL;
}

/// Writes the message of a command that failed without one: the failure of a part or the rejected
/// value was recorded where it happened.
static void report_error(const struct command *command, const struct command_call *call,
                         int error) {
    struct command_text sentence = commands_sentence(call);
    const struct rig_error *reported = NULL;
    if ((command->flags & COMMAND_NO_RIG) == 0) {
        reported = find_recorded(call->rig, error);
    }
    if (reported != NULL && reported->text[0] != '\0') {
        command_text_add(&sentence, reported->text);
        return;
    }
    if (error != ERROR_CANCELLED) {
        command_text_join(&sentence, command->name, ": ");
    }
    command_text_add(&sentence, error_text(error));
}

int command_refuse(const struct command_call *call, int error, const char *format, ...) {
    struct command_text text = command_text_begin(call->message, call->message_bytes);
    va_list values;
    va_start(values, format);
    command_text_print_list(&text, format, values);
    va_end(values);
    utf8_mask_controls(call->message);
    return error;
}

int command_run(const struct command *command, const struct command_call *call) {
    INVARIANT(call->message_bytes > 0);
    call->message[0] = '\0';
    if ((command->flags & COMMAND_NO_RIG) == 0) {
        call->rig->rejected = (struct rig_error){.error = ERROR_OK};
    }
    if ((command->flags & COMMAND_NEEDS_RIG) != 0 && call->rig->state != RIG_READY) {
        return commands_not_ready(call, command->name);
    }
    const int error = command->run(call);
    if (error != ERROR_OK && call->message[0] == '\0') {
        report_error(command, call, error);
    }
    return error;
}

void command_store(const struct command_argument *arguments, unsigned count,
                   const struct command_value *values, void *into) {
    for (unsigned i = 0; i < count; i++) {
        const struct command_argument *argument = &arguments[i];
        void *to = (char *)into + argument->offset;
        const int numbers = argument->count > 0 ? argument->count : 1;
        if (!values[i].given || !command_argument_is_option(argument)) {
            continue;
        }
        switch (argument->kind) {
            case COMMAND_FLAG:
                *(bool *)to = values[i].choice == 1;
                break;
            case COMMAND_CHOICE:
                *(int *)to = values[i].choice;
                break;
            case COMMAND_TEXT:
                *(const char **)to = values[i].text;
                break;
            case COMMAND_INTEGER:
            case COMMAND_NUMBER:
                for (int j = 0; j < numbers; j++) {
                    if (argument->kind == COMMAND_INTEGER) {
                        ((int *)to)[j] = (int)values[i].numbers[j];
                    } else {
                        ((double *)to)[j] = values[i].numbers[j];
                    }
                }
                break;
        }
    }
}

int commands_region(const struct command_call *call, const struct command_value *value, int min_px,
                    int max_px, struct rig_rectangle *region_px) {
    uint16_t parts[4];
    *region_px = (struct rig_rectangle){.width_px = 0};
    if (!value->given) {
        return ERROR_OK;
    }
    for (int i = 0; i < 4; i++) {
        const double number = value->numbers[i];
        INVARIANT(number >= 0 && number <= UINT16_MAX);
        if (i >= 2 && (number < min_px || number > max_px)) {
            struct command_text sentence = commands_sentence(call);
            command_text_add(&sentence, "region: W and H of ");
            command_text_add_typed(&sentence, value->text);
            command_text_add(&sentence, " are out of range (expected ");
            command_text_add_integer(&sentence, min_px);
            command_text_add(&sentence, " to ");
            command_text_add_integer(&sentence, max_px);
            command_text_add(&sentence, " px)");
            return ERROR_RANGE;
        }
        parts[i] = (uint16_t)(number / 2) * 2;  // even: whole groups of the colour filter
    }
    *region_px = (struct rig_rectangle){parts[0], parts[1], parts[2], parts[3]};
    return ERROR_OK;
}
