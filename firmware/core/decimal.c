// SPDX-License-Identifier: Apache-2.0
#include "core/decimal.h"

#include <math.h>
#include <stdbool.h>
#include <string.h>

#include "core/error.h"
#include "core/invariant.h"

// 10^decimals; also exact as a double (up to 10^22).
static int64_t power_of_ten(int decimals) {
    INVARIANT(decimals >= 0 && decimals <= DECIMAL_MAX_DECIMALS);
    int64_t power = 1;
    for (int i = 0; i < decimals; i++) {
        power *= 10;
    }
    return power;
}

static bool is_digit(char c) {
    return c >= '0' && c <= '9';
}

// Reads the digits from `begin` to `length` around the point at `point`; false: anything else is
// there, or a leading zero. A value above DECIMAL_MAX is not exact.
static bool read_digits(const char *text, size_t begin, size_t point, size_t length,
                        int64_t *value) {
    if (text[begin] == '0' && point > begin + 1) {
        return false;
    }
    *value = 0;
    for (size_t i = begin; i < length; i++) {
        if (i == point ? text[i] != '.' : !is_digit(text[i])) {
            return false;
        }
        if (i != point && *value <= DECIMAL_MAX) {
            *value = 10 * *value + (text[i] - '0');
        }
    }
    return true;
}

int decimal_parse(const char *text, size_t length, int decimals, int64_t *scaled) {
    INVARIANT(decimals >= 0 && decimals <= DECIMAL_MAX_DECIMALS);
    const bool negative = length > 0 && text[0] == '-';
    const size_t begin = negative ? 1 : 0;
    // Characters of the fraction and its point.
    const size_t fraction = decimals > 0 ? (size_t)decimals + 1 : 0;
    if (length < begin + 1 + fraction) {
        return ERROR_SYNTAX;
    }
    const size_t point = length - fraction;  // end of the whole part
    int64_t value;
    if (!read_digits(text, begin, point, length, &value)) {
        return ERROR_SYNTAX;
    }
    if (value > DECIMAL_MAX) {
        return ERROR_RANGE;
    }
    if (negative && value == 0) {
        return ERROR_SYNTAX;  // "-0" would be a second spelling of 0
    }
    *scaled = negative ? -value : value;
    return ERROR_OK;
}

size_t decimal_print(int64_t scaled, int decimals, char text[DECIMAL_TEXT_BYTES]) {
    INVARIANT(scaled >= -DECIMAL_MAX && scaled <= DECIMAL_MAX);
    INVARIANT(decimals >= 0 && decimals <= DECIMAL_MAX_DECIMALS);
    char reversed[DECIMAL_TEXT_BYTES];
    size_t count = 0;
    int64_t rest = scaled < 0 ? -scaled : scaled;
    for (int digit = 0; rest > 0 || digit <= decimals; digit++) {
        if (decimals > 0 && digit == decimals) {
            reversed[count++] = '.';
        }
        reversed[count++] = (char)('0' + rest % 10);
        rest /= 10;
    }
    if (scaled < 0) {
        reversed[count++] = '-';
    }
    INVARIANT(count < DECIMAL_TEXT_BYTES);
    for (size_t i = 0; i < count; i++) {
        text[i] = reversed[count - 1 - i];
    }
    text[count] = '\0';
    return count;
}

double decimal_to_double(int64_t scaled, int decimals) {
    INVARIANT(scaled >= -DECIMAL_MAX && scaled <= DECIMAL_MAX);
    return (double)scaled / (double)power_of_ten(decimals);
}

int decimal_from_double(double value, int decimals, int64_t *scaled) {
    const double product = value * (double)power_of_ten(decimals);
    // Written so that a NaN fails too.
    if (!(product >= -(double)DECIMAL_MAX && product <= (double)DECIMAL_MAX)) {
        return ERROR_RANGE;
    }
    *scaled = (int64_t)(product < 0 ? product - 0.5 : product + 0.5);
    return ERROR_OK;
}

size_t decimal_print_integer(int64_t value, char text[DECIMAL_TEXT_BYTES]) {
    INVARIANT(text != NULL);
    char reversed[DECIMAL_TEXT_BYTES];
    size_t count = 0, length = 0;
    uint64_t rest = value < 0 ? 0 - (uint64_t)value : (uint64_t)value;
    do {
        reversed[count++] = (char)('0' + rest % 10);
        rest /= 10;
    } while (rest > 0);
    if (value < 0) {
        text[length++] = '-';
    }
    while (count > 0) {
        text[length++] = reversed[--count];
    }
    INVARIANT(length < DECIMAL_TEXT_BYTES);
    text[length] = '\0';
    return length;
}

size_t decimal_print_double(double value, int decimals, char text[DECIMAL_TEXT_BYTES]) {
    INVARIANT(decimals >= 0 && decimals <= DECIMAL_MAX_DECIMALS);
    const double whole_max = 9223372036854775807.0;
    int64_t scaled = 0;
    while (decimals >= 0 && decimal_from_double(value, decimals, &scaled) != ERROR_OK) {
        decimals--;
    }
    if (decimals >= 0) {
        return decimal_print(scaled, decimals, text);
    }
    if (value > -whole_max && value < whole_max) {
        return decimal_print_integer((int64_t)value, text);
    }
    const char *word = value < 0 ? "-inf" : "inf";
    if (isnan(value)) {
        word = "nan";
    }
    strcpy(text, word);
    return strlen(word);
}
