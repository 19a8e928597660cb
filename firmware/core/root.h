// SPDX-License-Identifier: Apache-2.0
/// Square roots of integers by multiplication only: per-pixel code has no floating point, and
/// divisions would be too slow.
#ifndef VERGENCE_CORE_ROOT_H
#define VERGENCE_CORE_ROOT_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/// 2^30 / sqrt(m), m = m_q30 / 2^30 in [1, 4); relative error below 2^-27.
uint32_t root_inverse_q30(uint32_t m_q30);

/// Brings a value in [1, 2^62) to [2^30, 2^32) by an even shift, -32 <= shift <= 30:
/// value = result 2^-shift, cut off where shift is negative.
uint32_t root_normalise(int64_t value, int *shift);

/// Square root of a value in [0, 2^62), relative error below 2^-27, then cut off.
int64_t root_of(int64_t value);

#ifdef __cplusplus
}
#endif

#endif
