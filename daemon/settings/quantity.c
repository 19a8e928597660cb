// SPDX-License-Identifier: Apache-2.0
#include "daemon/settings/quantity.h"

#include <stdbool.h>
#include <stdio.h>
#include <string.h>

#include "console/command_words.h"
#include "core/decimal.h"
#include "core/error.h"
#include "core/invariant.h"

/// `steps` of the integer make `units` of the unit.
struct scale {
    int64_t steps, units;
};

static const struct {
    const char *unit;
    struct scale scale;
    bool rounds;  ///< a value between two steps becomes the nearest
} quantities[QUANTITIES] = {
    [QUANTITY_NUMBER] = {"", {1, 1}, false},
    [QUANTITY_ADDRESS] = {"", {1, 1}, false},
    [QUANTITY_PX] = {"px", {1, 1}, false},
    [QUANTITY_COUNTS] = {"counts", {1, 1}, false},
    [QUANTITY_COUNTS_PER_S] = {"counts/s", {1, 1}, false},
    [QUANTITY_S] = {"s", {1, 1}, false},
    [QUANTITY_MS] = {"ms", {1, 1}, false},
    [QUANTITY_US] = {"us", {1, 1}, false},
    [QUANTITY_MS_IN_US] = {"ms", {1000, 1}, false},
    [QUANTITY_PULSE] = {"us", {16, 1}, false},
    [QUANTITY_MHZ] = {"MHz", {1000000, 1}, false},
    // pi / 180 in nine digits: an angle of 90 deg is off by 0.002 urad.
    [QUANTITY_ANGLE] = {"deg", {174532925, 10000}, true},
    [QUANTITY_TURN_RATE] = {"deg/s", {174532925, 10000}, true},
    [QUANTITY_SERVO_SCALE] = {"us/deg", {91673247, 100000}, true},  // 16 * 180 / pi
    [QUANTITY_PERCENT] = {"%", {10000, 1}, false},
    [QUANTITY_GAIN] = {"x", {8, 1}, false},
};

/// Units that may stand for one another.
static const struct {
    const char *unit, *base;
    int64_t size;  ///< in the base
} aliases[] = {{"us", "s", 1},  {"ms", "s", 1000},   {"s", "s", 1000000},
               {"Hz", "Hz", 1}, {"kHz", "Hz", 1000}, {"MHz", "Hz", 1000000}};

enum { ALIASES = sizeof aliases / sizeof aliases[0] };

static int64_t greatest_divisor(int64_t a, int64_t b) {
    while (b != 0) {
        const int64_t rest = a % b;
        a = b;
        b = rest;
    }
    return a;
}

static int64_t nearest(int64_t a, int64_t b) {
    return (a < 0 ? a - b / 2 : a + b / 2) / b;
}

static int64_t power_of_ten(int decimals) {
    int64_t power = 1;
    for (int i = 0; i < decimals; i++) {
        power *= 10;
    }
    return power;
}

static size_t find_alias(const char *unit) {
    size_t i = 0;
    while (i < ALIASES && strcmp(aliases[i].unit, unit) != 0) {
        i++;
    }
    return i;
}

/// The scale of a quantity that is written in this unit; false: not a unit of it.
static bool find_scale(enum quantity quantity, const char *unit, struct scale *scale) {
    *scale = quantities[quantity].scale;
    if (strcmp(unit, quantities[quantity].unit) == 0) {
        return true;
    }
    const size_t own = find_alias(quantities[quantity].unit), other = find_alias(unit);
    if (own == ALIASES || other == ALIASES || strcmp(aliases[own].base, aliases[other].base) != 0) {
        return false;
    }
    scale->steps *= aliases[other].size;
    scale->units *= aliases[own].size;
    const int64_t common = greatest_divisor(scale->steps, scale->units);
    scale->steps /= common;
    scale->units /= common;
    return true;
}

/// Reads the number at the start of `text`, which ends where a unit may begin.
static bool read_number(const char *text, int64_t *scaled, int *decimals, const char **end) {
    const size_t length = strspn(text, "-.0123456789");
    const char *point = memchr(text, '.', length);
    *end = text + length;
    *decimals = point != NULL ? (int)(*end - point) - 1 : 0;
    if (point != NULL && (*decimals < 1 || *decimals > QUANTITY_DECIMALS)) {
        return false;
    }
    const int error = decimal_parse(text, length, *decimals, scaled);
    if (error == ERROR_RANGE) {
        *scaled = *text == '-' ? -DECIMAL_MAX : DECIMAL_MAX;  // beyond every limit
    }
    return error == ERROR_OK || error == ERROR_RANGE;
}

/// A number in units of 10^-decimals as an integer of this scale.
static enum quantity_result convert(struct scale scale, int64_t scaled, int decimals, bool rounds,
                                    int64_t min, int64_t max, int64_t *value) {
    const int64_t units = scale.units * power_of_ten(decimals);
    const int64_t limit = -min > max ? -min : max;
    INVARIANT(limit < INT64_MAX / units - 1);
    const int64_t beyond = (limit + 1) * units / scale.steps + 1;
    if (scaled > beyond || scaled < -beyond) {
        return QUANTITY_OUT_OF_RANGE;
    }
    const int64_t steps = nearest(scaled * scale.steps, units);
    if (steps < min || steps > max) {
        return QUANTITY_OUT_OF_RANGE;
    }
    if (!rounds && scaled * scale.steps % units != 0) {
        return QUANTITY_NOT_A_STEP;
    }
    *value = steps;
    return QUANTITY_GOOD;
}

static enum quantity_result parse_bare(const char *text, int64_t min, int64_t max, int64_t *value) {
    int64_t number = 0;
    if (!command_words_integer(text, &number)) {
        return QUANTITY_NOT_A_NUMBER;
    }
    if (number < min || number > max) {
        return QUANTITY_OUT_OF_RANGE;
    }
    *value = number;
    return QUANTITY_GOOD;
}

enum quantity_result quantity_parse(enum quantity quantity, const char *text, int64_t min,
                                    int64_t max, int64_t *value) {
    INVARIANT(min <= max);
    if (*quantity_unit(quantity) == '\0') {
        return parse_bare(text, min, max, value);
    }
    int64_t scaled = 0;
    int decimals = 0;
    const char *unit = NULL;
    if (!read_number(text, &scaled, &decimals, &unit)) {
        return QUANTITY_NOT_A_NUMBER;
    }
    struct scale scale;
    unit += strspn(unit, " \t");
    if (*unit == '\0') {
        return QUANTITY_UNIT_MISSING;
    }
    return find_scale(quantity, unit, &scale)
               ? convert(scale, scaled, decimals, quantities[quantity].rounds, min, max, value)
               : QUANTITY_UNIT_UNKNOWN;
}

/// Without the unit.
static size_t print_number(enum quantity quantity, int64_t value, char text[QUANTITY_BYTES]) {
    const struct scale scale = quantities[quantity].scale;
    INVARIANT(value >= INT32_MIN && value <= INT32_MAX);
    if (quantity == QUANTITY_ADDRESS) {
        return (size_t)snprintf(text, QUANTITY_BYTES, "0x%02x", (unsigned)value);
    }
    for (int decimals = 0; decimals <= QUANTITY_DECIMALS; decimals++) {
        const int64_t units = scale.units * power_of_ten(decimals);
        INVARIANT(value < INT64_MAX / units - 1 && -value < INT64_MAX / units - 1);
        const int64_t scaled = nearest(value * units, scale.steps);
        const bool exact = scaled * scale.steps == value * units;
        if (exact ||
            (quantities[quantity].rounds && nearest(scaled * scale.steps, units) == value)) {
            return decimal_print(scaled, decimals, text);
        }
    }
    INVARIANT(false);  // each scale has its steps within QUANTITY_DECIMALS
    return 0;
}

size_t quantity_print(enum quantity quantity, int64_t value, char text[QUANTITY_BYTES]) {
    const char *unit = quantity_unit(quantity);
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

const char *quantity_unit(enum quantity quantity) {
    INVARIANT((unsigned)quantity < QUANTITIES);
    return quantities[quantity].unit;
}
