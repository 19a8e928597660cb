// SPDX-License-Identifier: Apache-2.0
/// Coordinates and blends of rectification, with both multipliers. For stereo/geometry, which has
/// the same for all processors.
#ifndef VERGENCE_STEREO_BFIN_WARP_H
#define VERGENCE_STEREO_BFIN_WARP_H

#include <stdint.h>

/// to[m] = first + (m rise + 8 + (factor[m] bends >> 10)) / 16 for m < count, where a product of
/// pairs is the sum of those of their halves.
static inline void warp_line(int32_t first, int32_t rise, uint32_t bends, const uint32_t *factor,
                             int32_t *to, int count) {
    int32_t moved = 8, at;
    uint32_t factors;
    __asm__ volatile(
        "LSETUP (1f, 2f) LC0 = %[count];\n"
        "%[factors] = [%[factor]++];\n"
        "1: A0 = %[factors].L * %[bends].L (IS);\n"
        "%[at] = (A0 += %[factors].H * %[bends].H) (IS) || %[factors] = [%[factor]++];\n"
        "%[at] >>>= 10;\n"
        "%[at] = %[at] + %[moved];\n"
        "%[at] >>>= 4;\n"
        "%[at] = %[at] + %[first];\n"
        "%[moved] = %[moved] + %[rise] (NS) || [%[to]++] = %[at];\n"
        "2: NOP;\n"
        : [factor] "+b"(factor), [to] "+a"(to), [factors] "=&d"(factors), [at] "=&D"(at),
          [moved] "+d"(moved)
        : [first] "d"(first), [rise] "d"(rise), [bends] "d"(bends), [count] "a"(count)
        : "A0", "LC0", "LT0", "LB0", "memory");
}

/// Images of the same pixels, one byte and three bytes each, in rows of `stride` and three times as
/// many bytes.
struct warp_images {
    const uint8_t *grey, *colour;
    int stride;
};

// R0 * weights R6 of a row and the one below it, whose mean with the weight R7 of the latter is
// written. R5 rounds.
#define WARP_BLEND(first, second, last, to)                                    \
    "R0 = B[P0" first "] (Z);\n R2 = B[P1" first                               \
    "] (Z);\n R0 = PACK(R2.L, R0.L);\n"                                        \
    "R1 = B[P0" second "] (Z);\n R2 = B[P1" second                             \
    "] (Z);\n R1 = PACK(R2.L, R1.L);\n"                                        \
    "A1 = R0.H * R6.L, A0 = R0.L * R6.L (IS);\n"                               \
    "R3 = (A1 += R1.H * R6.H), R2 = (A0 += R1.L * R6.H) (IS);\n"               \
    "R3 = R3 - R2;\n R3 *= R7;\n R2 <<= 11;\n R3 = R3 + R2;\n R3 = R3 + R5;\n" \
    "R3 >>= 22;\n" last "B[" to "++] = R3;\n"

/// Blends `count` pixels at coordinates whose four neighbours are in both images.
static inline void warp_row(const struct warp_images *images, const int32_t *x_q16,
                            const int32_t *y_q16, uint8_t *grey, uint8_t *colour, int count) {
    const uint32_t half = 1 << 21;
    uint32_t offset;
    // P0 and P1: the pixel's address in the image and below it.
    __asm__ volatile(
        "LSETUP (1f, 2f) LC0 = %[count];\n"
        "1: R7 = [%[y]++];\n R6 = [%[x]++];\n"
        "R0 = R7 >>> 16;\n R1 = R6 >>> 16;\n"
        "R3 = %[stride];\n R2 = R0.L * R3.L (IS);\n R2 = R2 + R1;\n %[offset] = R2;\n"
        "P0 = %[grey_base];\n P0 = P0 + %[offset];\n P1 = R3;\n P1 = P0 + P1;\n"
        "R7 = R7.L (Z);\n R7 += 16;\n R7 >>= 5;\n"
        "R6 = R6.L (Z);\n R6 += 16;\n R6 >>= 5;\n"
        "R3 = 2048;\n R3 = R3 - R6;\n R6 = PACK(R6.L, R3.L);\n"  //
        WARP_BLEND("", " + 1", "", "%[grey]")
        "%[offset] = %[offset] + (%[offset] << 1);\n"
        "P0 = %[colour_base];\n P0 = P0 + %[offset];\n P1 = %[colour_stride];\n P1 = P0 + P1;\n"
        WARP_BLEND("", " + 3", "", "%[colour]") WARP_BLEND(" + 1", " + 4", "", "%[colour]")
        WARP_BLEND(" + 2", " + 5", "2: ", "%[colour]")
        : [x] "+b"(x_q16), [y] "+b"(y_q16), [grey] "+a"(grey), [colour] "+a"(colour),
          [offset] "=&a"(offset)
        : [count] "a"(count), [grey_base] "x"(images->grey), [colour_base] "x"(images->colour),
          [stride] "x"(images->stride), [colour_stride] "x"(3 * images->stride), "q5"(half)
        : "R0", "R1", "R2", "R3", "R6", "R7", "P0", "P1", "A0", "A1", "LC0", "LT0", "LB0",
          "memory");
}

#endif
