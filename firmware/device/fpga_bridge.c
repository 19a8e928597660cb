// SPDX-License-Identifier: Apache-2.0
#include "device/fpga_bridge.h"

#include "core/error.h"
#include "core/invariant.h"

enum {
    // Number of bytes on the bus in a write: address, index, high, low.
    WRITE_BYTES = 4,
    WRITE_LOW_BYTE = 4,
    // Number of bytes that may have begun before the bridge can accept the word.
    UNTAKEN_BYTES = 3,
    // Read after the wanted data (see struct fpga_bridge_job).
    GUARD_BYTES = 2,
};

// The first register, which a bridge sends that has lost its index.
static uint16_t lost_index(uint8_t index) {
    _Static_assert((int)BRIDGE_ID == 0, "the index after a reset");
    INVARIANT(bridge_registers[0].index == BRIDGE_ID);
    // All ones are not its value either.
    return index == BRIDGE_ID ? UINT16_MAX : bridge_registers[0].reset;
}

const struct bridge_register *fpga_bridge_register(uint8_t index) {
    for (int i = 0; i < BRIDGE_REGISTER_COUNT; i++) {
        INVARIANT(i == 0 || bridge_registers[i - 1].index < bridge_registers[i].index);
        if (bridge_registers[i].index == index) {
            return &bridge_registers[i];
        }
    }
    return NULL;
}

static bool has_flag(const struct bridge_register *row, unsigned flag) {
    return row != NULL && (row->flags & flag) != 0;
}

static struct hal_i2c_message message(uint8_t *data, size_t bytes, bool read) {
    INVARIANT(bytes >= 1 && bytes <= HAL_I2C_BYTES_MAX);
    return (struct hal_i2c_message){data, (uint16_t)bytes, BRIDGE_I2C_ADDRESS, read};
}

static uint16_t word(const uint8_t *bytes) {
    return (uint16_t)(bytes[0] << 8 | bytes[1]);
}

// Reads the words from `index` on in one transfer. The index need not exist.
static int read_words(struct fpga_bridge *self, uint8_t index, size_t count, uint16_t *values) {
    INVARIANT(values != NULL);
    INVARIANT(count >= 1 && count <= FPGA_BRIDGE_BLOCK_WORDS);
    uint8_t bytes[2 * FPGA_BRIDGE_BLOCK_WORDS + GUARD_BYTES];
    const size_t read_bytes = 2 * count + GUARD_BYTES;
    const struct hal_i2c_message messages[] = {message(&index, 1, false),
                                               message(bytes, read_bytes, true)};
    const struct fpga_bridge_job job = {.messages = messages,
                                        .count = 2,
                                        .repeatable_bytes = SIZE_MAX,
                                        .guarded = bytes,
                                        .guarded_bytes = read_bytes,
                                        .lost_index = lost_index(index)};
    const int error = fpga_bridge_bus_run(&self->bus, &job);
    if (error == ERROR_OK) {
        for (size_t i = 0; i < count; i++) {
            values[i] = word(&bytes[2 * i]);
        }
    }
    return error;
}

// Writes a word and reads it back; `expected` in the bits of `mask`.
static int write_and_verify(struct fpga_bridge *self, uint8_t index, uint16_t value, uint16_t mask,
                            uint16_t expected) {
    INVARIANT(mask != 0 && (expected & ~mask) == 0);
    uint8_t bytes[WRITE_BYTES - 1] = {index, (uint8_t)(value >> 8), (uint8_t)value};
    uint8_t back[2 + GUARD_BYTES];
    const struct hal_i2c_message messages[] = {message(bytes, sizeof bytes, false),
                                               message(bytes, 1, false),
                                               message(back, sizeof back, true)};
    const struct fpga_bridge_job job = {.messages = messages,
                                        .count = 3,
                                        .repeatable_bytes = SIZE_MAX,
                                        .refusable_byte = WRITE_LOW_BYTE,
                                        .read_back = back,
                                        .mask = mask,
                                        .expected = expected,
                                        .guarded = back,
                                        .guarded_bytes = sizeof back,
                                        .lost_index = lost_index(index)};
    return fpga_bridge_bus_run(&self->bus, &job);
}

// Writes a word that must not be accepted twice, or cannot be read back.
static int write_once(struct fpga_bridge *self, uint8_t index, uint16_t value) {
    uint8_t bytes[WRITE_BYTES - 1] = {index, (uint8_t)(value >> 8), (uint8_t)value};
    const struct hal_i2c_message messages[] = {message(bytes, sizeof bytes, false)};
    const struct fpga_bridge_job job = {.messages = messages,
                                        .count = 1,
                                        .repeatable_bytes = UNTAKEN_BYTES,
                                        .refusable_byte = WRITE_LOW_BYTE};
    return fpga_bridge_bus_run(&self->bus, &job);
}

int fpga_bridge_open(struct fpga_bridge *self, const struct hal_i2c *bus,
                     const struct hal_clock *clock) {
    const struct bridge_register *id = fpga_bridge_register(BRIDGE_ID);
    const struct bridge_register *version = fpga_bridge_register(BRIDGE_VERSION);
    INVARIANT(id != NULL && version != NULL);
    _Static_assert((int)BRIDGE_VERSION == BRIDGE_ID + 1 && (int)BRIDGE_BUILD == BRIDGE_ID + 2 &&
                       (int)BRIDGE_CAPS == BRIDGE_ID + 3,
                   "one transfer");
    struct fpga_bridge opened;
    fpga_bridge_bus_init(&opened.bus, bus, clock);
    uint16_t words[4];
    const int error = read_words(&opened, BRIDGE_ID, 4, words);
    if (error != ERROR_OK) {
        return error;
    }
    const unsigned major = words[1] & BRIDGE_VERSION_MAJOR_MASK;
    if (words[0] != id->reset || major != (version->reset & BRIDGE_VERSION_MAJOR_MASK) ||
        words[1] < version->reset) {
        return ERROR_DEVICE;
    }
    opened.version = words[1];
    opened.build = words[2];
    opened.caps = words[3];
    opened.marked = false;
    opened.restarted = false;
    *self = opened;
    return ERROR_OK;
}

int fpga_bridge_need(const struct fpga_bridge *self, uint16_t caps) {
    return (self->caps & caps) == caps ? ERROR_OK : ERROR_UNSUPPORTED;
}

int fpga_bridge_read(struct fpga_bridge *self, uint8_t index, uint16_t *value) {
    return fpga_bridge_read_block(self, index, 1, value);
}

int fpga_bridge_read_block(struct fpga_bridge *self, uint8_t index, size_t count,
                           uint16_t *values) {
    if (!has_flag(fpga_bridge_register(index), BRIDGE_READ) || count < 1 ||
        count > FPGA_BRIDGE_BLOCK_WORDS) {
        return ERROR_ARGUMENT;
    }
    return read_words(self, index, count, values);
}

int fpga_bridge_write(struct fpga_bridge *self, uint8_t index, uint16_t value) {
    const struct bridge_register *row = fpga_bridge_register(index);
    if (!has_flag(row, BRIDGE_WRITE) || row->stored_mask == 0) {
        return ERROR_ARGUMENT;
    }
    if ((value & ~row->stored_mask) != 0 || value < row->min || value > row->max) {
        return ERROR_RANGE;
    }
    return write_and_verify(self, index, value, row->stored_mask, value);
}

int fpga_bridge_update(struct fpga_bridge *self, uint8_t index, uint16_t mask, uint16_t value) {
    const struct bridge_register *row = fpga_bridge_register(index);
    if (!has_flag(row, BRIDGE_WRITE) || row->stored_mask == 0) {
        return ERROR_ARGUMENT;
    }
    if ((value & ~mask) != 0) {
        return ERROR_RANGE;
    }
    uint16_t old = 0;
    const int error = read_words(self, index, 1, &old);
    if (error != ERROR_OK) {
        return error;
    }
    return fpga_bridge_write(self, index, (uint16_t)((old & row->stored_mask & ~mask) | value));
}

int fpga_bridge_read_field(struct fpga_bridge *self, struct fpga_bridge_field field,
                           uint16_t *value) {
    INVARIANT(field.shift < 16 && (field.mask >> field.shift & 1) == 1);
    uint16_t word = 0;
    const int error = fpga_bridge_read(self, field.index, &word);
    if (error == ERROR_OK) {
        *value = (uint16_t)((word & field.mask) >> field.shift);
    }
    return error;
}

int fpga_bridge_write_field(struct fpga_bridge *self, struct fpga_bridge_field field,
                            uint16_t value) {
    INVARIANT(field.shift < 16 && (field.mask >> field.shift & 1) == 1);
    if (value > field.mask >> field.shift) {
        return ERROR_RANGE;
    }
    return fpga_bridge_update(self, field.index, field.mask, (uint16_t)(value << field.shift));
}

int fpga_bridge_clear(struct fpga_bridge *self, uint8_t index, uint16_t bits) {
    const struct bridge_register *row = fpga_bridge_register(index);
    if (!has_flag(row, BRIDGE_WRITE) || row->clear_mask == 0) {
        return ERROR_ARGUMENT;
    }
    if ((bits & ~row->clear_mask) != 0) {
        return ERROR_RANGE;
    }
    INVARIANT((row->clear_mask & row->stored_mask) == 0);
    uint16_t old = 0;
    if (row->stored_mask != 0) {
        const int error = read_words(self, index, 1, &old);
        if (error != ERROR_OK) {
            return error;
        }
    }
    return write_once(self, index, (uint16_t)((old & row->stored_mask) | bits));
}

int fpga_bridge_start(struct fpga_bridge *self, uint8_t index, uint16_t bits) {
    const struct bridge_register *row = fpga_bridge_register(index);
    // A word that starts an action would also set the stored bits: CTRL has its own function.
    if (!has_flag(row, BRIDGE_WRITE) || row->pulse_mask == 0 || row->stored_mask != 0) {
        return ERROR_ARGUMENT;
    }
    if ((bits & ~row->pulse_mask) != 0) {
        return ERROR_RANGE;
    }
    return write_once(self, index, bits);
}

int fpga_bridge_touch(struct fpga_bridge *self, uint8_t index, uint16_t *value) {
    if (!has_flag(fpga_bridge_register(index), BRIDGE_READ)) {
        return ERROR_ARGUMENT;
    }
    INVARIANT(fpga_bridge_register(BRIDGE_IRQ_TEST)->stored_mask == 0);
    uint8_t nothing[] = {BRIDGE_IRQ_TEST, 0, 0};
    uint8_t bytes[2 + GUARD_BYTES];
    const struct hal_i2c_message messages[] = {message(nothing, sizeof nothing, false),
                                               message(&index, 1, false),
                                               message(bytes, sizeof bytes, true)};
    const struct fpga_bridge_job job = {.messages = messages,
                                        .count = 3,
                                        .repeatable_bytes = SIZE_MAX,
                                        .guarded = bytes,
                                        .guarded_bytes = sizeof bytes,
                                        .lost_index = lost_index(index)};
    const int error = fpga_bridge_bus_run(&self->bus, &job);
    if (error == ERROR_OK) {
        *value = word(bytes);
    }
    return error;
}

int fpga_bridge_write_unlocked(struct fpga_bridge *self, uint8_t index, uint16_t value) {
    int error = write_and_verify(self, BRIDGE_UNLOCK, BRIDGE_UNLOCK_KEY, 1, 1);
    if (error == ERROR_OK) {
        error = fpga_bridge_write(self, index, value);
    }
    const int lock_error = write_and_verify(self, BRIDGE_UNLOCK, 0, 1, 0);
    return lock_error != ERROR_OK ? lock_error : error;
}

int fpga_bridge_soft_reset(struct fpga_bridge *self) {
    const struct bridge_register *ctrl = fpga_bridge_register(BRIDGE_CTRL);
    INVARIANT(ctrl != NULL && (ctrl->pulse_mask & BRIDGE_CTRL_SOFT_RESET_MASK) != 0);
    int error = write_once(self, BRIDGE_CTRL, BRIDGE_CTRL_SOFT_RESET_MASK);
    uint16_t value = 0;
    if (error == ERROR_OK) {
        error = read_words(self, BRIDGE_CTRL, 1, &value);
    }
    if (error != ERROR_OK) {
        return error;
    }
    self->marked = false;
    self->restarted = false;
    return (value & ctrl->stored_mask) == (ctrl->reset & ctrl->stored_mask) ? ERROR_OK
                                                                            : ERROR_VERIFY;
}
