// SPDX-License-Identifier: Apache-2.0
#include "core/crc.h"

#include "core/invariant.h"

// Remainders of four bits: small enough for the cache of a microcontroller, and fast enough for a
// text file.
static const uint32_t remainder_of_nibble[16] = {
    0x00000000, 0x1db71064, 0x3b6e20c8, 0x26d930ac, 0x76dc4190, 0x6b6b51f4, 0x4db26158, 0x5005713c,
    0xedb88320, 0xf00f9344, 0xd6d6a3e8, 0xcb61b38c, 0x9b64c2b0, 0x86d3d2d4, 0xa00ae278, 0xbdbdf21c,
};

uint32_t crc_update(uint32_t crc, const void *data, size_t length) {
    INVARIANT(data != NULL || length == 0);
    const unsigned char *bytes = data;
    uint32_t state = ~crc;
    for (size_t i = 0; i < length; i++) {
        state ^= bytes[i];
        state = (state >> 4) ^ remainder_of_nibble[state & 15u];
        state = (state >> 4) ^ remainder_of_nibble[state & 15u];
    }
    return ~state;
}
