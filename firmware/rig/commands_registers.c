// SPDX-License-Identifier: Apache-2.0
// Registers of the bridge, by the names of their map, and of the sensors.
#include <string.h>

#include "bridge_register_names.h"
#include "core/error.h"
#include "core/invariant.h"
#include "rig/command_words.h"
#include "rig/commands.h"
#include "rig/rig.h"

enum { WHERE_BRIDGE, WHERE_LEFT, WHERE_RIGHT, VALUE_BYTES = 24 };

/// A register's name and index.
struct entry {
    const char *name;
    uint8_t index;
};

static const struct entry bridge_entries[] = {
#define BRIDGE_ENTRY(name, text) {text, (uint8_t)BRIDGE_##name},
    BRIDGE_REGISTER_NAMES(BRIDGE_ENTRY)
#undef BRIDGE_ENTRY
};

/// Those of the MT9T001 whose meaning public drivers agree on.
static const struct entry sensor_entries[] = {
    {"chip_version", 0x00}, {"row_start", 0x01},        {"column_start", 0x02},
    {"row_size", 0x03},     {"column_size", 0x04},      {"hblank", 0x05},
    {"vblank", 0x06},       {"output_control", 0x07},   {"shutter_high", 0x08},
    {"shutter", 0x09},      {"pixel_clock", 0x0A},      {"shutter_delay", 0x0C},
    {"reset", 0x0D},        {"read_mode_1", 0x1E},      {"read_mode_2", 0x20},
    {"read_mode_3", 0x21},  {"row_address_mode", 0x22}, {"column_address_mode", 0x23},
    {"green1_gain", 0x2B},  {"blue_gain", 0x2C},        {"red_gain", 0x2D},
    {"green2_gain", 0x2E},  {"chip_enable", 0xF8},
};

static int put_value(const struct command_call *call, const char *name, uint16_t value) {
    char text[VALUE_BYTES];
    struct command_text number = command_text_begin(text, sizeof text);
    command_text_add_hex(&number, value, 4);
    commands_put_text(call, name, text);
    return 0;
}

static int read_one(const struct command_call *call, int where, const struct entry *entry) {
    struct rig *rig = call->rig;
    uint16_t value = 0;
    int error = 0;
    if (where == WHERE_BRIDGE) {
        error = fpga_bridge_read(&rig->bridge, entry->index, &value);
    } else {
        const unsigned side = where == WHERE_LEFT ? RIG_LEFT : RIG_RIGHT;
        error = mt9t001_read(&rig->sensor[side], entry->index, &value);
    }
    if (error == 0) {
        return put_value(call, entry->name, value);
    }
    static const char *const devices[] = {
        [WHERE_BRIDGE] = "bridge", [WHERE_LEFT] = "left sensor", [WHERE_RIGHT] = "right sensor"};
    struct command_text sentence = commands_sentence(call);
    command_text_add(&sentence, "registers: ");
    command_text_add(&sentence, entry->name);
    command_text_add(&sentence, " of the ");
    command_text_add(&sentence, devices[where]);
    command_text_add(&sentence, " cannot be read: ");
    command_text_add(&sentence, error_text(error));
    command_text_add(&sentence, "; \"health\" looks at every part");
    return error;
}

/// Whether reading tells something: not of registers that only take writes.
static bool is_readable(int where, uint8_t index) {
    if (where != WHERE_BRIDGE) {
        return true;
    }
    const struct bridge_register *known = fpga_bridge_register(index);
    INVARIANT(known != NULL);
    return (known->flags & BRIDGE_READ) != 0;
}

static int no_such(const struct command_call *call, const char *word, const struct entry *entries,
                   size_t count) {
    struct command_text sentence = commands_sentence(call);
    command_text_add(&sentence, "registers: there is no readable register \"");
    command_text_add_typed(&sentence, word);
    command_text_add(&sentence, "\"");
    for (size_t i = 0; i < count; i++) {
        if (command_words_distance(word, entries[i].name) <= 2) {
            command_text_add(&sentence, "; did you mean \"");
            command_text_add(&sentence, entries[i].name);
            command_text_add(&sentence, "\"?");
            return ERROR_ARGUMENT;
        }
    }
    command_text_add(&sentence, "; without a name all are shown");
    return ERROR_ARGUMENT;
}

static int read_named(const struct command_call *call, int where, const struct entry *entries,
                      size_t count) {
    const char *word = call->values[1].text;
    int64_t index = -1;
    const bool number = command_words_integer(word, &index);
    for (size_t i = 0; i < count; i++) {
        const bool meant = number ? index == entries[i].index : strcmp(word, entries[i].name) == 0;
        if (meant && is_readable(where, entries[i].index)) {
            return read_one(call, where, &entries[i]);
        }
    }
    // Sensors have more registers than those with a name here.
    if (number && where != WHERE_BRIDGE && index >= 0 && index <= UINT8_MAX) {
        return read_one(call, where, &(struct entry){word, (uint8_t)index});
    }
    return no_such(call, word, entries, count);
}

/// Those with a name.
static const struct entry *entries_of(int where, size_t *count) {
    *count = where == WHERE_BRIDGE ? sizeof bridge_entries / sizeof bridge_entries[0]
                                   : sizeof sensor_entries / sizeof sensor_entries[0];
    return where == WHERE_BRIDGE ? bridge_entries : sensor_entries;
}

void commands_registers_candidates(const struct command_candidates *to) {
    const int where =
        to->count == 2 ? command_words_choice(to->words[1], COMMANDS_REGISTERS_WHERE) : -1;
    if (where < 0) {
        return;
    }
    size_t count = 0;
    const struct entry *entries = entries_of(where, &count);
    for (size_t i = 0; i < count; i++) {
        if (is_readable(where, entries[i].index)) {
            to->add(to->self, entries[i].name);
        }
    }
}

int commands_registers_run(const struct command_call *call) {
    const int where = call->values[0].choice;
    if (!call->rig->profile.bridge) {
        struct command_text sentence = commands_sentence(call);
        command_text_add(&sentence, "this instrument has no bridge and no sensors on its bus");
        return ERROR_NOT_CONNECTED;
    }
    size_t count = 0;
    const struct entry *entries = entries_of(where, &count);
    if (call->values[1].given) {
        return read_named(call, where, entries, count);
    }
    int error = 0;
    for (size_t i = 0; error == 0 && i < count; i++) {
        error = is_readable(where, entries[i].index) ? read_one(call, where, &entries[i]) : 0;
    }
    return error;
}
