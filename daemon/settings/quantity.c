// SPDX-License-Identifier: Apache-2.0
#include "daemon/settings/quantity.h"

#include <math.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "console/command_words.h"
#include "core/error.h"
#include "core/invariant.h"

enum { DECIMALS_MAX = 6 };

/// pi / 180 in nine digits: an angle of 90 deg is off by 0.002 urad.
#define URAD_PER_DEG 17453.2925

static const struct {
    const char *unit;
    double steps;  ///< steps of the integer in one unit
    bool rounds;   ///< a value between two steps becomes the nearest
} quantities[QUANTITIES] = {
    [QUANTITY_NUMBER] = {"", 1, false},
    [QUANTITY_ADDRESS] = {"", 1, false},
    [QUANTITY_PX] = {"px", 1, false},
    [QUANTITY_COUNTS] = {"counts", 1, false},
    [QUANTITY_COUNTS_PER_S] = {"counts/s", 1, false},
    [QUANTITY_S] = {"s", 1, false},
    [QUANTITY_MS] = {"ms", 1, false},
    [QUANTITY_US] = {"us", 1, false},
    [QUANTITY_MS_IN_US] = {"ms", 1000, false},
    [QUANTITY_PULSE] = {"us", 16, false},
    [QUANTITY_HZ] = {"Hz", 1, false},
    [QUANTITY_MHZ] = {"MHz", 1e6, false},
    [QUANTITY_ANGLE] = {"deg", URAD_PER_DEG, true},
    [QUANTITY_TURN_RATE] = {"deg/s", URAD_PER_DEG, true},
    [QUANTITY_SERVO_SCALE] = {"us/deg", 916.73247, true},  // 16 * 180 / pi
    [QUANTITY_PERCENT] = {"%", 10000, false},
    [QUANTITY_GAIN] = {"x", 8, false},
    [QUANTITY_MM_IN_UM] = {"mm", 1000, false},
    [QUANTITY_UM_IN_NM] = {"um", 1000, false},
    [QUANTITY_F_NUMBER] = {"", 1000, false},
    [QUANTITY_MB] = {"MB", 1, false},
};

static bool is_whole(double steps) {
    const double tolerance = 1e-7;  // rounding error of decimal fractions, which are inexact
    return fabs(steps - round(steps)) < tolerance;
}

/// Reads a number and its unit as steps.
static int read_steps(enum quantity quantity, const char *text, const char *range, double *steps,
                      struct message *why) {
    const char *unit = quantities[quantity].unit;
    int64_t integer = 0;
    if (*unit == '\0' && quantities[quantity].steps == 1) {
        const bool good = command_words_integer(text, &integer);
        *steps = (double)integer;
        return good ? 0 : message_set(why, ERROR_SYNTAX, "not an integer (expected %s)", range);
    }
    struct command_number number;
    const enum command_quantity read =
        command_words_quantity(text, quantity == QUANTITY_F_NUMBER ? "f/" : unit, &number);
    if (read == COMMAND_QUANTITY_NO_NUMBER) {
        return message_set(why, ERROR_SYNTAX, "not a number (expected %s)", range);
    }
    if (read == COMMAND_QUANTITY_UNKNOWN_UNIT || (*unit != '\0' && !number.stated)) {
        return message_set(why, ERROR_SYNTAX, "%s (expected %s)",
                           number.stated ? "unknown unit" : "unit missing", unit);
    }
    *steps = number.value * quantities[quantity].steps;
    return ERROR_OK;
}

int quantity_parse(enum quantity quantity, const char *text, int64_t min, int64_t max,
                   int64_t *value, struct message *why) {
    char range[QUANTITY_RANGE_BYTES], step[QUANTITY_BYTES];
    double steps = 0;
    INVARIANT(min <= max && (unsigned)quantity < QUANTITIES);
    quantity_print_range(quantity, min, max, range);
    const int error = read_steps(quantity, text, range, &steps, why);
    if (error != ERROR_OK) {
        return error;
    }
    if (round(steps) < (double)min || round(steps) > (double)max) {
        return message_set(why, ERROR_RANGE, "out of range (expected %s)", range);
    }
    if (!quantities[quantity].rounds && !is_whole(steps)) {
        quantity_print(quantity, 1, step);
        return message_set(why, ERROR_RANGE, "not a multiple of %s", step);
    }
    *value = llround(steps);
    return ERROR_OK;
}

/// Without the unit.
static size_t print_number(enum quantity quantity, int64_t value, char text[QUANTITY_BYTES]) {
    const double steps = quantities[quantity].steps;
    INVARIANT(value >= INT32_MIN && value <= INT32_MAX);
    if (quantity == QUANTITY_ADDRESS) {
        return (size_t)snprintf(text, QUANTITY_BYTES, "0x%02x", (unsigned)value);
    }
    for (int decimals = 0;; decimals++) {
        INVARIANT(decimals <= DECIMALS_MAX);  // each scale has its steps within these
        const int length = snprintf(text, QUANTITY_BYTES, "%.*f", decimals, (double)value / steps);
        const double again = strtod(text, NULL) * steps;
        if (llround(again) == value && (quantities[quantity].rounds || is_whole(again))) {
            return (size_t)length;
        }
    }
}

size_t quantity_print(enum quantity quantity, int64_t value, char text[QUANTITY_BYTES]) {
    INVARIANT((unsigned)quantity < QUANTITIES);
    const char *unit = quantities[quantity].unit;
    size_t length = print_number(quantity, value, text);
    length += (size_t)snprintf(text + length, QUANTITY_BYTES - length, "%s%s",
                               *unit != '\0' ? " " : "", unit);
    INVARIANT(length < QUANTITY_BYTES);
    return length;
}

void quantity_print_range(enum quantity quantity, int64_t min, int64_t max,
                          char text[QUANTITY_RANGE_BYTES]) {
    char from[QUANTITY_BYTES], to[QUANTITY_BYTES];
    print_number(quantity, min, from);
    quantity_print(quantity, max, to);
    snprintf(text, QUANTITY_RANGE_BYTES, "%s to %s", from, to);
}
