// SPDX-License-Identifier: Apache-2.0
#include "stereo/mesh.h"

#include <stdbool.h>

#include "core/invariant.h"
#include "core/root.h"

// Edges are limited to this many bits, so that eight cross products fit their sum: beyond 268 m a
// larger triangle gets no larger weight.
enum { EDGE_BITS = 28 };

// A corner of a cell.
struct corner {
    uint32_t vertex;
    int32_t disparity_q8;
};

static struct corner corner_at(const struct mesh_row *row, int x) {
    const uint32_t vertex = row->vertex[x];
    return (struct corner){vertex, vertex == MESH_NO_VERTEX ? 0 : row->disparity_q8[x]};
}

static int64_t gap_q8(const struct corner *a, const struct corner *b) {
    const int64_t gap = (int64_t)a->disparity_q8 - b->disparity_q8;
    return gap < 0 ? -gap : gap;
}

// Adds the triangle if it has three vertices and no gap. Returns the number added.
static int join(const struct corner *a, const struct corner *b, const struct corner *c,
                int64_t max_gap_q8, uint32_t triangle[3]) {
    if (a->vertex == MESH_NO_VERTEX || b->vertex == MESH_NO_VERTEX || c->vertex == MESH_NO_VERTEX ||
        gap_q8(a, b) > max_gap_q8 || gap_q8(b, c) > max_gap_q8 || gap_q8(c, a) > max_gap_q8) {
        return 0;
    }
    triangle[0] = a->vertex;
    triangle[1] = b->vertex;
    triangle[2] = c->vertex;
    return 1;
}

int mesh_join_rows(const struct mesh_options *options, const struct mesh_row *above,
                   const struct mesh_row *below, uint32_t (*triangles)[3]) {
    INVARIANT(options->width_px >= 1 && options->max_gap_q8 >= 0);
    const int64_t max_gap_q8 = options->max_gap_q8;
    int count = 0;
    struct corner a = corner_at(above, 0), c = corner_at(below, 0);
    for (int x = 1; x < options->width_px; x++) {
        //  a b   a: above left, d: below right. Down first, then right: counter-clockwise for
        //  c d   an observer who has x to the right and y down.
        const struct corner b = corner_at(above, x), d = corner_at(below, x);
        const bool has_ad = a.vertex != MESH_NO_VERTEX && d.vertex != MESH_NO_VERTEX;
        const bool has_bc = b.vertex != MESH_NO_VERTEX && c.vertex != MESH_NO_VERTEX;
        if (has_ad && (!has_bc || gap_q8(&a, &d) <= gap_q8(&b, &c))) {
            count += join(&a, &c, &d, max_gap_q8, triangles[count]);
            count += join(&a, &d, &b, max_gap_q8, triangles[count]);
        } else if (has_bc) {
            count += join(&a, &c, &b, max_gap_q8, triangles[count]);
            count += join(&b, &c, &d, max_gap_q8, triangles[count]);
        }
        a = b;
        c = d;
    }
    INVARIANT(count <= 2 * (options->width_px - 1));
    return count;
}

static void edge_between(const struct triangulate_point *a, const struct triangulate_point *b,
                         int64_t edge_um[3]) {
    edge_um[0] = (int64_t)b->x_um - a->x_um;
    edge_um[1] = (int64_t)b->y_um - a->y_um;
    edge_um[2] = (int64_t)b->z_um - a->z_um;
}

// One bit above the highest bit of all components.
static uint64_t magnitude(const int64_t v[3]) {
    uint64_t bits = 0;
    for (int i = 0; i < 3; i++) {
        bits |= (uint64_t)(v[i] < 0 ? -v[i] : v[i]);
    }
    return bits;
}

void mesh_accumulate_normal(const struct triangulate_point *a, const struct triangulate_point *b,
                            const struct triangulate_point *c, int64_t sum[3]) {
    int64_t u[3], v[3];
    edge_between(a, b, u);
    edge_between(a, c, v);
    int shift = 0;
    const uint64_t largest = magnitude(u) | magnitude(v);
    while (largest >> shift >= (uint64_t)1 << EDGE_BITS) {
        shift++;
    }
    for (int i = 0; i < 3 && shift > 0; i++) {
        u[i] >>= shift;
        v[i] >>= shift;
    }
    sum[0] += u[1] * v[2] - u[2] * v[1];
    sum[1] += u[2] * v[0] - u[0] * v[2];
    sum[2] += u[0] * v[1] - u[1] * v[0];
}

void mesh_normal_q14(const int64_t sum[3], int16_t normal_q14[3]) {
    const uint64_t largest = magnitude(sum);
    if (largest == 0) {
        normal_q14[0] = normal_q14[1] = 0;
        normal_q14[2] = -16384;
        return;
    }
    // Scales the largest component to 30 bits, so that squares and their sum fit.
    const int zeros = __builtin_clzll(largest) - 34;
    int64_t v[3];
    for (int i = 0; i < 3; i++) {
        v[i] = zeros >= 0 ? sum[i] * ((int64_t)1 << zeros) : sum[i] >> -zeros;
    }
    int shift;
    const uint32_t m = root_normalise(v[0] * v[0] + v[1] * v[1] + v[2] * v[2], &shift);
    const int64_t inverse_q30 = root_inverse_q30(m);
    const int down = 31 - shift / 2;  // 1 / sqrt(m 2^-shift) = inverse 2^-45 2^(shift / 2)
    for (int i = 0; i < 3; i++) {
        const int64_t n = (v[i] * inverse_q30 + ((int64_t)1 << (down - 1))) >> down;
        INVARIANT(n >= -16385 && n <= 16385);
        normal_q14[i] = (int16_t)n;
    }
}
