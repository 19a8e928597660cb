// SPDX-License-Identifier: Apache-2.0
// Runs the operations of the level whose match_vector_*.h the file included before this one.
#ifndef VERGENCE_PORTABLE_VECTOR_PROBE_RUN_H
#define VERGENCE_PORTABLE_VECTOR_PROBE_RUN_H

#include "vector_probe.h"

// Loads and stores use pointers to this lane, so that offsets are negative and addresses odd.
enum { POINTED_LANE = 3 };

static struct vector get(const probe_lanes *lanes, int pixel) {
    const uint8_t *at[VECTOR_MEMBERS];
    for (int member = 0; member < VECTOR_MEMBERS; member++) {
        at[member] = &(*lanes)[pixel + member][POINTED_LANE];
    }
    return vector_load(at, -POINTED_LANE);
}

static void put(struct vector value, probe_lanes *lanes, int pixel) {
    uint8_t *at[VECTOR_MEMBERS];
    for (int member = 0; member < VECTOR_MEMBERS; member++) {
        at[member] = &(*lanes)[pixel + member][POINTED_LANE];
    }
    vector_store(at, -POINTED_LANE, value);
}

static struct vector each(const struct probe_input *in, int pixel) {
    const uint8_t *at[VECTOR_MEMBERS];
    for (int member = 0; member < VECTOR_MEMBERS; member++) {
        at[member] = in->a[pixel + member];
    }
    return vector_each(at, POINTED_LANE);
}

static struct vector blend(const struct probe_input *in, int pixel) {
    const match_share *at[VECTOR_MEMBERS];
    for (int member = 0; member < VECTOR_MEMBERS; member++) {
        at[member] = &in->share[pixel + member] + 1;
    }
    return vector_blend(get(&in->a, pixel), get(&in->b, pixel), vector_shares_each(at, -1));
}

static struct vector cost(const struct probe_input *in, int pixel) {
    struct vector left[PROBE_FEATURES];
    struct vector right[PROBE_FEATURES];
    for (int i = 0; i < PROBE_FEATURES; i++) {
        left[i] = get(&in->left[i], pixel);
        right[i] = get(&in->right[i], pixel);
    }
    return vector_cost(left, right);
}

static void run_group(const struct probe_input *in, int pixel, struct probe_output *out) {
    const struct vector a = get(&in->a, pixel);
    const struct vector b = get(&in->b, pixel);
    put(a, &out->of[PROBE_LOAD], pixel);
    put(each(in, pixel), &out->of[PROBE_EACH], pixel);
    put(vector_all(in->b[0][0]), &out->of[PROBE_ALL], pixel);
    put(vector_min(a, b), &out->of[PROBE_MIN], pixel);
    put(vector_add(a, b), &out->of[PROBE_ADD], pixel);
    put(vector_sub(a, b), &out->of[PROBE_SUB], pixel);
    put(vector_or(a, b), &out->of[PROBE_OR], pixel);
    put(vector_up(a, b), &out->of[PROBE_UP], pixel);
    put(vector_down(a, b), &out->of[PROBE_DOWN], pixel);
    put(blend(in, pixel), &out->of[PROBE_BLEND], pixel);
    put(vector_lowest(a), &out->of[PROBE_LOWEST], pixel);
    put(cost(in, pixel), &out->of[PROBE_COST], pixel);
    const uint32_t equal = vector_equal(a, b);
    for (int member = 0; member < VECTOR_MEMBERS; member++) {
        const uint32_t bits = equal >> (MATCH_LANES * member);
        out->of[PROBE_FIRST][pixel + member][0] = vector_first(a, member);
        out->of[PROBE_EQUAL][pixel + member][0] = (uint8_t)(bits & 0xff);
        out->of[PROBE_EQUAL][pixel + member][1] = (uint8_t)(bits >> 8 & 0xff);
    }
    // Bits above those of the members would be lanes of no pixel.
    if (VECTOR_MEMBERS == 1 && equal > 0xffff) {
        out->of[PROBE_EQUAL][pixel][2] = UINT8_MAX;
    }
}

static void run(const struct probe_input *in, struct probe_output *out) {
    memset(out, 0, sizeof *out);
    for (int pixel = 0; pixel < PROBE_PIXELS; pixel += VECTOR_MEMBERS) {
        run_group(in, pixel, out);
    }
}

#endif
