// SPDX-License-Identifier: Apache-2.0
/// Numbers with a fixed count of decimals: an integer `scaled` means scaled / 10^decimals. Each
/// number has exactly one spelling, so that reading and printing are inverse:
///     -?(0|[1-9][0-9]*)(.[0-9]{decimals})     no "-0", no "+", no leading zeros, no exponent.
/// With |scaled| <= DECIMAL_MAX the conversion to double and back is exact on every target:
/// quotient and product each have a relative error of 2^-53, together under 2^50 * 2^-52 = 1/4 of a
/// unit, so that rounding returns the same integer.
#ifndef VERGENCE_CORE_DECIMAL_H
#define VERGENCE_CORE_DECIMAL_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#define DECIMAL_MAX (INT64_C(1) << 50)

enum {
    DECIMAL_MAX_DECIMALS = 15,
    DECIMAL_TEXT_BYTES = 24,  // sign, 16 digits, "0.", the zero, and some spare
};

/// Parses all of `length` bytes as one number in its canonical spelling. ERROR_SYNTAX for any other
/// spelling, ERROR_RANGE beyond DECIMAL_MAX; `scaled` is then unchanged. `decimals` is
/// 0..DECIMAL_MAX_DECIMALS.
int decimal_parse(const char *text, size_t length, int decimals, int64_t *scaled);

/// Writes the canonical spelling, zero-terminated; returns its length without the zero.
/// |scaled| <= DECIMAL_MAX.
size_t decimal_print(int64_t scaled, int decimals, char text[DECIMAL_TEXT_BYTES]);

/// Writes any integer likewise.
size_t decimal_print_integer(int64_t value, char text[DECIMAL_TEXT_BYTES]);

/// Writes the nearest number with this many decimals, with fewer if it is large, or "inf", "-inf"
/// (beyond 2^63, too) and "nan"; returns the length. `decimals` is 0..DECIMAL_MAX_DECIMALS.
size_t decimal_print_double(double value, int decimals, char text[DECIMAL_TEXT_BYTES]);

/// The double nearest to scaled / 10^decimals. |scaled| <= DECIMAL_MAX.
double decimal_to_double(int64_t scaled, int decimals);

/// The nearest number with this many decimals. ERROR_RANGE for a NaN or beyond DECIMAL_MAX;
/// `scaled` is then unchanged.
int decimal_from_double(double value, int decimals, int64_t *scaled);

#ifdef __cplusplus
}
#endif

#endif
