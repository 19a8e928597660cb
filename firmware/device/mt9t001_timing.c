// SPDX-License-Identifier: Apache-2.0
// Calculations that need no sensor: windows, times, gain codes.
#include "core/error.h"
#include "core/invariant.h"
#include "device/mt9t001.h"

enum {
    BIN_MAX = 3,
    HBLANK_MAX = 2047,
    VBLANK_MAX = 2047,
    HBLANK_RESET = 142,
    VBLANK_RESET = 25,
    SMALLEST_PX = 2,
    // Minimum clocks of a row: a constant of Elphel's drivers.
    ROW_CLOCKS_MIN = 511,
    // Gain: first stage only, then doubled by the second, then digital steps above 8.
    GAIN_ONE_STAGE_MAX_Q3 = 32,
    GAIN_ANALOG_MAX_Q3 = 64,
    GAIN_SECOND_STAGE = 0x40,
    GAIN_DIGITAL_SHIFT = 8,
};

// Clocks of a row in addition to columns and blanking, by row and column binning (Elphel).
static uint32_t row_overhead(uint8_t bin) {
    static const uint16_t clocks[BIN_MAX] = {331, 673, 999};
    INVARIANT(bin >= 1 && bin <= BIN_MAX);
    return clocks[bin - 1];
}

static uint32_t column_overhead(uint8_t bin) {
    static const uint16_t clocks[BIN_MAX] = {38, 22, 14};
    INVARIANT(bin >= 1 && bin <= BIN_MAX);
    return clocks[bin - 1];
}

struct mt9t001_window mt9t001_full_window(void) {
    return (struct mt9t001_window){.width_px = MT9T001_WIDTH_PX,
                                   .height_px = MT9T001_HEIGHT_PX,
                                   .skip = 1,
                                   .bin = 1,
                                   .hblank_clocks = HBLANK_RESET,
                                   .vblank_rows = VBLANK_RESET};
}

static bool is_span_good(unsigned first, unsigned size, unsigned all, unsigned skip) {
    return first % 2 == 0 && size >= SMALLEST_PX * skip && size % (2 * skip) == 0 && size <= all &&
           first <= all - size;
}

static bool is_window_good(const struct mt9t001_window *window) {
    return window->skip >= 1 && window->skip <= MT9T001_SKIP_MAX && window->bin >= 1 &&
           window->bin <= BIN_MAX && window->bin <= window->skip &&
           is_span_good(window->column_px, window->width_px, MT9T001_WIDTH_PX, window->skip) &&
           is_span_good(window->row_px, window->height_px, MT9T001_HEIGHT_PX, window->skip) &&
           window->hblank_clocks >= MT9T001_HBLANK_CLOCKS_MIN &&
           window->hblank_clocks <= HBLANK_MAX && window->vblank_rows >= MT9T001_VBLANK_ROWS_MIN &&
           window->vblank_rows <= VBLANK_MAX;
}

int mt9t001_centred_window(uint16_t width_px, uint16_t height_px, uint8_t skip, uint8_t bin,
                           struct mt9t001_window *window) {
    struct mt9t001_window made = mt9t001_full_window();
    if (width_px > MT9T001_WIDTH_PX || height_px > MT9T001_HEIGHT_PX) {
        return ERROR_RANGE;
    }
    made.width_px = width_px;
    made.height_px = height_px;
    made.skip = skip;
    made.bin = bin;
    // Even, so that the colour pattern does not change.
    made.column_px = (uint16_t)((MT9T001_WIDTH_PX - width_px) / 4 * 2);
    made.row_px = (uint16_t)((MT9T001_HEIGHT_PX - height_px) / 4 * 2);
    if (!is_window_good(&made)) {
        return ERROR_RANGE;
    }
    *window = made;
    return ERROR_OK;
}

// clocks * unit / clock_hz, rounded to nearest.
static uint64_t time_of(uint64_t clocks, uint32_t unit, uint32_t clock_hz) {
    INVARIANT(clock_hz > 0);
    return (clocks * unit + clock_hz / 2) / clock_hz;
}

int mt9t001_timing_of(const struct mt9t001_window *window, uint32_t shutter_rows, uint32_t clock_hz,
                      struct mt9t001_timing *timing) {
    if (!is_window_good(window) || shutter_rows < 1 || shutter_rows > MT9T001_SHUTTER_ROWS_MAX ||
        clock_hz < 1) {
        return ERROR_RANGE;
    }
    const uint32_t columns = window->width_px / window->skip;
    const uint32_t rows = window->height_px / window->skip;
    const uint32_t overhead = row_overhead(window->bin);
    const uint32_t clocks =
        columns + overhead + column_overhead(window->bin) + window->hblank_clocks;
    const uint32_t row_clocks = clocks > ROW_CLOCKS_MIN ? clocks : ROW_CLOCKS_MIN;
    // The rows of the next frame are exposed meanwhile, so a long exposure makes frames longer.
    const uint32_t readout = rows + window->vblank_rows + 1;
    const uint32_t frame_rows = shutter_rows + 1 > readout ? shutter_rows + 1 : readout;
    *timing = (struct mt9t001_timing){
        .width_px = (uint16_t)columns,
        .height_px = (uint16_t)rows,
        .row_clocks = row_clocks,
        .overhead_clocks = overhead,
        .clock_hz = clock_hz,
        .row_ns = time_of(row_clocks, 1000000000, clock_hz),
        .frame_rows = frame_rows,
        .frame_us = time_of((uint64_t)row_clocks * frame_rows, 1000000, clock_hz),
    };
    return ERROR_OK;
}

uint64_t mt9t001_exposure_us(const struct mt9t001_timing *timing, uint32_t rows) {
    INVARIANT(rows >= 1 && rows <= MT9T001_SHUTTER_ROWS_MAX);
    INVARIANT(timing->row_clocks > timing->overhead_clocks);
    const uint64_t clocks = (uint64_t)rows * timing->row_clocks - timing->overhead_clocks;
    return time_of(clocks, 1000000, timing->clock_hz);
}

uint32_t mt9t001_rows_for(const struct mt9t001_timing *timing, uint64_t exposure_us) {
    INVARIANT(timing->row_clocks > 0 && timing->clock_hz > 0);
    const uint64_t longest_us = mt9t001_exposure_us(timing, MT9T001_SHUTTER_ROWS_MAX);
    if (exposure_us >= longest_us) {
        return MT9T001_SHUTTER_ROWS_MAX;
    }
    const uint64_t clocks = exposure_us * timing->clock_hz / 1000000 + timing->overhead_clocks;
    const uint64_t rows = (clocks + timing->row_clocks / 2) / timing->row_clocks;
    INVARIANT(rows <= MT9T001_SHUTTER_ROWS_MAX);
    return rows < 1 ? 1 : (uint32_t)rows;
}

int mt9t001_gain_code(uint16_t gain_q3, uint16_t *code, uint16_t *real_q3) {
    if (gain_q3 < MT9T001_GAIN_Q3_MIN || gain_q3 > MT9T001_GAIN_Q3_MAX) {
        return ERROR_RANGE;
    }
    if (gain_q3 <= GAIN_ONE_STAGE_MAX_Q3) {
        *code = *real_q3 = gain_q3;
    } else if (gain_q3 <= GAIN_ANALOG_MAX_Q3) {
        const unsigned half = (gain_q3 + 1u) / 2;
        *code = (uint16_t)(GAIN_SECOND_STAGE | half);
        *real_q3 = (uint16_t)(2 * half);
    } else {
        // 8 times (1 + steps / 8).
        const unsigned steps = (gain_q3 - GAIN_ANALOG_MAX_Q3 + 4u) / 8;
        *code = (uint16_t)(steps << GAIN_DIGITAL_SHIFT | GAIN_SECOND_STAGE | GAIN_ONE_STAGE_MAX_Q3);
        *real_q3 = (uint16_t)(GAIN_ANALOG_MAX_Q3 + 8 * steps);
    }
    INVARIANT(*real_q3 >= MT9T001_GAIN_Q3_MIN && *real_q3 <= MT9T001_GAIN_Q3_MAX);
    return ERROR_OK;
}
