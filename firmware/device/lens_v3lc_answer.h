// SPDX-License-Identifier: Apache-2.0
/// The status answer of the lens controllers V3LC and V1LC, byte by byte as it comes.
///
///     V3LC 2\r        who answers; a V1LC says something without a colon
///     Zoom:0512\r     three values in this order: anything, the only colon, blanks, 1 to 4 digits
///     Focus:0300\r
///     Iris:0850\r\n
///
/// What a V1LC says of its iris is known to be random: it reads 0, and whatever stands behind the
/// colon will do. CR and LF both end a record, records without a byte do not count, nothing waits
/// for the last LF. It finds an answer in whatever surrounds it, needs no start, and keeps one
/// record at most.
#ifndef VERGENCE_DEVICE_LENS_V3LC_ANSWER_H
#define VERGENCE_DEVICE_LENS_V3LC_ANSWER_H

#include <stdbool.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

enum { LENS_V3LC_RECORD = 24, LENS_V3LC_VALUES = 3 };

/// How far an answer has come. All zero: nothing was heard; the caller owns it.
struct lens_v3lc_answer {
    bool begun;      ///< the record with the lens has come
    uint8_t number;  ///< of the lens, from 0; 0 for a V1LC
    uint8_t count;   ///< values that have come
    uint8_t length;  ///< of the present record; LENS_V3LC_RECORD + 1: it is too long
    bool records;    ///< one ended since the last LF or answer
    char record[LENS_V3LC_RECORD];
    int16_t values[LENS_V3LC_VALUES];
};

enum lens_v3lc_event {
    LENS_V3LC_NOTHING,
    LENS_V3LC_ANSWER,   ///< `number` and `values` are those of a whole answer
    LENS_V3LC_RUBBISH,  ///< LF, or the begin of the next answer, came before an answer was whole
};

/// Takes a byte. `single`: a V1LC.
enum lens_v3lc_event lens_v3lc_answer_take(struct lens_v3lc_answer *self, bool single,
                                           uint8_t byte);

#ifdef __cplusplus
}
#endif

#endif
