// SPDX-License-Identifier: Apache-2.0
// Checksums of numbers and fixed pseudo-random numbers, the same on every processor.
#ifndef VERGENCE_PORTABLE_DIGEST_NUMBERS_H
#define VERGENCE_PORTABLE_DIGEST_NUMBERS_H

#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/crc.h"

// Numbers are hashed byte by byte, lowest first, independent of the byte order.
static uint32_t add_bits(uint32_t crc, uint64_t bits, int bytes) {
    unsigned char text[8];
    for (int i = 0; i < bytes; i++) {
        text[i] = (unsigned char)(bits >> (8 * i));
    }
    return crc_update(crc, text, (size_t)bytes);
}

static uint32_t add_double(uint32_t crc, double value) {
    uint64_t bits;
    memcpy(&bits, &value, sizeof bits);
    return add_bits(crc, bits, 8);
}

static uint32_t add_doubles(uint32_t crc, const double *values, int count) {
    for (int i = 0; i < count; i++) {
        crc = add_double(crc, values[i]);
    }
    return crc;
}

// xorshift64*: G. Marsaglia, J. Stat. Softw. 8(14), 2003; S. Vigna, ACM TOMS 42(4), 2016.
static uint64_t random_state;

static uint64_t next_random(void) {
    random_state ^= random_state >> 12;
    random_state ^= random_state << 25;
    random_state ^= random_state >> 27;
    return random_state * 2685821657736338717u;
}

// Exact on every target: 53 random bits over a power of two.
static double uniform(double low, double high) {
    return low + (high - low) * ((double)(next_random() >> 11) / 9007199254740992.0);
}

// The short form, for processors of which only a simulator is at hand: fewer draws of everything.
static bool is_short;

static int draws(int all, int few) {
    return is_short ? few : all;
}

static void *must_have(size_t bytes) {
    void *memory = malloc(bytes);
    if (memory == NULL) {
        fputs("core_digest: out of memory\n", stderr);
        exit(1);
    }
    return memory;
}

#endif
