// SPDX-License-Identifier: Apache-2.0
/// Driver of the image sensor Micron MT9T001: its settings and their timing.
///
/// Registers and times come from the Linux drivers mt9t001.c and mt9t031.c and Elphel's mt9x001.c,
/// where at least two of them agree; the first has two mistakes (the shift of the binning field,
/// the swapped address modes of rows and columns) that are not repeated here. Every write is read
/// back.
///
/// Errors: those of hal/i2c.h, after retries where these can help; ERROR_DEVICE: another device
/// responds; ERROR_VERIFY: a register does not hold what was written; ERROR_RANGE: a value outside
/// the sensor's range (nothing was sent).
#ifndef VERGENCE_DEVICE_MT9T001_H
#define VERGENCE_DEVICE_MT9T001_H

#include <stdbool.h>
#include <stdint.h>

#include "hal/clock.h"
#include "hal/i2c.h"

#ifdef __cplusplus
extern "C" {
#endif

enum {
    MT9T001_WIDTH_PX = 2048,
    MT9T001_HEIGHT_PX = 1536,
    MT9T001_GAIN_Q3_MIN = 8,  ///< gains are in 1/8
    MT9T001_GAIN_Q3_MAX = 1024,
    MT9T001_SHUTTER_ROWS_MAX = 0xFFFFF,
    MT9T001_SKIP_MAX = 8,
    MT9T001_HBLANK_CLOCKS_MIN = 21,
    MT9T001_VBLANK_ROWS_MIN = 3,
    /// Frames to skip after a change of exposure, gain or window.
    MT9T001_FRAMES_TO_SETTLE = 2,
};

/// Window and timing. Sizes are in pixels of the array; `skip` reads every n-th pair of rows and
/// columns, `bin` (<= skip) averages that many of them.
struct mt9t001_window {
    uint16_t column_px, row_px;  ///< corner, even; 0, 0 is the first pixel of the default window
    uint16_t width_px, height_px;
    uint8_t skip;  ///< 1 .. 8
    uint8_t bin;   ///< 1 .. 3
    uint16_t hblank_clocks, vblank_rows;
};

/// Timing of a window.
struct mt9t001_timing {
    uint16_t width_px, height_px;  ///< size of the output frames
    uint32_t row_clocks;
    uint32_t overhead_clocks;  ///< blanking after the exposure's rows, in which nothing is exposed
    uint32_t clock_hz;
    uint64_t row_ns;
    uint32_t frame_rows;  ///< frame period
    uint64_t frame_us;
};

/// Bus statistics; all wrap.
struct mt9t001_counts {
    uint32_t transfers, failures, repeats, mismatches;
};

/// A sensor. The caller owns it, and bus and clock, which must outlive it; used by one thread at a
/// time.
struct mt9t001 {
    const struct hal_i2c *bus;
    const struct hal_clock *clock;
    uint8_t address;
    uint32_t clock_hz;  ///< frequency of the sensor's clock input
    struct mt9t001_window window;
    uint32_t shutter_rows;
    uint16_t gain_q3;
    bool half_written;  ///< a change and its undo failed: the next change writes everything
    struct mt9t001_counts counts;
};

/// Finds the sensor at this address (0x5C or 0x5E behind the bridge's router, 0x5D if it is alone),
/// resets it, and sets the full window with the reset values of exposure and gain, outputs on.
int mt9t001_open(struct mt9t001 *self, const struct hal_i2c *bus, const struct hal_clock *clock,
                 uint8_t address, uint32_t clock_hz);

/// The full window as after a reset.
struct mt9t001_window mt9t001_full_window(void);
/// The window of this size (in pixels of the array, multiples of 2 * skip) in the middle of the
/// array, with the blanking of a reset. ERROR_RANGE: no such window.
int mt9t001_centred_window(uint16_t width_px, uint16_t height_px, uint8_t skip, uint8_t bin,
                           struct mt9t001_window *window);

/// Sets window, blanking and exposure at one moment (between two frames). The exposure time is kept
/// as closely as whole rows allow. After an error the sensor has the old window if it can still be
/// reached; mt9t001_check shows that, and the next change writes everything.
int mt9t001_set_window(struct mt9t001 *self, const struct mt9t001_window *window);
/// Sets window, exposure rows and gain of `like`, such as an earlier copy of `self`, at one moment.
/// After an error as mt9t001_set_window.
int mt9t001_set_like(struct mt9t001 *self, const struct mt9t001 *like);
/// Sets the exposure in whole rows, at least one; a long exposure makes frames longer.
int mt9t001_set_shutter(struct mt9t001 *self, uint32_t rows);
/// Sets the gain of all colours, in 1/8; `gain_q3` is then the nearest gain of the sensor.
int mt9t001_set_gain(struct mt9t001 *self, uint16_t gain_q3);
/// Abandons the frame that is exposed or sent: the next one is exposed from now on, with the
/// settings that were made before. Not read back: the sensor clears it.
int mt9t001_restart(struct mt9t001 *self);
/// Replaces all pixels by `value` (10 bits) from the next frame on, to test the lines; ends with
/// the next change of another setting.
int mt9t001_set_test_data(struct mt9t001 *self, uint16_t value);
/// The nearest gain of the sensor, and its register code. ERROR_RANGE.
int mt9t001_gain_code(uint16_t gain_q3, uint16_t *code, uint16_t *real_q3);

/// Timing of a window at this exposure. ERROR_RANGE.
int mt9t001_timing_of(const struct mt9t001_window *window, uint32_t shutter_rows, uint32_t clock_hz,
                      struct mt9t001_timing *timing);
/// Exposure time of a number of rows in a window, and the number of rows (>= 1) nearest to a time.
uint64_t mt9t001_exposure_us(const struct mt9t001_timing *timing, uint32_t rows);
uint32_t mt9t001_rows_for(const struct mt9t001_timing *timing, uint64_t exposure_us);

/// Reads chip version and the registers that were set: ERROR_VERIFY if one differs, ERROR_RESTARTED
/// if all have reset values. For health.
int mt9t001_check(struct mt9t001 *self);
/// Reads the level that the sensor gives to black, in the unit of its pixels.
int mt9t001_black(struct mt9t001 *self, uint16_t *black);
/// Reads any register, for the command `registers`.
int mt9t001_read(struct mt9t001 *self, uint8_t index, uint16_t *value);

#ifdef __cplusplus
}
#endif

#endif
