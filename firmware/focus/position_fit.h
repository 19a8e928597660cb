// SPDX-License-Identifier: Apache-2.0
/// Position of a motor at a given time, from noisy readings taken at other times: a few readings of
/// every thousand are random values, and the noise of the others is about one count.
#ifndef VERGENCE_FOCUS_POSITION_FIT_H
#define VERGENCE_FOCUS_POSITION_FIT_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

enum {
    POSITION_FIT_MAX = 32,         ///< readings
    POSITION_FIT_NEIGHBOURS = 4,   ///< readings of a moving motor used before and after the time
    POSITION_FIT_GAP_US = 400000,  ///< longest time between the two readings around it
};

/// A reading.
struct position_sample {
    uint64_t time_us;
    int32_t counts;
};

/// Mean of 1 .. POSITION_FIT_MAX readings of a motor at rest, without outliers, in 1/16 count.
/// `*sigma_q4`: its standard error, at least 1. It is not that of the readings alone, which may be
/// too few, but counts a noise of one count as four more of them.
void position_fit_mean(const struct position_sample *samples, unsigned count, int32_t *position_q4,
                       uint16_t *sigma_q4);

/// A position in 1/16 count, rounded to counts.
int32_t position_fit_counts(int32_t position_q4);

/// Position of a motor that may be moving, from up to POSITION_FIT_MAX readings in the order of
/// time: a straight line through the neighbours of `time_us`, without outliers; of the lines that
/// fit their readings, as a motor also starts and stops, the one with the smallest error.
/// ERROR_NOT_READY: there is no reading at this time or later; ERROR_MISSING: there is none at this
/// time or before, or the two readings around it are too far apart.
int position_fit_at(const struct position_sample *samples, unsigned count, uint64_t time_us,
                    int32_t *position_q4, uint16_t *sigma_q4);

#ifdef __cplusplus
}
#endif

#endif
