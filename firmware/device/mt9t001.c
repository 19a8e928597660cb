// SPDX-License-Identifier: Apache-2.0
#include "device/mt9t001.h"

#include "core/error.h"
#include "core/invariant.h"
#include "device/i2c_recovery.h"

enum {
    CHIP_VERSION = 0x00,
    ROW_START = 0x01,
    COLUMN_START = 0x02,
    ROW_SIZE = 0x03,
    COLUMN_SIZE = 0x04,
    HORIZONTAL_BLANKING = 0x05,
    VERTICAL_BLANKING = 0x06,
    OUTPUT_CONTROL = 0x07,
    SHUTTER_WIDTH_HIGH = 0x08,
    SHUTTER_WIDTH = 0x09,
    PIXEL_CLOCK_CONTROL = 0x0A,
    FRAME_RESTART = 0x0B,
    SHUTTER_DELAY = 0x0C,
    RESET = 0x0D,
    READ_MODE_1 = 0x1E,
    READ_MODE_2 = 0x20,
    READ_MODE_3 = 0x21,
    ROW_ADDRESS_MODE = 0x22,
    COLUMN_ADDRESS_MODE = 0x23,
    GREEN1_GAIN = 0x2B,
    BLUE_GAIN = 0x2C,
    RED_GAIN = 0x2D,
    GREEN2_GAIN = 0x2E,
    TEST_DATA = 0x32,
    BLACK_LEVEL = 0x49,
};

enum {
    VERSION_MT9T001 = 0x1621,
    // In array coordinates: corner of the default window.
    FIRST_ROW = 20,
    FIRST_COLUMN = 32,
    SHUTTER_RESET_ROWS = 0x0619,
    READ_MODE_1_RESET = 0x8040,
    CONTROL_RUN = 0x0002,
    CONTROL_TEST_DATA = 0x0040,
    CONTROL_FREEZE = 0x0001,  // "synchronize changes": changes take effect when it is cleared
    BIN_SHIFT = 4,
    TEST_DATA_SHIFT = 2,
    TEST_DATA_MAX = 0x3FF,
    BLACK_SHIFT = 2,
    BLACK_MAX = 0x3FF,
};

enum {
    ATTEMPTS = 4,
    TRANSFER_US = 25000,
    // The bridge in front of the sensor leaves a transfer after 31 ms.
    QUIET_US = 32000,
    RESET_US = 1000,
    SETTINGS = 19,
};

struct setting {
    uint8_t index;
    uint16_t value;
};

// Wanted values of all registers used.
static void settings_of(const struct mt9t001 *self, struct setting settings[SETTINGS]) {
    const struct mt9t001_window *window = &self->window;
    uint16_t gain = 0, real_q3 = 0;
    const int error = mt9t001_gain_code(self->gain_q3, &gain, &real_q3);
    INVARIANT(error == ERROR_OK && real_q3 == self->gain_q3);
    INVARIANT(window->bin >= 1 && window->skip >= window->bin);
    const unsigned mode = (window->bin - 1u) << BIN_SHIFT | (window->skip - 1u);
    const struct setting all[SETTINGS] = {
        {ROW_START, (uint16_t)(FIRST_ROW + window->row_px)},
        {COLUMN_START, (uint16_t)(FIRST_COLUMN + window->column_px)},
        {ROW_SIZE, (uint16_t)(window->height_px - 1)},
        {COLUMN_SIZE, (uint16_t)(window->width_px - 1)},
        {HORIZONTAL_BLANKING, window->hblank_clocks},
        {VERTICAL_BLANKING, window->vblank_rows},
        {SHUTTER_WIDTH_HIGH, (uint16_t)(self->shutter_rows >> 16)},
        {SHUTTER_WIDTH, (uint16_t)self->shutter_rows},
        {PIXEL_CLOCK_CONTROL, 0},
        {SHUTTER_DELAY, 0},
        {READ_MODE_1, READ_MODE_1_RESET},
        {READ_MODE_2, 0},  // frames spoilt by a change are not sent
        {READ_MODE_3, 0},
        {ROW_ADDRESS_MODE, (uint16_t)mode},
        {COLUMN_ADDRESS_MODE, (uint16_t)mode},
        {GREEN1_GAIN, gain},
        {BLUE_GAIN, gain},
        {RED_GAIN, gain},
        {GREEN2_GAIN, gain},
    };
    for (int i = 0; i < SETTINGS; i++) {
        settings[i] = all[i];
    }
}

static uint64_t now_us(const struct mt9t001 *self) {
    return self->clock->operations->now_us(self->clock->self);
}

// Runs one transfer, with retries: everything on this bus may be sent twice. `back` (NULL: not
// checked): two bytes that must then read `expected`.
static int run(struct mt9t001 *self, const struct hal_i2c_message *messages, size_t count,
               const uint8_t *back, uint16_t expected) {
    INVARIANT(count >= 1 && count <= HAL_I2C_MESSAGES_MAX);
    int error = ERROR_OK;
    for (int attempt = 0; attempt < ATTEMPTS; attempt++) {
        self->counts.repeats += attempt > 0;
        const uint64_t deadline_us = now_us(self) + TRANSFER_US;
        size_t begun = 0;
        error =
            self->bus->operations->transfer(self->bus->self, messages, count, deadline_us, &begun);
        if (error == ERROR_OK) {
            self->counts.transfers++;
            if (back == NULL || (back[0] << 8 | back[1]) == expected) {
                return ERROR_OK;
            }
            self->counts.mismatches++;
            error = ERROR_VERIFY;
            continue;
        }
        self->counts.failures++;
        if (i2c_recovery_is_due(error)) {
            const int stuck = i2c_recovery_run(self->bus, self->clock, QUIET_US);
            if (stuck != ERROR_OK) {
                return stuck;
            }
        } else if (error != ERROR_I2C_NACK) {
            return error;
        }
    }
    INVARIANT(error != ERROR_OK);
    return error;
}

int mt9t001_read(struct mt9t001 *self, uint8_t index, uint16_t *value) {
    uint8_t bytes[2] = {0, 0};
    const struct hal_i2c_message messages[] = {{&index, 1, self->address, false},
                                               {bytes, sizeof bytes, self->address, true}};
    const int error = run(self, messages, 2, NULL, 0);
    if (error == ERROR_OK) {
        *value = (uint16_t)(bytes[0] << 8 | bytes[1]);
    }
    return error;
}

// Writes and reads back in one transfer.
static int write(struct mt9t001 *self, uint8_t index, uint16_t value) {
    uint8_t bytes[] = {index, (uint8_t)(value >> 8), (uint8_t)value};
    uint8_t back[2] = {0, 0};
    const struct hal_i2c_message messages[] = {{bytes, sizeof bytes, self->address, false},
                                               {bytes, 1, self->address, false},
                                               {back, sizeof back, self->address, true}};
    return run(self, messages, 3, back, value);
}

// Writes the settings of `wanted` that differ from `present`; all if that is NULL.
static int write_settings(struct mt9t001 *self, const struct setting *wanted,
                          const struct setting *present) {
    int error = ERROR_OK;
    for (int i = 0; i < SETTINGS && error == ERROR_OK; i++) {
        INVARIANT(present == NULL || present[i].index == wanted[i].index);
        if (present == NULL || present[i].value != wanted[i].value) {
            error = write(self, wanted[i].index, wanted[i].value);
        }
    }
    return error;
}

// Changes to `wanted`, whose counters do not matter, at one moment; unchanged after an error.
static int change_to(struct mt9t001 *self, const struct mt9t001 *wanted) {
    struct setting before[SETTINGS], after[SETTINGS];
    settings_of(self, before);
    settings_of(wanted, after);
    int error = write(self, OUTPUT_CONTROL, CONTROL_RUN | CONTROL_FREEZE);
    if (error == ERROR_OK) {
        error = write_settings(self, after, self->half_written ? NULL : before);
    }
    if (error != ERROR_OK) {
        // Frozen and partly written: restore. If that fails too, the next change writes all
        // registers.
        const int back = write_settings(self, before, NULL);
        self->half_written = back != ERROR_OK;
        if (back == ERROR_OK) {
            write(self, OUTPUT_CONTROL, CONTROL_RUN);
        }
        return error;
    }
    self->half_written = false;
    error = write(self, OUTPUT_CONTROL, CONTROL_RUN);
    // After the last write it is not known which settings are in force; these are in the registers.
    self->window = wanted->window;
    self->shutter_rows = wanted->shutter_rows;
    self->gain_q3 = wanted->gain_q3;
    return error;
}

int mt9t001_open(struct mt9t001 *self, const struct hal_i2c *bus, const struct hal_clock *clock,
                 uint8_t address, uint32_t clock_hz) {
    INVARIANT(bus != NULL && clock != NULL && clock_hz > 0);
    struct mt9t001 opened = {.bus = bus,
                             .clock = clock,
                             .address = address,
                             .clock_hz = clock_hz,
                             .window = mt9t001_full_window(),
                             .shutter_rows = SHUTTER_RESET_ROWS,
                             .gain_q3 = MT9T001_GAIN_Q3_MIN};
    uint16_t version = 0;
    int error = mt9t001_read(&opened, CHIP_VERSION, &version);
    if (error == ERROR_OK && version != VERSION_MT9T001) {
        error = ERROR_DEVICE;
    }
    if (error == ERROR_OK) {
        error = write(&opened, RESET, 1);
    }
    if (error == ERROR_OK) {
        clock->operations->wait_until_us(clock->self, now_us(&opened) + RESET_US);
        error = write(&opened, RESET, 0);
    }
    struct setting settings[SETTINGS];
    settings_of(&opened, settings);
    if (error == ERROR_OK) {
        error = write_settings(&opened, settings, NULL);
    }
    if (error == ERROR_OK) {
        error = write(&opened, OUTPUT_CONTROL, CONTROL_RUN);
    }
    if (error == ERROR_OK) {
        *self = opened;
    }
    return error;
}

int mt9t001_set_window(struct mt9t001 *self, const struct mt9t001_window *window) {
    struct mt9t001_timing before, after;
    int error = mt9t001_timing_of(window, 1, self->clock_hz, &after);
    if (error != ERROR_OK) {
        return error;
    }
    error = mt9t001_timing_of(&self->window, self->shutter_rows, self->clock_hz, &before);
    INVARIANT(error == ERROR_OK);
    struct mt9t001 wanted = *self;
    wanted.window = *window;
    wanted.shutter_rows =
        mt9t001_rows_for(&after, mt9t001_exposure_us(&before, self->shutter_rows));
    return change_to(self, &wanted);
}

int mt9t001_set_like(struct mt9t001 *self, const struct mt9t001 *like) {
    INVARIANT(like->bus == self->bus && like->address == self->address);
    return change_to(self, like);
}

int mt9t001_set_shutter(struct mt9t001 *self, uint32_t rows) {
    if (rows < 1 || rows > MT9T001_SHUTTER_ROWS_MAX) {
        return ERROR_RANGE;
    }
    struct mt9t001 wanted = *self;
    wanted.shutter_rows = rows;
    return change_to(self, &wanted);
}

int mt9t001_set_gain(struct mt9t001 *self, uint16_t gain_q3) {
    struct mt9t001 wanted = *self;
    uint16_t code = 0;
    const int error = mt9t001_gain_code(gain_q3, &code, &wanted.gain_q3);
    return error == ERROR_OK ? change_to(self, &wanted) : error;
}

int mt9t001_restart(struct mt9t001 *self) {
    uint8_t bytes[] = {FRAME_RESTART, 0, 1};
    const struct hal_i2c_message message = {bytes, sizeof bytes, self->address, false};
    return run(self, &message, 1, NULL, 0);
}

int mt9t001_set_test_data(struct mt9t001 *self, uint16_t value) {
    if (value > TEST_DATA_MAX) {
        return ERROR_RANGE;
    }
    const int error = write(self, TEST_DATA, (uint16_t)(value << TEST_DATA_SHIFT));
    return error == ERROR_OK ? write(self, OUTPUT_CONTROL, CONTROL_RUN | CONTROL_TEST_DATA) : error;
}

int mt9t001_black(struct mt9t001 *self, uint16_t *black) {
    uint16_t value = 0;
    const int error = mt9t001_read(self, BLACK_LEVEL, &value);
    if (error == ERROR_OK) {
        *black = value >> BLACK_SHIFT & BLACK_MAX;
    }
    return error;
}

int mt9t001_check(struct mt9t001 *self) {
    struct mt9t001 fresh = *self;
    fresh.window = mt9t001_full_window();
    fresh.shutter_rows = SHUTTER_RESET_ROWS;
    fresh.gain_q3 = MT9T001_GAIN_Q3_MIN;
    struct setting wanted[SETTINGS], reset[SETTINGS];
    settings_of(self, wanted);
    settings_of(&fresh, reset);
    uint16_t value = 0;
    int error = mt9t001_read(self, CHIP_VERSION, &value);
    if (error == ERROR_OK && value != VERSION_MT9T001) {
        return ERROR_DEVICE;
    }
    if (error == ERROR_OK) {
        error = mt9t001_read(self, OUTPUT_CONTROL, &value);
    }
    int wrong = error == ERROR_OK && value != CONTROL_RUN ? 1 : 0;
    bool as_after_reset = wrong == 0;
    for (int i = 0; i < SETTINGS && error == ERROR_OK; i++) {
        error = mt9t001_read(self, wanted[i].index, &value);
        wrong += value != wanted[i].value;
        as_after_reset = as_after_reset && value == reset[i].value;
    }
    if (error != ERROR_OK || wrong == 0) {
        return error;
    }
    return as_after_reset ? ERROR_RESTARTED : ERROR_VERIFY;
}
