// SPDX-License-Identifier: Apache-2.0
#include "stereo/surface.h"

#include <string.h>

#include "core/error.h"
#include "core/invariant.h"
#include "stereo/mesh.h"

// A cell with n <= 4 vertices has n - 2 <= n / 2 triangles, and a vertex belongs to at most four
// cells.
enum { TRIANGLES_A_VERTEX = 2 };

struct rows {
    const struct triangulate_plan *plan;
    struct reconstruct_result *result;
    uint32_t *first;  // index of the first vertex of each row, height + 1 values
    uint32_t *kept;   // vertices that could be triangulated, per row
    struct surface_depths depths;
};

size_t surface_need_bytes(int width_px, int height_px, size_t valid) {
    const size_t width = (size_t)width_px;
    const size_t rows = (size_t)height_px + 1;
    return arena_need_bytes(valid, sizeof(struct triangulate_point)) +
           arena_need_bytes(valid, sizeof(uint32_t)) + arena_need_bytes(valid, sizeof(int16_t[3])) +
           arena_need_bytes(valid * TRIANGLES_A_VERTEX, sizeof(uint32_t[3])) +
           2 * arena_need_bytes(rows, sizeof(uint32_t)) +
           2 * arena_need_bytes(width, sizeof(uint32_t)) +
           2 * arena_need_bytes(width, sizeof(int64_t[3]));
}

struct surface_depths surface_depths_of(double near_mm, double far_mm) {
    const double um_per_mm = 1000;
    struct surface_depths depths = {.near_um = 0, .far_um = INT32_MAX};
    if (near_mm > 0 && near_mm * um_per_mm < INT32_MAX) {
        depths.near_um = (int32_t)(near_mm * um_per_mm);
    }
    if (far_mm > near_mm && far_mm * um_per_mm < INT32_MAX - 1) {
        depths.far_um = (int32_t)(far_mm * um_per_mm) + 1;
    }
    INVARIANT(depths.near_um <= depths.far_um);
    return depths;
}

static bool is_within(const struct surface_depths *depths, const struct triangulate_point *point) {
    return point->z_um >= depths->near_um && point->z_um <= depths->far_um;
}

static uint32_t count_valid(const struct image_u8 *reason, int y) {
    const uint8_t *row = image_u8_row(reason, y);
    uint32_t count = 0;
    for (int x = 0; x < reason->width; x++) {
        count += row[x] == REASON_VALID;
    }
    return count;
}

static void triangulate_row(void *context, int y) {
    const struct rows *rows = context;
    struct reconstruct_result *result = rows->result;
    const int width = result->plan.width_px;
    const int32_t *disparity_q8 = image_i32_row(&result->match.disparity_q8, y);
    const uint16_t *sigma_q8 = image_u16_row(&result->sigma_q8, y);
    uint8_t *reason = image_u8_row(&result->match.reason, y);
    uint32_t vertex = rows->first[y];
    for (int x = 0; x < width; x++) {
        if (reason[x] != REASON_VALID) {
            continue;
        }
        if (triangulate_match(rows->plan, x, y, disparity_q8[x], sigma_q8[x],
                              &result->points[vertex]) &&
            is_within(&rows->depths, &result->points[vertex])) {
            result->vertex_pixel[vertex] = (uint32_t)y * (uint32_t)width + (uint32_t)x;
            vertex++;
        } else {
            reason[x] = REASON_OUT_OF_RANGE;
        }
    }
    INVARIANT(vertex <= rows->first[y + 1]);
    rows->kept[y] = vertex - rows->first[y];
}

// Closes the gaps left by matches without a point.
static uint32_t compact(const struct rows *rows, int height) {
    struct reconstruct_result *result = rows->result;
    uint32_t total = 0;
    for (int y = 0; y < height; y++) {
        INVARIANT(total <= rows->first[y]);
        if (total != rows->first[y]) {
            memmove(result->points + total, result->points + rows->first[y],
                    rows->kept[y] * sizeof *result->points);
            memmove(result->vertex_pixel + total, result->vertex_pixel + rows->first[y],
                    rows->kept[y] * sizeof *result->vertex_pixel);
        }
        total += rows->kept[y];
    }
    return total;
}

int surface_triangulate(const struct parallel *parallel, struct arena *arena,
                        const struct surface_depths *depths, struct reconstruct_result *result) {
    const int height = result->plan.height_px;
    struct triangulate_plan plan;
    const int error = triangulate_plan_make(&result->plan, &result->vertical, &plan);
    if (error != ERROR_OK) {
        return error;
    }
    uint32_t valid = 0;
    for (int y = 0; y < height; y++) {
        valid += count_valid(&result->match.reason, y);
    }
    result->points = arena_take(arena, valid, sizeof *result->points);
    result->vertex_pixel = arena_take(arena, valid, sizeof *result->vertex_pixel);
    const size_t mark = arena_mark(arena);
    struct rows rows = {.plan = &plan, .result = result, .depths = *depths};
    rows.first = arena_take(arena, (size_t)height + 1, sizeof *rows.first);
    rows.kept = arena_take(arena, (size_t)height + 1, sizeof *rows.kept);
    if (result->points == NULL || result->vertex_pixel == NULL || rows.first == NULL ||
        rows.kept == NULL) {
        return ERROR_MEMORY;
    }
    rows.first[0] = 0;
    for (int y = 0; y < height; y++) {
        rows.first[y + 1] = rows.first[y] + count_valid(&result->match.reason, y);
    }
    parallel->run(parallel->self, triangulate_row, &rows, height);
    INVARIANT(rows.first[height] == valid);
    result->vertex_count = compact(&rows, height);
    INVARIANT(result->vertex_count <= valid);
    arena_release(arena, mark);
    return ERROR_OK;
}

// Two rows of vertices, with the sums of the normals of their triangles.
struct strip {
    uint32_t *vertex[2];
    int64_t (*normal[2])[3];
    uint32_t first[2];
    uint32_t count[2];
};

static void number_row(const struct reconstruct_result *result, int y, uint32_t first,
                       uint32_t *vertex, uint32_t *count) {
    const uint8_t *reason = image_u8_row(&result->match.reason, y);
    *count = 0;
    for (int x = 0; x < result->plan.width_px; x++) {
        vertex[x] = reason[x] == REASON_VALID ? first + (*count)++ : MESH_NO_VERTEX;
    }
}

static int64_t *normal_sum(struct strip *strip, uint32_t vertex) {
    const int row = vertex >= strip->first[1];
    INVARIANT(vertex - strip->first[row] < strip->count[row]);
    return strip->normal[row][vertex - strip->first[row]];
}

static void join(const struct mesh_options *options, struct reconstruct_result *result,
                 struct strip *strip, int y) {
    const struct mesh_row above = {
        .disparity_q8 = image_i32_row(&result->match.disparity_q8, y - 1),
        .vertex = strip->vertex[0]};
    const struct mesh_row below = {.disparity_q8 = image_i32_row(&result->match.disparity_q8, y),
                                   .vertex = strip->vertex[1]};
    uint32_t(*triangles)[3] = result->triangles + result->triangle_count;
    const int count = mesh_join_rows(options, &above, &below, triangles);
    for (int i = 0; i < count; i++) {
        const uint32_t *corner = triangles[i];
        int64_t sum[3] = {0, 0, 0};
        mesh_accumulate_normal(&result->points[corner[0]], &result->points[corner[1]],
                               &result->points[corner[2]], sum);
        for (int j = 0; j < 3; j++) {
            int64_t *at = normal_sum(strip, corner[j]);
            for (int k = 0; k < 3; k++) {
                at[k] += sum[k];
            }
        }
    }
    result->triangle_count += (uint32_t)count;
}

static void finish_normals(struct reconstruct_result *result, const struct strip *strip) {
    for (uint32_t i = 0; i < strip->count[0]; i++) {
        mesh_normal_q14(strip->normal[0][i], result->normals_q14[strip->first[0] + i]);
    }
}

static void shift_strip(struct strip *strip) {
    uint32_t *vertex = strip->vertex[0];
    strip->vertex[0] = strip->vertex[1];
    strip->vertex[1] = vertex;
    int64_t(*normal)[3] = strip->normal[0];
    strip->normal[0] = strip->normal[1];
    strip->normal[1] = normal;
    strip->first[0] = strip->first[1];
    strip->count[0] = strip->count[1];
}

int surface_mesh(int32_t max_gap_q8, struct arena *arena, struct reconstruct_result *result) {
    const size_t width = (size_t)result->plan.width_px;
    result->normals_q14 = arena_take(arena, result->vertex_count, sizeof *result->normals_q14);
    result->triangles = arena_take(arena, (size_t)result->vertex_count * TRIANGLES_A_VERTEX,
                                   sizeof *result->triangles);
    const size_t mark = arena_mark(arena);
    struct strip strip = {{0}, {0}, {0}, {0}};
    bool taken = result->normals_q14 != NULL && result->triangles != NULL;
    for (int i = 0; i < 2; i++) {
        taken =
            (strip.vertex[i] = arena_take(arena, width, sizeof *strip.vertex[i])) != NULL && taken;
        taken =
            (strip.normal[i] = arena_take(arena, width, sizeof *strip.normal[i])) != NULL && taken;
    }
    if (!taken) {
        return ERROR_MEMORY;
    }
    const struct mesh_options options = {.width_px = result->plan.width_px,
                                         .max_gap_q8 = max_gap_q8};
    number_row(result, 0, 0, strip.vertex[0], &strip.count[0]);
    memset(strip.normal[0], 0, width * sizeof *strip.normal[0]);
    for (int y = 1; y < result->plan.height_px; y++) {
        strip.first[1] = strip.first[0] + strip.count[0];
        number_row(result, y, strip.first[1], strip.vertex[1], &strip.count[1]);
        memset(strip.normal[1], 0, width * sizeof *strip.normal[1]);
        join(&options, result, &strip, y);
        finish_normals(result, &strip);
        shift_strip(&strip);
    }
    finish_normals(result, &strip);
    INVARIANT(strip.first[0] + strip.count[0] == result->vertex_count);
    INVARIANT(result->triangle_count <= result->vertex_count * TRIANGLES_A_VERTEX);
    arena_release(arena, mark);
    return ERROR_OK;
}
