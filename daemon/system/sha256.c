// SPDX-License-Identifier: Apache-2.0
#include "daemon/system/sha256.h"

#include <string.h>

enum { BLOCK_BYTES = 64, ROUNDS = 64, WORDS = 8, LENGTH_BYTES = 8 };

/// Fractions of the cube roots of the first 64 primes.
static const uint32_t constants[ROUNDS] = {
    0x428a2f98, 0x71374491, 0xb5c0fbcf, 0xe9b5dba5, 0x3956c25b, 0x59f111f1, 0x923f82a4, 0xab1c5ed5,
    0xd807aa98, 0x12835b01, 0x243185be, 0x550c7dc3, 0x72be5d74, 0x80deb1fe, 0x9bdc06a7, 0xc19bf174,
    0xe49b69c1, 0xefbe4786, 0x0fc19dc6, 0x240ca1cc, 0x2de92c6f, 0x4a7484aa, 0x5cb0a9dc, 0x76f988da,
    0x983e5152, 0xa831c66d, 0xb00327c8, 0xbf597fc7, 0xc6e00bf3, 0xd5a79147, 0x06ca6351, 0x14292967,
    0x27b70a85, 0x2e1b2138, 0x4d2c6dfc, 0x53380d13, 0x650a7354, 0x766a0abb, 0x81c2c92e, 0x92722c85,
    0xa2bfe8a1, 0xa81a664b, 0xc24b8b70, 0xc76c51a3, 0xd192e819, 0xd6990624, 0xf40e3585, 0x106aa070,
    0x19a4c116, 0x1e376c08, 0x2748774c, 0x34b0bcb5, 0x391c0cb3, 0x4ed8aa4a, 0x5b9cca4f, 0x682e6ff3,
    0x748f82ee, 0x78a5636f, 0x84c87814, 0x8cc70208, 0x90befffa, 0xa4506ceb, 0xbef9a3f7, 0xc67178f2};

static uint32_t rotate(uint32_t word, unsigned bits) {
    return word >> bits | word << (32 - bits);
}

static uint32_t read_word(const uint8_t *at) {
    return (uint32_t)at[0] << 24 | (uint32_t)at[1] << 16 | (uint32_t)at[2] << 8 | at[3];
}

/// The message schedule of a block (6.2.2, step 1).
static void expand(const uint8_t block[BLOCK_BYTES], uint32_t schedule[ROUNDS]) {
    for (size_t i = 0; i < 16; i++) {
        schedule[i] = read_word(block + 4 * i);
    }
    for (size_t i = 16; i < ROUNDS; i++) {
        const uint32_t a = schedule[i - 15], b = schedule[i - 2];
        schedule[i] = schedule[i - 16] + (rotate(a, 7) ^ rotate(a, 18) ^ a >> 3) + schedule[i - 7] +
                      (rotate(b, 17) ^ rotate(b, 19) ^ b >> 10);
    }
}

/// Adds a block to the hash (steps 2 to 4).
static void add_block(uint32_t hash[WORDS], const uint8_t block[BLOCK_BYTES]) {
    uint32_t schedule[ROUNDS], v[WORDS];
    expand(block, schedule);
    memcpy(v, hash, sizeof v);
    for (size_t i = 0; i < ROUNDS; i++) {
        const uint32_t a = v[0], e = v[4];
        const uint32_t first = v[7] + (rotate(e, 6) ^ rotate(e, 11) ^ rotate(e, 25)) +
                               ((e & v[5]) ^ (~e & v[6])) + constants[i] + schedule[i];
        const uint32_t second = (rotate(a, 2) ^ rotate(a, 13) ^ rotate(a, 22)) +
                                ((a & v[1]) ^ (a & v[2]) ^ (v[1] & v[2]));
        memmove(v + 1, v, (WORDS - 1) * sizeof v[0]);
        v[4] += first;
        v[0] = first + second;
    }
    for (size_t i = 0; i < WORDS; i++) {
        hash[i] += v[i];
    }
}

void sha256(const void *data, size_t bytes, uint8_t sum[SHA256_BYTES]) {
    uint32_t hash[WORDS] = {0x6a09e667, 0xbb67ae85, 0x3c6ef372, 0xa54ff53a,
                            0x510e527f, 0x9b05688c, 0x1f83d9ab, 0x5be0cd19};
    const uint8_t *at = data;
    uint8_t last[2 * BLOCK_BYTES] = {0};
    const size_t rest = bytes % BLOCK_BYTES;
    for (size_t done = 0; done + BLOCK_BYTES <= bytes; done += BLOCK_BYTES) {
        add_block(hash, at + done);
    }
    if (rest > 0) {
        memcpy(last, at + bytes - rest, rest);
    }
    last[rest] = 0x80;
    const size_t padded = rest + 1 + LENGTH_BYTES <= BLOCK_BYTES ? BLOCK_BYTES : sizeof last;
    for (size_t i = 0; i < LENGTH_BYTES; i++) {
        last[padded - 1 - i] = (uint8_t)((uint64_t)bytes * 8 >> 8 * i);
    }
    for (size_t done = 0; done < padded; done += BLOCK_BYTES) {
        add_block(hash, last + done);
    }
    for (size_t i = 0; i < SHA256_BYTES; i++) {
        sum[i] = (uint8_t)(hash[i / 4] >> (24 - 8 * (i % 4)));
    }
}
