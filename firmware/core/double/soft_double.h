// SPDX-License-Identifier: Apache-2.0
/// IEEE 754 double arithmetic in 32-bit integers, for the compiler's calls on a processor without
/// floating point: round to nearest even, subnormals, infinities, one quiet NaN. Numbers are passed
/// as their bits. The compiler's own functions take two to four times as long on a BF537, and round
/// subnormal products twice.
#ifndef VERGENCE_CORE_DOUBLE_SOFT_DOUBLE_H
#define VERGENCE_CORE_DOUBLE_SOFT_DOUBLE_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

uint64_t soft_double_add(uint64_t a, uint64_t b);
uint64_t soft_double_subtract(uint64_t a, uint64_t b);
uint64_t soft_double_multiply(uint64_t a, uint64_t b);
uint64_t soft_double_divide(uint64_t a, uint64_t b);

/// -1, 0, 1 as a < b, a = b, a > b; `less` returns 1 if one of them is a NaN, `greater` -1.
int soft_double_less(uint64_t a, uint64_t b);
int soft_double_greater(uint64_t a, uint64_t b);
/// 1 if one of them is a NaN, else 0.
int soft_double_unordered(uint64_t a, uint64_t b);

uint64_t soft_double_from_int64(int64_t x);
uint64_t soft_double_from_uint64(uint64_t x);
/// Towards 0; what does not fit 64 bits gives 0.
int64_t soft_double_to_int64(uint64_t x);
uint64_t soft_double_magnitude(uint64_t x);

#ifdef __cplusplus
}
#endif

#endif
