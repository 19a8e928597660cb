// SPDX-License-Identifier: Apache-2.0
/// Rows of sums and extremes over small windows, for the sub-pixel fit: two pixels of 16 bits in a
/// register, both multipliers on a pair. Rows begin at words of memory and have an even number of
/// elements.
#ifndef VERGENCE_STEREO_BFIN_WINDOWS_H
#define VERGENCE_STEREO_BFIN_WINDOWS_H

#include "stereo/bfin/pairs.h"

/// Both masks as one word: 0 where no bit is set, -1 where all are.
static inline int32_t pair_word(pair16 pair) {
    return (int32_t)pair;
}

static inline pair16 pair_turn(pair16 pair) {
    return pair_between(pair, pair);
}

/// a - b within 16 bits.
static inline pair16 pair_less(pair16 a, pair16 b) {
    pair16 result;
    __asm__("%0 = %1 -|- %2 (S);" : "=d"(result) : "d"(a), "d"(b));
    return result;
}

/// a b / 2^15, cut off.
static inline pair16 pair_fraction(pair16 a, pair16 b) {
    pair16 result;
    __asm__("%0.H = %1.H * %2.H, %0.L = %1.L * %2.L (T);" : "=d"(result) : "d"(a), "d"(b));
    return result;
}

/// a b / 2^15, rounded; half of one goes up.
static inline pair16 pair_rounded_fraction(pair16 a, pair16 b) {
    pair16 result;
    __asm__(
        "A1 = %3.H * %3.H, A0 = %3.L * %3.L;\n"
        "%0.H = (A1 += %1.H * %2.H), %0.L = (A0 += %1.L * %2.L) (T);"
        : "=d"(result)
        : "d"(a), "d"(b), "d"(pair_of(128))
        : "A0", "A1");
    return result;
}

#define PAIR_SHIFT(name, operator)                                                           \
    __attribute__((always_inline)) static inline pair16 name(pair16 value, const int bits) { \
        pair16 result;                                                                       \
        __asm__("%0 = %1 " operator" %2 (V);" : "=d"(result) : "d"(value), "i"(bits));       \
        return result;                                                                       \
    }
PAIR_SHIFT(pair_up, "<<")
PAIR_SHIFT(pair_down, ">>>")
PAIR_SHIFT(pair_down_unsigned, ">>")

#define WINDOWS_LOOP "LC0", "LT0", "LB0", "memory"

enum { WINDOW_PRODUCTS = 4 };  // of a window, one after the other

/// The largest and least values of five rows, and their sums.
static inline void windows_reduce(const uint16_t *const row[5], uint16_t *high, uint16_t *low,
                                  uint16_t *sum, int columns) {
    const uint16_t *a = row[0], *b = row[1], *c = row[2], *d = row[3], *e = row[4];
    __asm__ volatile(
        "R0 = [%[a]++];\n"
        "LSETUP (1f, 2f) LC0 = %[words];\n"
        "1: R1 = [%[b]++];\n"
        "R2 = MAX(R0, R1) (V) || R4 = [%[c]++];\n"
        "R3 = MIN(R0, R1) (V) || R5 = [%[d]++];\n"
        "R1 = R0 +|+ R1 || R0 = [%[e]++];\n"
        "R2 = MAX(R2, R4) (V);\n"
        "R3 = MIN(R3, R4) (V);\n"
        "R1 = R1 +|+ R4;\n"
        "R2 = MAX(R2, R5) (V);\n"
        "R3 = MIN(R3, R5) (V);\n"
        "R1 = R1 +|+ R5;\n"
        "R2 = MAX(R2, R0) (V);\n"
        "R3 = MIN(R3, R0) (V) || [%[high]++] = R2;\n"
        "R1 = R1 +|+ R0 || [%[low]++] = R3 || R0 = [%[a]++];\n"
        "2: [%[sum]++] = R1;\n"
        : [a] "+b"(a), [b] "+b"(b), [c] "+b"(c), [d] "+b"(d), [e] "+a"(e), [high] "+a"(high),
          [low] "+a"(low), [sum] "+a"(sum)
        : [words] "a"(columns / 2)
        : "R0", "R1", "R2", "R3", "R4", "R5", WINDOWS_LOOP);
}

/// The least values of five rows.
static inline void windows_least(const uint16_t *const row[5], uint16_t *low, int columns) {
    const uint16_t *a = row[0], *b = row[1], *c = row[2], *d = row[3], *e = row[4];
    __asm__ volatile(
        "R0 = [%[a]++];\n R1 = [%[b]++];\n"
        "LSETUP (1f, 2f) LC0 = %[words];\n"
        "1: R0 = MIN(R0, R1) (V) || R1 = [%[c]++];\n"
        "R0 = MIN(R0, R1) (V) || R1 = [%[d]++];\n"
        "R0 = MIN(R0, R1) (V) || R2 = [%[e]++] || R1 = [%[b]++];\n"
        "R2 = MIN(R0, R2) (V) || R0 = [%[a]++];\n"
        "2: [%[low]++] = R2;\n"
        : [a] "+b"(a), [b] "+b"(b), [c] "+b"(c), [d] "+b"(d), [e] "+a"(e), [low] "+a"(low)
        : [words] "a"(columns / 2)
        : "R0", "R1", "R2", WINDOWS_LOOP);
}

// Two columns: their sums in R2 and R3 exchange the products of an arriving and a leaving row, and
// R7 is the sum of five columns.
#define WINDOWS_PRODUCTS(arriving, leaving)                                          \
    "LSETUP (1f, 2f) LC0;\n"                                                         \
    "1: A0 = R2 || R2 = [%[out_a]++];\n" arriving                                    \
    "A1 += R0.H * R1.H, A0 += R0.L * R1.L (IS) || R4 = [%[last]++];\n" leaving       \
    "R3 = (A1 -= R2.H * R3.H), R2 = (A0 -= R2.L * R3.L) (IS) || R0 = [%[in_a]++];\n" \
    "R4 = R2 - R4 (NS) || [%[column]++] = R2;\n"                                     \
    "R7 = R7 + R4 (NS) || [%[column]++] = R3;\n"                                     \
    "R4 = [%[last]++];\n"                                                            \
    "[%[window]++%[step]] = R7;\n"                                                   \
    "R4 = R3 - R4 (NS) || R2 = [%[here]++];\n"                                       \
    "R7 = R7 + R4 (NS);\n"                                                           \
    "[%[window]++%[step]] = R7;\n"                                                   \
    "2: R3 = [%[here]++];\n"
#define WINDOWS_CLOBBERED "R1", "R2", "R3", "R4", "R7", "A0", "A1", WINDOWS_LOOP

/// Sums of products along the columns, where a row arrives and one leaves, and of five columns:
/// element WINDOW_PRODUCTS x of `window` is the sum of columns x - 4 to x.
static inline void windows_products(const int16_t *in_a, const int16_t *in_b, const int16_t *out_a,
                                    const int16_t *out_b, int32_t *column, int32_t *window,
                                    int columns) {
    const int32_t *here = column, *last = column - 5;
    int pairs = columns / 2;
    __asm__ volatile(
        "LC0 = R0;\n R7 = 0;\n R0 = [%[in_a]++];\n R2 = [%[here]++];\n R3 = [%[here]++];\n"  //
        WINDOWS_PRODUCTS("A1 = R3 || R1 = [%[in_b]++] || R3 = [%[out_b]++];\n", "")
        : [in_a] "+b"(in_a), [in_b] "+b"(in_b), [out_a] "+b"(out_a), [out_b] "+b"(out_b),
          [here] "+a"(here), [last] "+a"(last), [column] "+a"(column), [window] "+a"(window),
          "+q0"(pairs)
        : [step] "a"(WINDOW_PRODUCTS * sizeof *window)
        : WINDOWS_CLOBBERED);
}

/// The same of products with the value to the left in the same row.
static inline void windows_neighbours(const int16_t *in, const int16_t *out, int32_t *column,
                                      int32_t *window, int columns) {
    const int32_t *here = column, *last = column - 5;
    int pairs = columns / 2;
    __asm__ volatile(
        "LC0 = R0;\n R5 = 0;\n R6 = 0;\n R7 = 0;\n"
        "R0 = [%[in_a]++];\n R2 = [%[here]++];\n R3 = [%[here]++];\n"  //
        WINDOWS_PRODUCTS("A1 = R3;\n R1 = PACK(R0.L, R5.H);\n R5 = R0;\n",
                         "R3 = PACK(R2.L, R6.H);\n R6 = R2;\n")
        : [in_a] "+b"(in), [out_a] "+b"(out), [here] "+a"(here), [last] "+a"(last),
          [column] "+a"(column), [window] "+a"(window), "+q0"(pairs)
        : [step] "a"(WINDOW_PRODUCTS * sizeof *window)
        : "R5", "R6", WINDOWS_CLOBBERED);
}

/// The same of the rows' values themselves: element x of `window` is the sum of columns x - 2 to
/// x + 2.
static inline void windows_values(const int16_t *in, const int16_t *out, int16_t *column,
                                  int16_t *window, int columns) {
    const int16_t *here = column;
    __asm__ volatile(
        "R0 = 0;\n R1 = 0;\n R2 = [%[here]++];\n R3 = [%[in]++];\n R4 = [%[out]++];\n"
        "R1 = R2 +|+ R3 || R2 = [%[here]++] || R3 = [%[in]++];\n"
        "R1 = R1 -|- R4 || R4 = [%[out]++];\n"
        "[%[column]++] = R1;\n"
        "LSETUP (1f, 2f) LC0 = %[pairs];\n"
        "1: R2 = R2 +|+ R3 || R3 = [%[in]++];\n"
        "R2 = R2 -|- R4 || R4 = [%[out]++];\n"
        "R5 = PACK(R1.L, R0.H) || [%[column]++] = R2;\n"
        "R0 = R0 +|+ R1;\n"
        "R0 = R0 +|+ R5;\n"
        "R5 = PACK(R2.L, R1.H);\n"
        "R0 = R0 +|+ R2;\n"
        "R5 = R0 +|+ R5;\n"
        "R0 = R1;\n"
        "R1 = PACK(R2.H, R2.L) || [%[window]++] = R5;\n"
        "2: R2 = [%[here]++];\n"
        : [in] "+b"(in), [out] "+b"(out), [here] "+a"(here), [column] "+a"(column),
          [window] "+a"(window)
        : [pairs] "a"(columns / 2)
        : "R0", "R1", "R2", "R3", "R4", "R5", WINDOWS_LOOP);
}

/// Of two pixels: opposite neighbours in their windows of five rows that both differ from the
/// middle by `most` at most, and of these the sums of 2 middle - neighbours and of its amount.
struct windows_agreement {
    pair16 pairs, sum, rough;
};

// Neighbours R0 and R1. R7: middle + most + INT16_MIN, so that those differences that agree are the
// lowest ones, below R6; R5: 2 most; R4: -pairs; R3: sum of amounts.
#define WINDOWS_AGREE(above, below)                          \
    "R0 = R7 -|- R0;\n R1 = R7 -|- R1;\n"                    \
    "R2 = R0 +|+ R1;\n"                                      \
    "R0 = MAX(R0, R1) (V);\n"                                \
    "R0 = R0 -|- R6 (S) || R1 = [%[" above                   \
    ";\n"                                                    \
    "R0 = R0 >>> 15 (V);\n"                                  \
    "A1 -= R2.H * R0.H, A0 -= R2.L * R0.L (IS);\n"           \
    "R2 = R2 -|- R5;\n R4 = R4 +|+ R0;\n R2 = ABS R2 (V);\n" \
    "R2 = R2 & R0;\n"                                        \
    "R3 = R3 +|+ R2 || R0 = [%[" below ";\n"
// To the words before those that were loaded.
#define WINDOWS_BETWEEN(above, below) \
    "R2 = [%[" above                  \
    ";\n R1 = PACK(R1.L, R2.H);\n"    \
    "R2 = [%[" below ";\n R0 = PACK(R0.L, R2.H);\n"
#define WINDOWS_ROWS(above, below, next_above, next_below) \
    WINDOWS_AGREE(above "] + 4]", below "] + 8]")          \
    WINDOWS_BETWEEN(above "]]", below "] + 4]")            \
    WINDOWS_AGREE(above "] + 4]", below "] + 4]")          \
    WINDOWS_AGREE(above "] + 8]", below "] + 4]")          \
    WINDOWS_BETWEEN(above "] + 4]", below "]]")            \
    WINDOWS_AGREE(above "] + 8]", below "]]") WINDOWS_AGREE(next_above "]]", next_below "] + 8]")

/// `row` begins at the word before the pixels; most < 2^13.
static inline struct windows_agreement windows_agree(const uint16_t *const row[5], pair16 middle,
                                                     int most) {
    pair16 top = middle + pair_of(INT16_MIN + most), pairs = pair_of(0);
    pair16 limit = pair_of(INT16_MIN + 2 * most + 1), bias = pair_of(2 * most), rough = pair_of(0);
    pair16 sum;
    __asm__(
        "A1 = A0 = 0;\n"
        "R0 = [%[c] + 8];\n R1 = [%[c]];\n"                                    //
        WINDOWS_AGREE("c] + 4]", "c] + 8]") WINDOWS_BETWEEN("c]]", "c] + 4]")  //
        WINDOWS_AGREE("b]]", "d] + 8]") WINDOWS_ROWS("b", "d", "a", "e")       //
        WINDOWS_ROWS("a", "e", "a", "e")                                       //
        "%[sum] = PACK(R0.L, R0.L);\n"
        "R0 = A0.W;\n R1 = A1.W;\n %[sum] = PACK(R1.L, R0.L);\n"
        : [sum] "=d"(sum), "+q7"(top), "+q6"(limit), "+q5"(bias), "+q4"(pairs), "+q3"(rough)
        : [a] "a"(row[0]), [b] "a"(row[1]), [c] "a"(row[2]), [d] "a"(row[3]), [e] "a"(row[4])
        : "R0", "R1", "A0", "A1", "memory");
    return (struct windows_agreement){pair_of(0) - pairs, sum, rough};
}

// bits of R5 = R4 / denominator, as quotient_exact() has it; R2 and R6 are used.
#define WINDOWS_DIVIDE(numerator, denominator, bits, mask)                               \
    "R2.L = SIGNBITS " denominator                                                       \
    ";\n"                                                                                \
    "R5 = LSHIFT " numerator                                                             \
    " BY R2.L;\n"                                                                        \
    "R6 = LSHIFT " denominator                                                           \
    " BY R2.L;\n"                                                                        \
    "R5 >>= 2;\n R6 >>= 17;\n DIVS(R5, R6);\n"                                           \
    ".rept " bits                                                                        \
    "\n DIVQ(R5, R6);\n .endr\n"                                                         \
    "R2 = " mask ";\n R5 = R5 & R2;\n" numerator " <<= " bits                            \
    " - 1;\n"                                                                            \
    "R6 = R5;\n R6 *= " denominator ";\n" numerator " = " numerator " - R6;\n" numerator \
    " >>>= 31;\n R5 = R5 + " numerator ";\n"

/// Moves what `present` has to where the windows fit best, as solve_row() in subpixel_fit.h does:
/// their counts, sums and products. A count below 5 moves nothing. Of the products the first two
/// become the windows' centred gradient^2 and variance.
static inline void windows_solve(const int16_t *count, const int16_t *gradient,
                                 const int16_t *difference, int32_t *products,
                                 const uint16_t *present, uint16_t *next, int columns) {
    int32_t product;
    __asm__ volatile(
        "LC0 = R0;\n R7 = 0;\n LSETUP (1f, 2f) LC0;\n"
        "1: R0 = 5;\n"
        "R7.L = W[%[count]++];\n R5.L = W[%[gradient]++];\n R6.L = W[%[difference]++];\n"
        "CC = R7 < R0;\n R0 = [%[products]];\n"
        "R2 = [%[products] + 4];\n R3 = [%[products] + 8];\n R4 = [%[products] + 12];\n"
        "IF CC JUMP 3f;\n"
        // R0: gradient^2, R2: product, R3: difference^2 and covariance, of the centred values.
        "R0 *= R7;\n R2 *= R7;\n R3 *= R7;\n R4 *= R7;\n"
        "R1 = R5.L * R5.L (IS);\n R0 = R0 - R1;\n"
        "R1 = R5.L * R6.L (IS);\n R2 = R2 - R1;\n"
        "R1 = R6.L * R6.L (IS);\n R3 = R3 - R1;\n R4 = R4 - R1;\n"
        "R1 = 0;\n R4 = MAX(R4, R1);\n R3 = R3 + R4;\n"
        "%[product] = R2;\n R1 = ABS R2;\n"
        // R5: the best shift; without a gradient there is no product.
        "R4 = R0 >>> 5;\n R4 = R4 + R1;\n R2 = R0 << 1;\n R2 += -1;\n R4 = MIN(R4, R2);\n"  //
        WINDOWS_DIVIDE("R4", "R0", "5", "31")
        "R4 = R1 >>> 3;\n R4 *= R5;\n"
        "R2 = R0;\n R2 += 31;\n R2 >>>= 5;\n"
        "R6 = R5.L * R5.L (IS);\n R2 *= R6;\n R2 >>>= 3;\n"
        "R4 = R4 - R2;\n R2 = 0;\n R4 = MAX(R4, R2);\n R3 = R3 - R4;\n"
        // R3: noise.
        "R2 = 43;\n R4 = R7.L * R2.L (IS);\n R6 = R7;\n R6 += -2;\n"
        "R4 = R4.L * R6.L (IS);\n R4 >>>= 4;\n R3 = MAX(R3, R4);\n"
        "[%[products]] = R0;\n [%[products] + 4] = R3;\n"
        // R0: stiffness, R1: pull.
        "R0 *= R6;\n R0 >>>= 4;\n R0 = R0 + R3;\n R0 >>>= 1;\n"
        "R1 >>>= 1;\n R1 *= R6;\n R1 >>>= 3;\n"
        "R4 = R1 >>> 1;\n CC = R4 < R0;\n"  //
        WINDOWS_DIVIDE("R1", "R0", "7", "127")
        "R4 = 0;\n IF !CC R5 = R4;\n"
        "R4 = -R5;\n R6 = %[product];\n CC = R6 < 0;\n IF CC R5 = R4;\n"
        "R4.L = W[%[present]++];\n"
        "R4 = R4 + R5;\n"
        "4: W[%[next]++] = R4;\n"
        "2: %[products] += 16;\n"
        "JUMP 5f;\n"
        "3: R4.L = W[%[present]++];\n JUMP 4b;\n"
        "5:\n"
        : [count] "+b"(count), [gradient] "+b"(gradient), [difference] "+b"(difference),
          [present] "+b"(present), [products] "+a"(products), [next] "+a"(next),
          [product] "=&a"(product), "+q0"(columns)
        :
        : "R1", "R2", "R3", "R4", "R5", "R6", "R7", "CC", WINDOWS_LOOP);
}

#endif
