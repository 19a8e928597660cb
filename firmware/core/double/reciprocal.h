// SPDX-License-Identifier: Apache-2.0
/// Exact quotients of several numbers by the same one, for a processor without an instruction for
/// divisions, where one of 64 bits takes more than a thousand cycles.
#ifndef VERGENCE_CORE_DOUBLE_RECIPROCAL_H
#define VERGENCE_CORE_DOUBLE_RECIPROCAL_H

#include <stdint.h>

#include "core/double/halves.h"

/// The divisor shifted up until its highest bit is set, and 2^64 / that, rounded down, without
/// its highest bit.
struct reciprocal {
    uint32_t scaled, inverse, shift;
};

/// Of a divisor that is not 0. Newton's iteration from a straight line that is off by 1/17 at most:
/// three steps square the error down to 2^-32. It stays below the true one, of which a few units
/// are missing then.
INLINE struct reciprocal reciprocal_of(uint32_t divisor) {
    const uint32_t shift = zeros32(divisor), scaled = divisor << shift;
    // 48/17 - 32/17 d of d in [1/2, 1), in 31 binary places, as the reciprocals that follow.
    uint32_t r_q31 = (uint32_t)(((uint64_t)48 << 31) / 17) - 1 - product_high(scaled, 4042322161u);
    for (int step = 0; step < 3; step++) {
        const uint32_t rest_q31 = ~product_high(scaled, r_q31);  // 2 - d r
        r_q31 = product_high(r_q31, rest_q31) << 1;
    }
    uint32_t inverse = r_q31 >> 31 != 0 ? r_q31 << 1 : 0;
    // 2^64 - 1 - (2^32 + inverse) scaled, in two halves.
    uint32_t high = ~product_high(inverse, scaled) - scaled, low = ~(inverse * scaled);
    while (high != 0 || low >= scaled) {
        inverse++;
        high -= low < scaled;
        low -= scaled;
    }
    return (struct reciprocal){scaled, inverse, shift};
}

/// value / divisor, rounded down; it has to be below 2^32. See Möller and Granlund, Improved
/// division by invariant integers (2011), algorithm 4.
INLINE uint32_t reciprocal_quotient(uint64_t value, const struct reciprocal *divisor) {
    const uint32_t shift = divisor->shift, low = low_half(value) << shift;
    const uint32_t high = high_half(value) << shift | low_half(value) >> 1 >> (31 - shift);
    const uint32_t fraction = divisor->inverse * high + low;
    uint32_t quotient = product_high(divisor->inverse, high) + high + (fraction < low) + 1;
    uint32_t rest = low - quotient * divisor->scaled;
    if (rest > fraction) {
        quotient--;
        rest += divisor->scaled;
    }
    return quotient + (rest >= divisor->scaled);
}

#endif
