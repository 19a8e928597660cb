// SPDX-License-Identifier: Apache-2.0
/// Quotients of few bits: the Blackfin has steps of a division, and the compiler's function for a
/// whole one takes hundreds of cycles.
#ifndef VERGENCE_STEREO_BFIN_QUOTIENT_H
#define VERGENCE_STEREO_BFIN_QUOTIENT_H

#include <stdint.h>

#define QUOTIENT_STEP "DIVQ(%0, %1);\n"

/// The first seven binary places of numerator / denominator, 0 <= numerator <= denominator < 2^14.
static inline uint32_t quotient_7_places(uint32_t numerator, uint32_t denominator) {
    uint32_t rest = numerator << 16;
    __asm__("DIVS(%0, %1);\n" QUOTIENT_STEP QUOTIENT_STEP QUOTIENT_STEP QUOTIENT_STEP QUOTIENT_STEP
                QUOTIENT_STEP QUOTIENT_STEP
            : "+d"(rest)
            : "d"(denominator)
            : "CC");
    return rest & 0x7f;
}

/// The whole quotient, below 2^9, of numbers below 2^14; the denominator is below 2^5.
static inline uint32_t quotient_9_bits(uint32_t numerator, uint32_t denominator) {
    uint32_t rest = numerator << 16;
    __asm__("DIVS(%0, %1);\n" QUOTIENT_STEP QUOTIENT_STEP QUOTIENT_STEP QUOTIENT_STEP QUOTIENT_STEP
                QUOTIENT_STEP QUOTIENT_STEP QUOTIENT_STEP QUOTIENT_STEP
            : "+d"(rest)
            : "d"(denominator << 9)
            : "CC");
    return rest & 0x1ff;
}

/// At most 12 bits of numerator / denominator, the first one that of 1: numerator < 2 denominator <
/// 2^31. It divides by 14 bits of the denominator, and is exact: a quotient that is too large is
/// seen from the rest. From 11 bits on, numerator < 3/2 denominator.
__attribute__((always_inline)) static inline uint32_t quotient_exact(uint32_t numerator,
                                                                     uint32_t denominator,
                                                                     const int bits) {
    int spare;
    __asm__("%0.L = SIGNBITS %1;\n" : "=d"(spare) : "d"(denominator));
    spare = (int16_t)spare;
    uint32_t rest = numerator << spare >> 2;
    __asm__("DIVS(%0, %1);\n.rept %2\nDIVQ(%0, %1);\n.endr"
            : "+d"(rest)
            : "d"(denominator << spare >> 17), "i"(bits)
            : "CC");
    const uint32_t quotient = rest & ((1u << bits) - 1);
    return quotient - (((numerator << (bits - 1)) - quotient * denominator) >> 31);
}

/// numerator / denominator, below 256; the denominator is below 2^14.
static inline uint32_t quotient_8_bits(uint32_t numerator, uint32_t denominator) {
    uint32_t rest = numerator << 8;
    __asm__("DIVS(%0, %1);\n" QUOTIENT_STEP QUOTIENT_STEP QUOTIENT_STEP QUOTIENT_STEP QUOTIENT_STEP
                QUOTIENT_STEP QUOTIENT_STEP QUOTIENT_STEP
            : "+d"(rest)
            : "d"(denominator)
            : "CC");
    return rest & 0xff;
}

#endif
