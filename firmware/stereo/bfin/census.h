// SPDX-License-Identifier: Apache-2.0
/// Comparisons of bytes on the Blackfin, four at a time: the mean of a byte and of the complement
/// of another one has its highest bit set where the first one is larger. For stereo/match.
#ifndef VERGENCE_STEREO_BFIN_CENSUS_H
#define VERGENCE_STEREO_BFIN_CENSUS_H

#include <stdint.h>

enum { CENSUS_MORE = 16 };

// R4: the comparisons of four bytes, whose load of the next ones is `loads`; into four of `bits`.
#define CENSUS_FOUR(order, next, loads)            \
    "R4 = BYTEOP1P(R1:0, R3:2) (T" order ")" loads \
    ";\n"                                          \
    "R4 = R4 & R6;\n"                              \
    "R5 = R7 >> 1 || R7 = [I2++];\n"               \
    "R5 = R5 | R4;\n" next " = ~" next ";\n"

/// Halves each byte of `bits`, whose lowest bit is 0, and sets its highest bit where a byte of
/// `pixel` is larger than one of `other`. `bits` begins at a multiple of four bytes; up to
/// CENSUS_MORE bytes beyond `count` are read, and of `bits` written.
static inline void census_compare(const uint8_t *pixel, const uint8_t *other, uint8_t *bits,
                                  int count) {
    __asm__ volatile(
        "I0 = %[pixel];\n I1 = %[other];\n I2 = %[bits];\n"
        "R6 = %[highest];\n"
        "DISALGNEXCPT || R0 = [I0++] || R2 = [I1++];\n"
        "DISALGNEXCPT || R1 = [I0++] || R3 = [I1++];\n"
        "R7 = [I2++];\n"
        "R2 = ~R2;\n"
        "R3 = ~R3;\n"
        "LSETUP (1f, 2f) LC0 = %[times];\n"
        "1:\n" CENSUS_FOUR("", "R2", "|| R0 = [I0++] || R2 = [I1++]")  //
        "[%[bits]++] = R5;\n" CENSUS_FOUR(", R", "R3",
                                          "|| R1 = [I0++] || R3 = [I1++]") "2: [%[bits]++] = R5;\n"
        : [bits] "+a"(bits)
        : [pixel] "a"(pixel), [other] "a"(other), [highest] "a"(0x80808080u),
          [times] "a"((count + 7) / 8)
        : "R0", "R1", "R2", "R3", "R4", "R5", "R6", "R7", "I0", "I1", "I2", "LC0", "LT0", "LB0",
          "CC", "memory");
}

#endif
