// SPDX-License-Identifier: Apache-2.0
// The vector operations of every level supported by this processor, compared with those of plain C.
#ifndef VERGENCE_PORTABLE_DIGEST_VECTORS_H
#define VERGENCE_PORTABLE_DIGEST_VECTORS_H

#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "digest_numbers.h"
#include "stereo/match/match_kernels.h"
#include "vector_probe.h"

static const char *const probe_operation_names[PROBE_OPERATIONS] = {
    [PROBE_LOAD] = "load or store",
    [PROBE_EACH] = "each",
    [PROBE_ALL] = "all",
    [PROBE_MIN] = "min",
    [PROBE_ADD] = "add",
    [PROBE_SUB] = "sub",
    [PROBE_OR] = "or",
    [PROBE_UP] = "up",
    [PROBE_DOWN] = "down",
    [PROBE_BLEND] = "blend",
    [PROBE_LOWEST] = "lowest",
    [PROBE_COST] = "cost",
    [PROBE_FIRST] = "first",
    [PROBE_EQUAL] = "equal",
};

static const struct vector_probe *const faster_probes[] = {
#if defined(__x86_64__)
    &vector_probe_sse41,
    &vector_probe_avx2,
#endif
#if defined(__ARM_NEON)
    &vector_probe_neon,
#endif
    NULL,
};

// Any byte, or often one at which sums, differences and signs change.
static uint8_t random_byte(void) {
    static const uint8_t turning[] = {0, 1, 2, 17, 18, 19, 126, 127, 128, 129, 253, 254, 255};
    const uint64_t bits = next_random() >> 32;
    return bits % 4 == 0 ? turning[(bits >> 8) % sizeof turning] : (uint8_t)(bits >> 8 & 0xff);
}

static void random_lanes(probe_lanes *lanes) {
    for (int i = 0; i < PROBE_PIXELS * MATCH_LANES; i++) {
        (*lanes)[i / MATCH_LANES][i % MATCH_LANES] = random_byte();
    }
}

static void random_probe_input(struct probe_input *in) {
    random_lanes(&in->a);
    random_lanes(&in->b);
    for (int i = 0; i < PROBE_FEATURES; i++) {
        random_lanes(&in->left[i]);
        random_lanes(&in->right[i]);
    }
    const uint64_t alike = next_random() >> 62;  // 0: one lane in eight, 3: most
    for (int pixel = 0; pixel < PROBE_PIXELS; pixel++) {
        in->share[pixel] = match_share_of((uint16_t)(1 + (next_random() >> 32) % 127));
        for (int i = 0; i < MATCH_LANES; i++) {
            if ((next_random() >> 61) <= 2 * alike) {
                in->b[pixel][i] = in->a[pixel][i];
            }
        }
    }
}

static void must_be_same(const char *level, const struct probe_output *plain,
                         const struct probe_output *other) {
    for (int i = 0; i < PROBE_OPERATIONS; i++) {
        if (memcmp(plain->of[i], other->of[i], sizeof plain->of[i]) != 0) {
            fprintf(stderr, "core_digest: vectors: %s of %s differs from plain\n",
                    probe_operation_names[i], level);
            exit(1);
        }
    }
}

static uint32_t digest_vectors(void) {
    enum { ROUNDS = 2000 };
    static struct probe_input in;
    static struct probe_output plain, other;
    uint32_t crc = 0;
    for (int i = 0; i < ROUNDS; i++) {
        random_probe_input(&in);
        vector_probe_plain.run(&in, &plain);
        crc = crc_update(crc, plain.of, sizeof plain.of);
        for (size_t k = 0; faster_probes[k] != NULL; k++) {
            if (match_kernels_named(faster_probes[k]->name) != NULL) {
                faster_probes[k]->run(&in, &other);
                must_be_same(faster_probes[k]->name, &plain, &other);
            }
        }
    }
    return crc;
}

#endif
