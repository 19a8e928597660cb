// SPDX-License-Identifier: Apache-2.0
/// Two values of 16 bits in a register of the Blackfin, which adds, compares and shifts both at
/// once.
#ifndef VERGENCE_STEREO_BFIN_PAIRS_H
#define VERGENCE_STEREO_BFIN_PAIRS_H

#include <stddef.h>
#include <stdint.h>

/// The first value of a row is in the lower half.
typedef int16_t pair16 __attribute__((vector_size(4), may_alias));

static inline pair16 pair_of(int value) {
    return (pair16){(int16_t)value, (int16_t)value};
}

/// Elements x and x + 1 of a row, for an even x.
static inline pair16 pair_load(const void *row, ptrdiff_t x) {
    return *(const pair16 *)((const int16_t *)row + x);
}

static inline void pair_store(void *row, ptrdiff_t x, pair16 value) {
    *(pair16 *)((int16_t *)row + x) = value;
}

/// The last value of `before` and the first one of `after`.
static inline pair16 pair_between(pair16 before, pair16 after) {
    pair16 result;
    __asm__("%0 = PACK(%1.L, %2.H);" : "=d"(result) : "d"(after), "d"(before));
    return result;
}

/// |value|, at most 32767.
static inline pair16 pair_abs(pair16 value) {
    pair16 result;
    __asm__("%0 = ABS %1 (V);" : "=d"(result) : "d"(value));
    return result;
}

static inline pair16 pair_max(pair16 a, pair16 b) {
    pair16 result;
    __asm__("%0 = MAX(%1, %2) (V);" : "=d"(result) : "d"(a), "d"(b));
    return result;
}

static inline pair16 pair_min(pair16 a, pair16 b) {
    pair16 result;
    __asm__("%0 = MIN(%1, %2) (V);" : "=d"(result) : "d"(a), "d"(b));
    return result;
}

/// -1 where negative, else 0.
static inline pair16 pair_sign(pair16 value) {
    pair16 result;
    __asm__("%0 = %1 >>> 15 (V);" : "=d"(result) : "d"(value));
    return result;
}

static inline pair16 pair_halve(pair16 value) {
    pair16 result;
    __asm__("%0 = %1 >>> 1 (V);" : "=d"(result) : "d"(value));
    return result;
}

/// The product of two numbers of 16 bits, in one cycle; the compiler takes three for 32 bits.
static inline int32_t product_16(int32_t a, int32_t b) {
    int32_t result;
    __asm__("%0 = %1.L * %2.L (IS);" : "=d"(result) : "d"(a), "d"(b));
    return result;
}

/// Whole quotients below 2^bits; neither may exceed 15 bits.
static inline pair16 pair_divide(pair16 numerator, pair16 denominator, const int bits) {
    pair16 part = denominator, quotient = pair_of(0);
    for (int i = 1; i < bits; i++) {
        part = part + part;
    }
    for (int i = 0; i < bits; i++) {
        const pair16 less = numerator - part;
        const pair16 missing = pair_sign(less);
        numerator = less + (part & missing);
        quotient = quotient + quotient - ~missing;
        part = pair_halve(part);
    }
    return quotient;
}

#endif
