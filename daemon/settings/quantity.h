// SPDX-License-Identifier: Apache-2.0
/// Numbers with the units in which a setting is written ("-30 deg", "3.3 ms", "0x2c"), and the
/// integers in which the firmware keeps them.
#ifndef VERGENCE_DAEMON_SETTINGS_QUANTITY_H
#define VERGENCE_DAEMON_SETTINGS_QUANTITY_H

#include <stddef.h>
#include <stdint.h>

#include "daemon/base/message.h"

#ifdef __cplusplus
extern "C" {
#endif

/// A unit as written, and the unit of the integer behind it.
enum quantity {
    QUANTITY_NUMBER,        ///< no unit; decimal, or hexadecimal with 0x
    QUANTITY_ADDRESS,       ///< no unit; printed as 0x2c
    QUANTITY_PX,            ///< px
    QUANTITY_COUNTS,        ///< counts
    QUANTITY_COUNTS_PER_S,  ///< counts/s
    QUANTITY_S,             ///< s
    QUANTITY_MS,            ///< ms
    QUANTITY_US,            ///< us
    QUANTITY_MS_IN_US,      ///< ms; us
    QUANTITY_PULSE,         ///< us; 1/16 us
    QUANTITY_HZ,            ///< Hz; the same
    QUANTITY_MHZ,           ///< MHz; Hz
    QUANTITY_ANGLE,         ///< deg; urad
    QUANTITY_TURN_RATE,     ///< deg/s; urad/s
    QUANTITY_SERVO_SCALE,   ///< us/deg; 1/16 us per rad
    QUANTITY_PERCENT,       ///< %; 1e-6
    QUANTITY_GAIN,          ///< x; 1/8
    QUANTITY_MM_IN_UM,      ///< mm; um
    QUANTITY_UM_IN_NM,      ///< um; nm
    QUANTITY_F_NUMBER,      ///< no unit; 1/1000
    QUANTITY_MB,            ///< MB; the same
    QUANTITIES
};

enum {
    QUANTITY_BYTES = 48,         ///< size of a buffer for a number with its unit, with its end
    QUANTITY_RANGE_BYTES = 128,  ///< size of a buffer for a range
};

/// Reads all of `text`: a number, then the unit or another of the same kind, with or without a
/// blank between (command_words_quantity). Angles are rounded to the nearest integer; other numbers
/// must be one. 0; ERROR_SYNTAX (not a number, unit missing or unknown), ERROR_RANGE (outside min
/// to max, or between two integers), with `*value` unchanged and what is expected in `why`. min <=
/// max, both within 32 bits with a sign.
int quantity_parse(enum quantity quantity, const char *text, int64_t min, int64_t max,
                   int64_t *value, struct message *why);

/// Prints the shortest number that quantity_parse reads as `value`, and the unit. `value` fits 32
/// bits with a sign. Returns the length.
size_t quantity_print(enum quantity quantity, int64_t value, char text[QUANTITY_BYTES]);

/// Prints "-90 to 90 deg".
void quantity_print_range(enum quantity quantity, int64_t min, int64_t max,
                          char text[QUANTITY_RANGE_BYTES]);

#ifdef __cplusplus
}
#endif

#endif
