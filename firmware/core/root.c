// SPDX-License-Identifier: Apache-2.0
#include "core/root.h"

#include "core/invariant.h"

// Newton's iteration for the inverse square root, r <- r (3 - m r^2) / 2, from the straight line
// that is off by 8.6 % at most: four steps square the error down to 1e-14.
int64_t root_inverse_q30(int64_t m_q30) {
    INVARIANT(m_q30 >= (int64_t)1 << 30 && m_q30 < (int64_t)1 << 32);
    int64_t r_q30 = 1145023540 - ((m_q30 * 163574791) >> 30);
    for (int step = 0; step < 4; step++) {
        const int64_t square_q30 = (r_q30 * r_q30) >> 30;
        const int64_t product_q30 = (m_q30 * square_q30) >> 30;
        r_q30 = (r_q30 * (((int64_t)3 << 30) - product_q30)) >> 31;
    }
    return r_q30;
}

int64_t root_normalise(int64_t value, int *shift) {
    INVARIANT(value > 0 && value < (int64_t)1 << 62);
    const int zeros = __builtin_clzll((unsigned long long)value);
    *shift = zeros - 32 - (zeros & 1);
    return *shift >= 0 ? value << *shift : value >> -*shift;
}

int64_t root_of(int64_t value) {
    if (value == 0) {
        return 0;
    }
    int shift;
    const int64_t m = root_normalise(value, &shift);
    // sqrt(m 2^-shift) = (m / sqrt(m 2^-30)) 2^-15 2^-(shift / 2)
    const int64_t root_q30 = (m * (root_inverse_q30(m) >> 2)) >> 28;
    return root_q30 >> (15 + shift / 2);
}
