// SPDX-License-Identifier: Apache-2.0
/// Comparing signatures on the Blackfin, which counts the bits of a word in a cycle while it loads
/// two others. For stereo/match/paper.c, whose plain C gives the same results.
#ifndef VERGENCE_STEREO_BFIN_SIGNATURES_H
#define VERGENCE_STEREO_BFIN_SIGNATURES_H

#include <stdint.h>

static inline int signatures_differ(uint32_t left, uint32_t right) {
    return __builtin_bfin_ones((int)(left ^ right));
}

#define SIGNATURES_LOAD \
    " || %[left] = [%[left_at] ++ %[step]] || %[right] = [%[right_at] ++ %[step]]"

#define SIGNATURES_COUNT(more)                                      \
    "%[left] = %[left] ^ %[right];\n %[ones].L = ONES %[left]" more \
    ";\n %[sum] = %[sum] +|+ %[ones];\n"
#define SIGNATURES_TWO SIGNATURES_COUNT(SIGNATURES_LOAD) SIGNATURES_COUNT(SIGNATURES_LOAD)

/// The bits that differ in eight pairs, and above these 16 bits twice those of the first two pairs
/// or all, whichever are more.
static inline int signatures_ahead(const uint32_t *left_at, const uint32_t *right_at,
                                   int direction) {
    const int step = direction * (int)sizeof *left_at;
    uint32_t left, right, ones, sum, first;
    __asm__("%[ones] = %[ones] -|- %[ones]" SIGNATURES_LOAD ";\n %[sum] = %[ones];\n"  //
            SIGNATURES_TWO
            "%[first] = %[sum] +|+ %[sum];\n"               //
            SIGNATURES_TWO SIGNATURES_TWO                   //
            SIGNATURES_COUNT(SIGNATURES_LOAD) SIGNATURES_COUNT("")
            "%[first] = MAX(%[first], %[sum]) (V);\n"
            "%[sum] = PACK(%[first].L, %[sum].L);\n"
            : [left] "=&d"(left), [right] "=&d"(right), [ones] "=&d"(ones), [sum] "=&d"(sum),
              [first] "=&d"(first), [left_at] "+b"(left_at), [right_at] "+b"(right_at)
            : [step] "f"(step)
            : "memory");
    return (int)sum;
}

#endif
