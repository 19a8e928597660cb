// SPDX-License-Identifier: Apache-2.0
#include "device/i2c_recovery.h"

#include "core/error.h"
#include "core/invariant.h"

enum {
    BOTH = HAL_I2C_SCL | HAL_I2C_SDA,
    HALF_PERIOD_US = 5,  // longer than any bus timing at 100 kHz
    // A bus is free after it was high for 50 us (SMBus 3.2, table 2). The step does not divide
    // common clock periods, so that a running clock is not mistaken for a high level.
    FREE_STEP_US = 7,
    FREE_STEPS = 8,
    WAIT_STEP_US = 100,
    CLOCKS = 9,
    STRETCH_US = 1000,
};

struct lines {
    const struct hal_i2c *bus;
    const struct hal_clock *clock;
};

static uint64_t now_us(const struct lines *lines) {
    return lines->clock->operations->now_us(lines->clock->self);
}

static void wait_us(const struct lines *lines, uint32_t duration_us) {
    // The clock counts whole microseconds: wait one more, so that the time is never too short.
    const uint64_t end_us = now_us(lines) + duration_us + 1;
    lines->clock->operations->wait_until_us(lines->clock->self, end_us);
}

static int drive(const struct lines *lines, unsigned pulled, unsigned *high) {
    INVARIANT((pulled & ~(unsigned)BOTH) == 0);
    return lines->bus->operations->lines(lines->bus->self, pulled, high);
}

// Returns when the lines are free (`*high` is BOTH), or nothing has changed for `quiet_us`.
static int wait_for_silence(const struct lines *lines, uint32_t quiet_us, unsigned *high) {
    const uint64_t begin_us = now_us(lines);
    uint64_t moved_us = begin_us;
    unsigned before = ~0u, free_steps = 0;
    for (;;) {
        const int error = drive(lines, 0, high);
        if (error != ERROR_OK) {
            return error;
        }
        const uint64_t time_us = now_us(lines);
        moved_us = *high == before ? moved_us : time_us;
        before = *high;
        free_steps = *high == BOTH ? free_steps + 1 : 0;
        if (free_steps > FREE_STEPS || (*high != BOTH && time_us - moved_us >= quiet_us)) {
            return ERROR_OK;
        }
        if (time_us - begin_us >= 2 * (uint64_t)quiet_us) {
            return ERROR_I2C_STUCK;
        }
        wait_us(lines, *high == BOTH ? FREE_STEP_US : WAIT_STEP_US);
    }
}

// Releases SCL and waits until it is high, then for half a period. `*high`: the lines afterwards.
static int raise_scl(const struct lines *lines, unsigned *high) {
    const uint64_t begin_us = now_us(lines);
    for (;;) {
        int error = drive(lines, 0, high);
        if (error == ERROR_OK && (*high & HAL_I2C_SCL) != 0) {
            wait_us(lines, HALF_PERIOD_US);
            error = drive(lines, 0, high);
            return error;
        }
        if (error != ERROR_OK) {
            return error;
        }
        if (now_us(lines) - begin_us >= STRETCH_US) {
            return ERROR_I2C_STUCK;
        }
        wait_us(lines, HALF_PERIOD_US);
    }
}

static int clock_until_free(const struct lines *lines, unsigned *high) {
    INVARIANT((*high & HAL_I2C_SDA) == 0);
    for (int clocks = 0; clocks < CLOCKS && *high != BOTH; clocks++) {
        int error = drive(lines, HAL_I2C_SCL, high);
        if (error != ERROR_OK) {
            return error;
        }
        wait_us(lines, HALF_PERIOD_US);
        error = raise_scl(lines, high);
        if (error != ERROR_OK) {
            return error;
        }
    }
    return *high == BOTH ? ERROR_OK : ERROR_I2C_STUCK;
}

// START and STOP while SCL stays high.
static int end_transfers(const struct lines *lines) {
    unsigned high = 0;
    int error = drive(lines, HAL_I2C_SDA, &high);
    if (error != ERROR_OK) {
        return error;
    }
    wait_us(lines, HALF_PERIOD_US);
    error = drive(lines, 0, &high);
    if (error != ERROR_OK) {
        return error;
    }
    wait_us(lines, HALF_PERIOD_US);
    error = drive(lines, 0, &high);
    if (error != ERROR_OK) {
        return error;
    }
    return high == BOTH ? ERROR_OK : ERROR_I2C_STUCK;
}

bool i2c_recovery_is_due(int error) {
    return error == ERROR_I2C_ARBITRATION || error == ERROR_TIMEOUT || error == ERROR_I2C_STUCK ||
           error == ERROR_IO;
}

int i2c_recovery_run(const struct hal_i2c *bus, const struct hal_clock *clock, uint32_t quiet_us) {
    INVARIANT(bus != NULL && clock != NULL && quiet_us > 0);
    const struct lines lines = {bus, clock};
    if (bus->operations->lines == NULL) {
        wait_us(&lines, quiet_us);
        return ERROR_OK;
    }
    unsigned high = 0;
    int error = wait_for_silence(&lines, quiet_us, &high);
    if (error == ERROR_OK && high != BOTH) {
        if ((high & HAL_I2C_SCL) == 0) {
            return ERROR_I2C_STUCK;
        }
        error = clock_until_free(&lines, &high);
    }
    if (error != ERROR_OK) {
        return error;
    }
    INVARIANT(high == BOTH);
    return end_transfers(&lines);
}
