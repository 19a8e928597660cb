// SPDX-License-Identifier: Apache-2.0
/// Parser of the status answer of the lens controllers V3LC and V1LC, byte by byte.
///
///     V3LC 2\r        controller and lens; a V1LC sends text without a colon
///     Zoom:0512\r     three values in this order: any text, the only colon, blanks, 1 to 4 digits
///     Focus:0300\r
///     Iris:0850\r\n
///
/// The iris value of a V1LC is known to be random: it reads 0, and any text after the colon is
/// accepted. CR and LF both end a record, empty records do not count, and the parser does not wait
/// for the last LF. It finds an answer within any other data, needs no start, and buffers at most
/// one record.
#ifndef VERGENCE_DEVICE_LENS_V3LC_ANSWER_H
#define VERGENCE_DEVICE_LENS_V3LC_ANSWER_H

#include <stdbool.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

enum { LENS_V3LC_RECORD = 24, LENS_V3LC_VALUES = 3 };

/// State of the parser. All zero: nothing was received; owned by the caller.
struct lens_v3lc_answer {
    bool begun;      ///< the record with the lens has been received
    uint8_t number;  ///< number of the lens, from 0; 0 for a V1LC
    uint8_t count;   ///< number of values received
    uint8_t length;  ///< bytes of the present record; LENS_V3LC_RECORD + 1: it is too long
    bool records;    ///< a record ended since the last LF or answer
    char record[LENS_V3LC_RECORD];
    int16_t values[LENS_V3LC_VALUES];
};

enum lens_v3lc_event {
    LENS_V3LC_NOTHING,
    LENS_V3LC_ANSWER,   ///< `number` and `values` are those of a complete answer
    LENS_V3LC_GARBAGE,  ///< LF, or the beginning of the next answer, came before an answer was
                        ///< complete
};

/// Processes a byte. `single`: a V1LC.
enum lens_v3lc_event lens_v3lc_answer_take(struct lens_v3lc_answer *self, bool single,
                                           uint8_t byte);

#ifdef __cplusplus
}
#endif

#endif
