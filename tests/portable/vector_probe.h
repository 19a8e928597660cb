// SPDX-License-Identifier: Apache-2.0
/// Every operation of match_vector_*.h on given bytes, one level at a time, for comparison with
/// plain C.
#ifndef VERGENCE_PORTABLE_VECTOR_PROBE_H
#define VERGENCE_PORTABLE_VECTOR_PROBE_H

#include <stdint.h>

#include "stereo/match/match_state.h"

enum {
    PROBE_PIXELS = 4,  // a multiple of every level's VECTOR_MEMBERS
    PROBE_FEATURES = MATCH_CENSUS_PLANES + 1,
};

enum probe_operation {
    PROBE_LOAD,
    PROBE_EACH,
    PROBE_ALL,
    PROBE_MIN,
    PROBE_ADD,
    PROBE_SUB,
    PROBE_OR,
    PROBE_UP,
    PROBE_DOWN,
    PROBE_BLEND,
    PROBE_LOWEST,
    PROBE_COST,
    PROBE_FIRST,  // in byte 0
    PROBE_EQUAL,  // in bytes 0 and 1, the low one first
    PROBE_OPERATIONS
};

typedef uint8_t probe_lanes[PROBE_PIXELS][MATCH_LANES];

struct probe_input {
    probe_lanes a, b;
    probe_lanes left[PROBE_FEATURES], right[PROBE_FEATURES];
    match_share share[PROBE_PIXELS];
};

struct probe_output {
    probe_lanes of[PROBE_OPERATIONS];
};

/// One level; the processor must support it.
struct vector_probe {
    const char *name;
    void (*run)(const struct probe_input *in, struct probe_output *out);
};

extern const struct vector_probe vector_probe_plain;
#if defined(__x86_64__)
extern const struct vector_probe vector_probe_sse41;
extern const struct vector_probe vector_probe_avx2;
#endif
#if defined(__ARM_NEON)
extern const struct vector_probe vector_probe_neon;
#endif

#endif
