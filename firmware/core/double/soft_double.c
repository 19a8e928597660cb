// SPDX-License-Identifier: Apache-2.0
#include "core/double/soft_double.h"

#include <stdbool.h>

#include "core/double/halves.h"

static const uint32_t SIGN = 0x80000000u, INFINITE = 0x7ff00000u;  // of a high half
static const uint64_t NOT_A_NUMBER = 0x7ff8000000000000u;

#define RARE __attribute__((noinline, cold)) static  // so that the rest needs few registers

INLINE bool is_nan(uint64_t x) {
    const uint32_t magnitude = high_half(x) & ~SIGN;
    return magnitude > INFINITE || (magnitude == INFINITE && low_half(x) != 0);
}

// A finite number other than 0: its significand, with the top bit set, and its exponent.
struct open {
    uint64_t significand;
    int32_t exponent;
};

INLINE struct open open_normal(uint64_t x) {
    const uint32_t high = high_half(x), low = low_half(x);
    struct open open;
    open.significand = join(SIGN | high << 11 | low >> 21, low << 11);
    open.exponent = (int32_t)(high << 1 >> 21);
    return open;
}

INLINE struct open open_any(uint64_t x) {
    const uint64_t fraction = x & 0x7fffffffffffffffu;
    if (fraction >> 52 != 0) {
        return open_normal(x);
    }
    const uint32_t zeros = leading_zeros(fraction);
    struct open open;
    open.significand = shift_left(fraction, zeros);
    open.exponent = 12 - (int32_t)zeros;
    return open;
}

// Rounds the lowest 11 bits of a significand whose top bit is set. The implicit bit counts the
// exponent one up, and a carry out of the fraction once more.
INLINE uint64_t round_to_double(uint32_t sign, int32_t exponent, uint64_t significand) {
    const uint32_t high = high_half(significand), low = low_half(significand);
    uint32_t top = (sign | (uint32_t)(exponent - 1) << 20) + (high >> 11);
    uint32_t bottom = high << 21 | low >> 11;
    const uint32_t rest = low << 21;
    if (rest > SIGN || (rest == SIGN && (bottom & 1u) != 0)) {
        bottom++;
        top += bottom == 0;
    }
    return join(top, bottom);
}

RARE uint64_t close_extreme(uint32_t sign, int32_t exponent, uint64_t significand) {
    if (exponent >= 0x7ff) {
        return join(sign | INFINITE, 0);
    }
    return round_to_double(sign, 1, shift_right_sticky(significand, (uint32_t)(1 - exponent)));
}

INLINE uint64_t close(uint32_t sign, int32_t exponent, uint64_t significand) {
    return (uint32_t)exponent - 1u < 0x7feu ? round_to_double(sign, exponent, significand)
                                            : close_extreme(sign, exponent, significand);
}

// Whether a number is not a normal one.
INLINE bool is_special(uint64_t x) {
    return ((high_half(x) << 1) + 0x00200000u) < 0x00400000u;
}

INLINE bool is_zero(uint64_t x) {
    return (high_half(x) << 1 | low_half(x)) == 0;
}

INLINE bool is_infinite(uint64_t x) {
    return high_half(x) << 1 == INFINITE << 1 && low_half(x) == 0;
}

INLINE uint32_t sign_of_product(uint64_t a, uint64_t b) {
    return (high_half(a) ^ high_half(b)) & SIGN;
}

INLINE uint64_t multiply_open(uint32_t sign, struct open x, struct open y) {
    uint32_t rest;
    uint64_t product = product_128(x.significand, y.significand, &rest);
    int32_t exponent = x.exponent + y.exponent - 1022;
    if ((high_half(product) & SIGN) == 0) {
        product = product << 1 | rest >> 31;
        rest <<= 1;
        exponent--;
    }
    return close(sign, exponent, product | (rest != 0));
}

RARE uint64_t multiply_special(uint64_t a, uint64_t b) {
    const uint32_t sign = sign_of_product(a, b);
    const bool infinite = is_infinite(a) || is_infinite(b);
    const bool zero = is_zero(a) || is_zero(b);
    if (is_nan(a) || is_nan(b) || (infinite && zero)) {
        return NOT_A_NUMBER;
    }
    if (infinite || zero) {
        return join(sign | (infinite ? INFINITE : 0), 0);
    }
    return multiply_open(sign, open_any(a), open_any(b));
}

uint64_t soft_double_multiply(uint64_t a, uint64_t b) {
    if (is_special(a) || is_special(b)) {
        return multiply_special(a, b);
    }
    return multiply_open(sign_of_product(a, b), open_normal(a), open_normal(b));
}

// 2^63 / divisor, less by at most a few units; the divisor's top bit is set.
INLINE uint32_t reciprocal_of(uint32_t divisor) {
    // Newton's method from below, with x = divisor / 2^32: 1 / x >= sqrt(8) - 2 x.
    uint32_t found = 0x6a09e667u - divisor;
    for (int step = 0; step < 4; step++) {
        const uint32_t missing = 0x7fffffffu - product_high(found, divisor);
        found += product_high(found, missing << 1);
    }
    return found - 3;
}

// The next 28 bits of a quotient, remainder < divisor < 2^61; the remainder is replaced.
INLINE uint32_t next_digit(uint64_t *remainder, uint64_t divisor, uint32_t reciprocal) {
    const uint32_t divisor_high = high_half(divisor), divisor_low = low_half(divisor);
    uint32_t digit = product_high((uint32_t)(*remainder >> 29), reciprocal) >> 3;
    const uint64_t product =
        join(product_high(digit, divisor_low) + digit * divisor_high, digit * divisor_low);
    uint64_t rest = (*remainder << 28) - product;
    while (rest >= divisor) {
        rest -= divisor;
        digit++;
    }
    *remainder = rest;
    return digit;
}

INLINE uint64_t divide_open(uint32_t sign, struct open x, struct open y) {
    const bool whole = x.significand >= y.significand;
    uint64_t remainder = shift_right(x.significand, whole ? 4 : 3);
    const uint64_t divisor = shift_right(y.significand, 3);
    const uint32_t reciprocal = reciprocal_of(high_half(y.significand));
    const uint32_t first = next_digit(&remainder, divisor, reciprocal);
    const uint32_t second = next_digit(&remainder, divisor, reciprocal);
    const uint64_t quotient = join(first << 4 | second >> 24, second << 8);
    return close(sign, x.exponent - y.exponent + 1022 + whole, quotient | (remainder != 0));
}

RARE uint64_t divide_special(uint64_t a, uint64_t b) {
    const uint32_t sign = sign_of_product(a, b);
    const bool infinite = is_infinite(a), zero = is_zero(a);
    if (is_nan(a) || is_nan(b) || (infinite && is_infinite(b)) || (zero && is_zero(b))) {
        return NOT_A_NUMBER;
    }
    if (infinite || is_zero(b)) {
        return join(sign | INFINITE, 0);
    }
    if (zero || is_infinite(b)) {
        return join(sign, 0);
    }
    return divide_open(sign, open_any(a), open_any(b));
}

uint64_t soft_double_divide(uint64_t a, uint64_t b) {
    if (is_special(a) || is_special(b)) {
        return divide_special(a, b);
    }
    return divide_open(sign_of_product(a, b), open_normal(a), open_normal(b));
}

// The sum of a number and one that is not larger, `opposite` with another sign.
INLINE uint64_t add_open(uint32_t sign, bool opposite, struct open x, struct open y) {
    const uint64_t large = shift_right(x.significand, 1);
    const uint64_t small =
        shift_right_sticky(shift_right(y.significand, 1), (uint32_t)(x.exponent - y.exponent));
    if (!opposite) {
        const uint64_t sum = large + small;
        return (high_half(sum) & SIGN) != 0 ? close(sign, x.exponent + 1, sum)
                                            : close(sign, x.exponent, sum << 1);
    }
    const uint64_t rest = large - small;
    if (rest == 0) {
        return 0;
    }
    const uint32_t zeros = leading_zeros(rest);
    return close(sign, x.exponent + 1 - (int32_t)zeros, shift_left(rest, zeros));
}

RARE uint64_t add_special(uint64_t large, uint64_t small) {
    const bool opposite = sign_of_product(large, small) != 0;
    if ((high_half(large) & INFINITE) == INFINITE) {
        return is_nan(large) || (opposite && is_infinite(small)) ? NOT_A_NUMBER : large;
    }
    if (is_zero(small)) {
        return is_zero(large) ? large & small : large;
    }
    return add_open(high_half(large) & SIGN, opposite, open_any(large), open_any(small));
}

uint64_t soft_double_add(uint64_t a, uint64_t b) {
    const uint32_t ah = high_half(a) << 1, bh = high_half(b) << 1;
    const bool swapped = ah != bh ? ah < bh : low_half(a) < low_half(b);
    const uint64_t large = swapped ? b : a, small = swapped ? a : b;
    if (is_special(large) || is_special(small)) {
        return add_special(large, small);
    }
    return add_open(high_half(large) & SIGN, sign_of_product(a, b) != 0, open_normal(large),
                    open_normal(small));
}

RARE int compare_special(uint64_t a, uint64_t b, int unordered) {
    if (is_nan(a) || is_nan(b)) {
        return unordered;
    }
    if (is_zero(a) && is_zero(b)) {
        return 0;
    }
    // The order of two's complement numbers.
    const int64_t x = a >> 63 != 0 ? (int64_t)(0x8000000000000000u - a) : (int64_t)a;
    const int64_t y = b >> 63 != 0 ? (int64_t)(0x8000000000000000u - b) : (int64_t)b;
    return x < y ? -1 : x > y;
}

// -1, 0, 1 as a < b, a = b, a > b; `unordered` if one of them is a NaN.
INLINE int compare(uint64_t a, uint64_t b, int unordered) {
    if (is_special(a) || is_special(b)) {
        return compare_special(a, b, unordered);
    }
    const int32_t ah = (int32_t)high_half(a), bh = (int32_t)high_half(b);
    if ((ah ^ bh) < 0) {
        return ah < 0 ? -1 : 1;
    }
    const int further = ah < 0 ? -1 : 1;
    if (ah != bh) {
        return ah < bh ? -further : further;
    }
    const uint32_t al = low_half(a), bl = low_half(b);
    return al == bl ? 0 : al < bl ? -further : further;
}

INLINE uint64_t from_magnitude(uint32_t sign, uint64_t magnitude) {
    if (magnitude == 0) {
        return 0;
    }
    const uint32_t zeros = leading_zeros(magnitude);
    const uint64_t shifted = shift_left(magnitude, zeros);
    return close(sign, 1086 - (int32_t)zeros, shifted);
}

uint64_t soft_double_from_int64(int64_t x) {
    return x < 0 ? from_magnitude(SIGN, 0 - (uint64_t)x) : from_magnitude(0, (uint64_t)x);
}

uint64_t soft_double_magnitude(uint64_t x) {
    const int32_t exponent = (int32_t)(high_half(x) << 1 >> 21) - 1023;
    if (exponent < 0 || exponent > 63) {
        return 0;
    }
    return shift_right(open_normal(x).significand, (uint32_t)(63 - exponent));
}

int64_t soft_double_to_int64(uint64_t x) {
    const uint64_t magnitude = soft_double_magnitude(x);
    return (int64_t)((high_half(x) & SIGN) != 0 ? 0 - magnitude : magnitude);
}

uint64_t soft_double_subtract(uint64_t a, uint64_t b) {
    return soft_double_add(a, b ^ (uint64_t)SIGN << 32);
}

int soft_double_less(uint64_t a, uint64_t b) {
    return compare(a, b, 1);
}

int soft_double_greater(uint64_t a, uint64_t b) {
    return compare(a, b, -1);
}

int soft_double_unordered(uint64_t a, uint64_t b) {
    return is_nan(a) || is_nan(b);
}

uint64_t soft_double_from_uint64(uint64_t x) {
    return from_magnitude(0, x);
}

#ifdef __bfin__  // the compiler's names; it passes doubles in the registers of integers
#pragma GCC diagnostic ignored "-Wmissing-prototypes"
#pragma GCC diagnostic ignored "-Wbuiltin-declaration-mismatch"
#define CALL(name) __attribute__((alias("soft_double_" name)))
uint64_t __adddf3(uint64_t a, uint64_t b) CALL("add");
uint64_t __subdf3(uint64_t a, uint64_t b) CALL("subtract");
uint64_t __muldf3(uint64_t a, uint64_t b) CALL("multiply");
uint64_t __divdf3(uint64_t a, uint64_t b) CALL("divide");
int __eqdf2(uint64_t a, uint64_t b) CALL("less");
int __nedf2(uint64_t a, uint64_t b) CALL("less");
int __ltdf2(uint64_t a, uint64_t b) CALL("less");
int __ledf2(uint64_t a, uint64_t b) CALL("less");
int __gtdf2(uint64_t a, uint64_t b) CALL("greater");
int __gedf2(uint64_t a, uint64_t b) CALL("greater");
int __unorddf2(uint64_t a, uint64_t b) CALL("unordered");
uint64_t __floatdidf(int64_t x) CALL("from_int64");
uint64_t __floatundidf(uint64_t x) CALL("from_uint64");
int64_t __fixdfdi(uint64_t x) CALL("to_int64");
uint64_t __fixunsdfdi(uint64_t x) CALL("magnitude");

uint64_t __floatsidf(int x) {
    return soft_double_from_int64(x);
}

uint64_t __floatunsidf(unsigned x) {
    return from_magnitude(0, x);
}

int __fixdfsi(uint64_t x) {
    return (int)soft_double_to_int64(x);
}

unsigned __fixunsdfsi(uint64_t x) {
    return (unsigned)soft_double_magnitude(x);
}
#endif
