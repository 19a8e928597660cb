// SPDX-License-Identifier: Apache-2.0
#include "rig/registers.h"

#include "bridge_register_names.h"
#include "core/error.h"
#include "core/invariant.h"
#include "rig/base/health.h"
#include "rig/base/rig_clock.h"
#include "rig/base/rig_error.h"
#include "rig/safe.h"

static const struct registers_entry bridge_entries[] = {
#define BRIDGE_ENTRY(name, text) {text, (uint8_t)BRIDGE_##name},
    BRIDGE_REGISTER_NAMES(BRIDGE_ENTRY)
#undef BRIDGE_ENTRY
};

/// Registers of the MT9T001 on whose meaning public drivers agree.
static const struct registers_entry sensor_entries[] = {
    {"chip_version", 0x00}, {"row_start", 0x01},        {"column_start", 0x02},
    {"row_size", 0x03},     {"column_size", 0x04},      {"hblank", 0x05},
    {"vblank", 0x06},       {"output_control", 0x07},   {"shutter_high", 0x08},
    {"shutter", 0x09},      {"pixel_clock", 0x0A},      {"shutter_delay", 0x0C},
    {"reset", 0x0D},        {"read_mode_1", 0x1E},      {"read_mode_2", 0x20},
    {"read_mode_3", 0x21},  {"row_address_mode", 0x22}, {"column_address_mode", 0x23},
    {"green1_gain", 0x2B},  {"blue_gain", 0x2C},        {"red_gain", 0x2D},
    {"green2_gain", 0x2E},  {"chip_enable", 0xF8},
};

const struct registers_entry *registers_entries(enum registers_device device, size_t *count) {
    INVARIANT((unsigned)device < REGISTERS_DEVICES && count != NULL);
    *count = device == REGISTERS_BRIDGE ? sizeof bridge_entries / sizeof bridge_entries[0]
                                        : sizeof sensor_entries / sizeof sensor_entries[0];
    return device == REGISTERS_BRIDGE ? bridge_entries : sensor_entries;
}

bool registers_readable(enum registers_device device, uint8_t index) {
    if (device != REGISTERS_BRIDGE) {
        return true;
    }
    const struct bridge_register *known = fpga_bridge_register(index);
    return known != NULL && (known->flags & BRIDGE_READ) != 0;
}

static struct mt9t001 *sensor_of(struct rig *rig, enum registers_device device) {
    return &rig->camera[device == REGISTERS_LEFT ? RIG_LEFT : RIG_RIGHT].sensor;
}

int registers_read(struct rig *rig, enum registers_device device, uint8_t index, uint16_t *value) {
    INVARIANT(rig->profile.bridge);
    return device == REGISTERS_BRIDGE ? fpga_bridge_read(&rig->bridge, index, value)
                                      : mt9t001_read(sensor_of(rig, device), index, value);
}

/// Number of consecutive readable registers from the first entry on.
static size_t run_of(enum registers_device device, const struct registers_entry *entries,
                     size_t count) {
    size_t run = 0;
    while (run < count && run < REGISTERS_RUN_WORDS &&
           entries[run].index == entries[0].index + run &&
           registers_readable(device, entries[run].index)) {
        run++;
    }
    return run;
}

/// Reads with as few transfers as the device allows.
static int read_run(struct rig *rig, enum registers_device device, struct registers_run *run) {
    int error = ERROR_OK;
    for (uint16_t at = 0; at < run->count && error == ERROR_OK;) {
        const uint8_t index = (uint8_t)(run->first + at);
        size_t words = 1;
        if (device == REGISTERS_BRIDGE) {
            words = run->count - at;
            words = words < FPGA_BRIDGE_BLOCK_WORDS ? words : FPGA_BRIDGE_BLOCK_WORDS;
            error = fpga_bridge_read_block(&rig->bridge, index, words, &run->values[at]);
        } else {
            error = mt9t001_read(sensor_of(rig, device), index, &run->values[at]);
        }
        at = (uint16_t)(at + words);
    }
    rig_part_used(rig, run->part, error);
    return error == ERROR_OK ? ERROR_OK : rig_bus_failed(rig, run->part, error);
}

static int read_place(struct rig *rig, enum registers_device device, struct registers_all *all) {
    static const enum rig_part parts[REGISTERS_DEVICES] = {RIG_PART_BRIDGE, RIG_PART_LEFT_SENSOR,
                                                           RIG_PART_RIGHT_SENSOR};
    size_t count = 0;
    const struct registers_entry *entries = registers_entries(device, &count);
    int error = ERROR_OK;
    for (size_t i = 0; i < count && error == ERROR_OK;) {
        const size_t length = run_of(device, &entries[i], count - i);
        if (length > 0) {
            INVARIANT(all->count < REGISTERS_RUNS_MAX);
            struct registers_run *run = &all->run[all->count];
            *run = (struct registers_run){.part = parts[device],
                                          .at_us = rig_now_us(rig),
                                          .first = entries[i].index,
                                          .count = (uint16_t)length};
            error = read_run(rig, device, run);
            all->count += error == ERROR_OK;
        }
        i += length > 0 ? length : 1;
    }
    return error;
}

int registers_read_all(struct rig *rig, struct registers_all *all) {
    INVARIANT(rig != NULL && all != NULL);
    all->count = 0;
    if (rig->state != RIG_READY) {
        return ERROR_NOT_READY;
    }
    int error = ERROR_OK;
    for (int device = 0; device < REGISTERS_DEVICES && rig->profile.bridge && error == ERROR_OK;
         device++) {
        error = read_place(rig, (enum registers_device)device, all);
    }
    return error == ERROR_OK ? rig_end(rig, error) : rig_fail_safe(rig, error);
}
