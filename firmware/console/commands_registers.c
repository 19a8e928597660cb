// SPDX-License-Identifier: Apache-2.0
// The command `registers`: registers of the FPGA bridge, by name, and of the sensors.
#include <string.h>

#include "console/command_words.h"
#include "console/commands.h"
#include "core/error.h"
#include "core/invariant.h"
#include "core/suggest.h"
#include "rig/registers.h"

enum { VALUE_BYTES = 24 };

static int put_value(const struct command_call *call, const char *name, uint16_t value) {
    char text[VALUE_BYTES];
    struct command_text number = command_text_begin(text, sizeof text);
    command_text_add_hex(&number, value, 4);
    reply_text(call, name, text);
    return ERROR_OK;
}

static int read_one(const struct command_call *call, enum registers_device where,
                    const struct registers_entry *entry) {
    uint16_t value = 0;
    const int error = registers_read(call->rig, where, entry->index, &value);
    if (error == ERROR_OK) {
        return put_value(call, entry->name, value);
    }
    static const char *const devices[] = {[REGISTERS_BRIDGE] = "bridge",
                                          [REGISTERS_LEFT] = "left sensor",
                                          [REGISTERS_RIGHT] = "right sensor"};
    struct command_text sentence = commands_sentence(call);
    command_text_join(&sentence, "registers: ", entry->name, " of the ", devices[where],
                      " cannot be read: ", error_text(error), " (\"health\" checks every part)");
    return error;
}

static int no_such(const struct command_call *call, const char *word,
                   const struct registers_entry *entries, size_t count) {
    struct command_text sentence = commands_sentence(call);
    struct suggest suggest;
    command_text_add(&sentence, "registers: unknown or unreadable register \"");
    command_text_add_typed(&sentence, word);
    command_text_add(&sentence, "\"");
    suggest_begin(&suggest, word, "");
    for (size_t i = 0; i < count; i++) {
        suggest_consider(&suggest, entries[i].name);
    }
    command_text_add(&sentence,
                     suggest.text[0] != '\0' ? suggest.text : " (leave NAME out to show all)");
    return ERROR_ARGUMENT;
}

static int read_named(const struct command_call *call, enum registers_device where,
                      const struct registers_entry *entries, size_t count) {
    const char *word = call->values[1].text;
    int64_t index = -1;
    const bool number = command_words_integer(word, &index);
    for (size_t i = 0; i < count; i++) {
        const bool meant = number ? index == entries[i].index : strcmp(word, entries[i].name) == 0;
        if (meant && registers_readable(where, entries[i].index)) {
            return read_one(call, where, &entries[i]);
        }
    }
    // Sensors have more registers than those named here.
    if (number && where != REGISTERS_BRIDGE && index >= 0 && index <= UINT8_MAX) {
        return read_one(call, where, &(struct registers_entry){word, (uint8_t)index});
    }
    return no_such(call, word, entries, count);
}

void commands_registers_candidates(const struct command_candidates *to) {
    const int choice =
        to->count == 2 ? command_words_choice(to->words[1], REGISTERS_DEVICE_NAMES) : -1;
    if (choice < 0) {
        return;
    }
    const enum registers_device where = (enum registers_device)choice;
    size_t count = 0;
    const struct registers_entry *entries = registers_entries(where, &count);
    for (size_t i = 0; i < count; i++) {
        if (registers_readable(where, entries[i].index)) {
            to->add(to->self, entries[i].name);
        }
    }
}

int commands_registers_run(const struct command_call *call) {
    const enum registers_device where = (enum registers_device)call->values[0].choice;
    if (!call->rig->profile.bridge) {
        struct command_text sentence = commands_sentence(call);
        command_text_add(&sentence, "registers: this instrument has no FPGA bridge");
        return ERROR_NOT_CONNECTED;
    }
    size_t count = 0;
    const struct registers_entry *entries = registers_entries(where, &count);
    if (call->values[1].given) {
        return read_named(call, where, entries, count);
    }
    int error = ERROR_OK;
    for (size_t i = 0; error == ERROR_OK && i < count; i++) {
        error = registers_readable(where, entries[i].index) ? read_one(call, where, &entries[i])
                                                            : ERROR_OK;
    }
    return error;
}
