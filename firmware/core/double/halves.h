// SPDX-License-Identifier: Apache-2.0
/// 64-bit integers in two halves, for a 32-bit processor: the compiler calls functions for shifts
/// by a variable number and for products.
#ifndef VERGENCE_CORE_DOUBLE_HALVES_H
#define VERGENCE_CORE_DOUBLE_HALVES_H

#include <stdint.h>

#define INLINE __attribute__((always_inline)) static inline

INLINE uint32_t high_half(uint64_t x) {
    return (uint32_t)(x >> 32);
}

INLINE uint32_t low_half(uint64_t x) {
    return (uint32_t)x;
}

INLINE uint64_t join(uint32_t high, uint32_t low) {
    return (uint64_t)high << 32 | low;
}

// Shifts by less than 64 bits.
INLINE uint64_t shift_left(uint64_t x, uint32_t bits) {
    const uint32_t high = high_half(x), low = low_half(x);
    return bits >= 32 ? join(low << (bits - 32), 0)
                      : join(high << bits | low >> 1 >> (31 - bits), low << bits);
}

INLINE uint64_t shift_right(uint64_t x, uint32_t bits) {
    const uint32_t high = high_half(x), low = low_half(x);
    return bits >= 32 ? high >> (bits - 32)
                      : join(high >> bits, low >> bits | high << 1 << (31 - bits));
}

// Bit 0 also says whether a 1 was shifted out; bits may be any number.
INLINE uint64_t shift_right_sticky(uint64_t x, uint32_t bits) {
    const uint32_t high = high_half(x), low = low_half(x);
    if (bits < 32) {
        const uint32_t lost = low << 1 << (31 - bits);
        return join(high >> bits, low >> bits | high << 1 << (31 - bits) | (lost != 0));
    }
    if (bits < 64) {
        const uint32_t lost = high << 1 << (63 - bits) | low;
        return high >> (bits - 32) | (lost != 0);
    }
    return x != 0;
}

INLINE uint32_t zeros32(uint32_t x) {
#ifdef __bfin__
    return (x >> 31) != 0 ? 0 : (uint32_t)__builtin_bfin_norm_fr1x32((int)x) + 1;
#else
    return (uint32_t)__builtin_clz(x);
#endif
}

INLINE uint32_t leading_zeros(uint64_t x) {
    const uint32_t high = high_half(x);
    return high != 0 ? zeros32(high) : 32 + zeros32(low_half(x));
}

// The upper half of a product of 128 bits; `rest` receives the next 32, and whether the last are 0
// in its bit 0.
INLINE uint64_t product_128(uint64_t x, uint64_t y, uint32_t *rest) {
    const uint32_t xh = high_half(x), xl = low_half(x);
    const uint32_t yh = high_half(y), yl = low_half(y);
#ifdef __bfin__  // digits of 16 bits, summed by columns
    uint32_t top, next, last, digit;
    __asm__(
        "a1 = %h5 * %h7 (fu); %2 = a1.w; a1 = a1 >> 16;\n\t"
        "a1 += %h5 * %d7 (fu); a1 += %d5 * %h7 (fu); %3 = a1.w; a1 = a1 >> 16;\n\t"
        "%2 = pack(%h3, %h2);\n\t"
        "a1 += %h5 * %h6 (fu); a1 += %d5 * %d7 (fu); a1 += %h4 * %h7 (fu);\n\t"
        "%1 = a1.w; a1 = a1 >> 16;\n\t"
        "a1 += %h5 * %d6 (fu); a1 += %d5 * %h6 (fu); a1 += %h4 * %d7 (fu);\n\t"
        "a1 += %d4 * %h7 (fu); %3 = a1.w; a1 = a1 >> 16;\n\t"
        "cc = %2 == 0; %2 = pack(%h3, %h1); %3 = cc; bittgl(%3, 0); %2 = %2 | %3;\n\t"
        "a1 += %d5 * %d6 (fu); a1 += %h4 * %h6 (fu); a1 += %d4 * %d7 (fu);\n\t"
        "%1 = a1.w; a1 = a1 >> 16;\n\t"
        "a1 += %h4 * %d6 (fu); a1 += %d4 * %h6 (fu); %3 = a1.w; a1 = a1 >> 16;\n\t"
        "%1 = pack(%h3, %h1); a1 += %d4 * %d6 (fu); %0 = a1.w;"
        : "=&d"(top), "=&d"(next), "=&d"(last), "=&d"(digit)
        : "d"(xh), "d"(xl), "d"(yh), "d"(yl)
        : "A1", "CC");
    *rest = last;
    return join(top, next);
#else
    const uint64_t high = (uint64_t)xh * yh, low = (uint64_t)xl * yl;
    const uint64_t cross = (uint64_t)xh * yl, other = (uint64_t)xl * yh;
    const uint64_t middle = (low >> 32) + low_half(cross) + low_half(other);
    *rest = low_half(middle) | (low_half(low) != 0);
    return high + (cross >> 32) + (other >> 32) + (middle >> 32);
#endif
}

// The upper half of a product.
INLINE uint32_t product_high(uint32_t x, uint32_t y) {
#ifdef __bfin__
    uint32_t high;
    __asm__(
        "a1 = %h1 * %h2 (fu); a1 = a1 >> 16;\n\t"
        "a1 += %h1 * %d2 (fu); a1 += %d1 * %h2 (fu); a1 = a1 >> 16;\n\t"
        "a1 += %d1 * %d2 (fu); %0 = a1.w;"
        : "=d"(high)
        : "d"(x), "d"(y)
        : "A1");
    return high;
#else
    return (uint32_t)(((uint64_t)x * y) >> 32);
#endif
}

INLINE int32_t product_high_signed(int32_t x, int32_t y) {
#ifdef __bfin__
    int32_t high;
    __asm__(
        "a1 = %h1 * %h2 (fu); a1 = a1 >> 16;\n\t"
        "a1 += %d1 * %h2 (m), a0 = %d1 * %d2 (is);\n\t"
        "a1 += %d2 * %h1 (m, is); a1 = a1 >>> 16;\n\t"
        "%0 = (a0 += a1);"
        : "=d"(high)
        : "d"(x), "d"(y)
        : "A0", "A1");
    return high;
#else
    return (int32_t)(((int64_t)x * y) >> 32);
#endif
}

INLINE int64_t product_signed(int32_t x, int32_t y) {
#ifdef __bfin__
    return (int64_t)join((uint32_t)product_high_signed(x, y), (uint32_t)x * (uint32_t)y);
#else
    return (int64_t)x * y;
#endif
}

// x y / 2^bits, rounded down, as long as that fits into 32 bits.
INLINE int32_t product_scaled(int32_t x, int32_t y, int bits) {
    const int32_t high = product_high_signed(x, y);
    if (bits >= 32) {
        return high >> (bits - 32);
    }
    return (int32_t)((uint32_t)high << (32 - bits) | ((uint32_t)x * (uint32_t)y) >> bits);
}

#endif
