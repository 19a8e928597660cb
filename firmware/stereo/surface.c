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
    struct triangulate_certain certain;  // disparities within these depths
};

// Two rows of vertices, with the sums of the normals of their triangles. What a walk visits is made
// here, too: points and pixels of both rows, normals of the upper one, triangles between them.
struct strip {
    uint32_t *vertex[2];
    int64_t (*normal[2])[3];
    struct triangulate_point *points[2];
    uint32_t *pixel[2];
    int16_t (*normals_q14)[3];
    uint32_t (*triangles)[3];
    uint32_t first[2];
    uint32_t count[2];
};

static size_t strip_need_bytes(size_t width, bool made_again) {
    const size_t rows = 2 * arena_need_bytes(width, sizeof(uint32_t)) +
                        2 * arena_need_bytes(width, sizeof(int64_t[3]));
    const size_t again = 2 * arena_need_bytes(width, sizeof(struct triangulate_point)) +
                         2 * arena_need_bytes(width, sizeof(uint32_t)) +
                         arena_need_bytes(width, sizeof(int16_t[3])) +
                         arena_need_bytes(TRIANGLES_A_VERTEX * width, sizeof(uint32_t[3]));
    return rows + (made_again ? again : 0);
}

static bool take_strip(struct arena *arena, size_t width, bool made_again, struct strip *strip) {
    bool taken = true;
    *strip = (struct strip){.first = {0, 0}};
    for (int i = 0; i < 2; i++) {
        strip->vertex[i] = arena_take(arena, width, sizeof *strip->vertex[i]);
        strip->normal[i] = arena_take(arena, width, sizeof *strip->normal[i]);
        taken = taken && strip->vertex[i] != NULL && strip->normal[i] != NULL;
        if (made_again) {
            strip->points[i] = arena_take(arena, width, sizeof *strip->points[i]);
            strip->pixel[i] = arena_take(arena, width, sizeof *strip->pixel[i]);
            taken = taken && strip->points[i] != NULL && strip->pixel[i] != NULL;
        }
    }
    if (made_again) {
        strip->normals_q14 = arena_take(arena, width, sizeof *strip->normals_q14);
        strip->triangles = arena_take(arena, TRIANGLES_A_VERTEX * width, sizeof *strip->triangles);
        taken = taken && strip->normals_q14 != NULL && strip->triangles != NULL;
    }
    return taken;
}

size_t surface_need_bytes(int width_px, int height_px, size_t valid) {
    const size_t width = (size_t)width_px;
    const size_t rows = (size_t)height_px + 1;
    if (valid == 0) {
        return strip_need_bytes(width, true) + 2 * arena_need_bytes(rows, sizeof(uint32_t));
    }
    return arena_need_bytes(valid, sizeof(struct triangulate_point)) +
           arena_need_bytes(valid, sizeof(uint32_t)) + arena_need_bytes(valid, sizeof(int16_t[3])) +
           arena_need_bytes(valid * TRIANGLES_A_VERTEX, sizeof(uint32_t[3])) +
           2 * arena_need_bytes(rows, sizeof(uint32_t)) + strip_need_bytes(width, false);
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

static uint32_t count_points(const struct image_u8 *reason, int y) {
    const uint8_t *row = image_u8_row(reason, y);
    uint32_t count = 0;
    for (int x = 0; x < reason->width; x++) {
        count += reason_has_point(row[x]);
    }
    return count;
}

static void triangulate_row(void *context, int y) {
    const struct rows *rows = context;
    struct reconstruct_result *result = rows->result;
    const int width = result->plan.width_px;
    const int32_t *disparity_q8 = image_i32_row(&result->match.disparity_q8, y);
    const uint8_t *sigma = image_u8_row(&result->sigma, y);
    uint8_t *reason = image_u8_row(&result->match.reason, y);
    uint32_t vertex = rows->first[y];
    for (int x = 0; x < width; x++) {
        if (!reason_has_point(reason[x])) {
            continue;
        }
        if (result->points == NULL && triangulate_is_certain(&rows->certain, disparity_q8[x])) {
            vertex++;
            continue;
        }
        struct triangulate_point point;
        const bool meets = triangulate_match(rows->plan, x, y, disparity_q8[x],
                                             subpixel_sigma_q8(sigma[x]), &point);
        if (!meets || point.z_um < rows->depths.near_um || point.z_um > rows->depths.far_um) {
            const bool is_kept = !meets && rows->depths.keep_beyond && reason[x] == REASON_VALID;
            reason[x] = is_kept ? REASON_BEYOND : REASON_OUT_OF_RANGE;
            continue;
        }
        if (result->points != NULL) {
            result->points[vertex] = point;
            result->vertex_pixel[vertex] = (uint32_t)y * (uint32_t)width + (uint32_t)x;
        }
        vertex++;
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
        if (total != rows->first[y] && result->points != NULL) {
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
                        const struct surface_depths *depths, bool recompute,
                        struct reconstruct_result *result) {
    const int height = result->plan.height_px;
    struct triangulate_plan plan;
    const int error = triangulate_plan_make(&result->plan, &result->vertical, &plan);
    if (error != ERROR_OK) {
        return error;
    }
    uint32_t with_point = 0;
    for (int y = 0; y < height; y++) {
        with_point += count_points(&result->match.reason, y);
    }
    if (!recompute) {
        result->points = arena_take(arena, with_point, sizeof *result->points);
        result->vertex_pixel = arena_take(arena, with_point, sizeof *result->vertex_pixel);
    }
    const size_t mark = arena_mark(arena);
    struct rows rows = {.plan = &plan, .result = result, .depths = *depths};
    rows.certain = triangulate_find_certain(&result->plan, &plan, depths->near_um, depths->far_um);
    rows.first = arena_take(arena, (size_t)height + 1, sizeof *rows.first);
    rows.kept = arena_take(arena, (size_t)height + 1, sizeof *rows.kept);
    if ((!recompute && (result->points == NULL || result->vertex_pixel == NULL)) ||
        rows.first == NULL || rows.kept == NULL) {
        return ERROR_MEMORY;
    }
    rows.first[0] = 0;
    for (int y = 0; y < height; y++) {
        rows.first[y + 1] = rows.first[y] + count_points(&result->match.reason, y);
    }
    parallel->run(parallel->self, triangulate_row, &rows, height);
    INVARIANT(rows.first[height] == with_point);
    result->vertex_count = compact(&rows, height);
    INVARIANT(result->vertex_count <= with_point);
    arena_release(arena, mark);
    return ERROR_OK;
}

static void number_row(const struct reconstruct_result *result, int y, uint32_t first,
                       uint32_t *vertex, uint32_t *count) {
    const uint8_t *reason = image_u8_row(&result->match.reason, y);
    *count = 0;
    for (int x = 0; x < result->plan.width_px; x++) {
        vertex[x] = reason_has_point(reason[x]) ? first + (*count)++ : MESH_NO_VERTEX;
    }
}

// Joins the rows y - 1 and y; returns the number of triangles.
static uint32_t join(const struct reconstruct_result *result, const struct strip *strip, int y,
                     uint32_t (*triangles)[3]) {
    const struct mesh_options options = {.width_px = result->plan.width_px,
                                         .max_gap_q8 = result->max_gap_q8};
    const struct mesh_row above = {
        .disparity_q8 = image_i32_row(&result->match.disparity_q8, y - 1),
        .vertex = strip->vertex[0]};
    const struct mesh_row below = {.disparity_q8 = image_i32_row(&result->match.disparity_q8, y),
                                   .vertex = strip->vertex[1]};
    return (uint32_t)mesh_join_rows(&options, &above, &below, triangles);
}

// Adds the normals of triangles to their corners.
static void accumulate(const struct strip *strip, uint32_t (*triangles)[3], uint32_t count) {
    for (uint32_t i = 0; i < count; i++) {
        const struct triangulate_point *points[3];
        int64_t *at[3];
        for (int j = 0; j < 3; j++) {
            const int row = triangles[i][j] >= strip->first[1];
            const uint32_t index = triangles[i][j] - strip->first[row];
            INVARIANT(index < strip->count[row]);
            points[j] = &strip->points[row][index];
            at[j] = strip->normal[row][index];
        }
        int64_t sum[3] = {0, 0, 0};
        mesh_accumulate_normal(points[0], points[1], points[2], sum);
        for (int j = 0; j < 3; j++) {
            for (int k = 0; k < 3; k++) {
                at[j][k] += sum[k];
            }
        }
    }
}

static void finish_normals(const struct strip *strip, int16_t (*normals_q14)[3]) {
    for (uint32_t i = 0; i < strip->count[0]; i++) {
        mesh_normal_q14(strip->normal[0][i], normals_q14[i]);
    }
}

// The lower row becomes the upper one.
static void shift_strip(struct strip *strip) {
    const struct strip old = *strip;
    for (int i = 0; i < 2; i++) {
        strip->vertex[i] = old.vertex[1 - i];
        strip->normal[i] = old.normal[1 - i];
        strip->points[i] = old.points[1 - i];
        strip->pixel[i] = old.pixel[1 - i];
    }
    strip->first[0] = old.first[1];
    strip->count[0] = old.count[1];
}

// Numbers row y as the lower one.
static void begin_row(const struct reconstruct_result *result, int y, struct strip *strip) {
    watch_serve(&result->watch);
    strip->first[1] = y > 0 ? strip->first[0] + strip->count[0] : 0;
    number_row(result, y, strip->first[1], strip->vertex[1], &strip->count[1]);
    memset(strip->normal[1], 0, (size_t)result->plan.width_px * sizeof *strip->normal[1]);
}

static int count_triangles(struct arena *arena, struct reconstruct_result *result) {
    const size_t width = (size_t)result->plan.width_px;
    struct strip strip;
    result->walk_memory = arena_take(arena, strip_need_bytes(width, true), 1);
    if (result->walk_memory == NULL) {
        return ERROR_MEMORY;
    }
    struct arena own;
    arena_init(&own, result->walk_memory, strip_need_bytes(width, true));
    const bool taken = take_strip(&own, width, true, &strip);
    INVARIANT(taken);
    for (int y = 0; y < result->plan.height_px; y++) {
        begin_row(result, y, &strip);
        result->triangle_count += y > 0 ? join(result, &strip, y, strip.triangles) : 0;
        shift_strip(&strip);
    }
    INVARIANT(strip.first[0] + strip.count[0] == result->vertex_count);
    return ERROR_OK;
}

int surface_mesh(struct arena *arena, struct reconstruct_result *result) {
    if (result->points == NULL) {
        return count_triangles(arena, result);
    }
    const size_t width = (size_t)result->plan.width_px;
    result->normals_q14 = arena_take(arena, result->vertex_count, sizeof *result->normals_q14);
    result->triangles = arena_take(arena, (size_t)result->vertex_count * TRIANGLES_A_VERTEX,
                                   sizeof *result->triangles);
    const size_t mark = arena_mark(arena);
    struct strip strip;
    if (!take_strip(arena, width, false, &strip) || result->normals_q14 == NULL ||
        result->triangles == NULL) {
        return ERROR_MEMORY;
    }
    for (int y = 0; y < result->plan.height_px; y++) {
        begin_row(result, y, &strip);
        strip.points[1] = result->points + strip.first[1];
        if (y > 0) {
            uint32_t(*triangles)[3] = result->triangles + result->triangle_count;
            const uint32_t count = join(result, &strip, y, triangles);
            accumulate(&strip, triangles, count);
            finish_normals(&strip, result->normals_q14 + strip.first[0]);
            result->triangle_count += count;
        }
        shift_strip(&strip);
    }
    finish_normals(&strip, result->normals_q14 + strip.first[0]);
    INVARIANT(strip.first[0] + strip.count[0] == result->vertex_count);
    INVARIANT(result->triangle_count <= result->vertex_count * TRIANGLES_A_VERTEX);
    arena_release(arena, mark);
    return ERROR_OK;
}

// ---- walks over a surface that is not kept

// Points and pixels of row y, the lower one.
static void make_points(const struct reconstruct_result *result,
                        const struct triangulate_plan *plan, int y, struct strip *strip) {
    const int32_t *disparity_q8 = image_i32_row(&result->match.disparity_q8, y);
    const uint8_t *sigma = image_u8_row(&result->sigma, y);
    const uint8_t *reason = image_u8_row(&result->match.reason, y);
    const int width = result->plan.width_px;
    uint32_t count = 0;
    for (int x = 0; x < width; x++) {
        if (reason_has_point(reason[x])) {
            const bool met = triangulate_match(
                plan, x, y, disparity_q8[x], subpixel_sigma_q8(sigma[x]), &strip->points[1][count]);
            INVARIANT(met);
            strip->pixel[1][count++] = (uint32_t)y * (uint32_t)width + (uint32_t)x;
        }
    }
}

// Visits the upper row, or the triangles between both.
static void visit_row(const struct strip *strip, unsigned what, uint32_t triangles,
                      void (*visit)(void *self, const struct surface_part *part), void *self) {
    struct surface_part part = {.vertex_count = 0};
    if ((what & SURFACE_POINTS) != 0) {
        part.vertex_count = strip->count[0];
        part.points = strip->points[0];
        part.vertex_pixel = strip->pixel[0];
    }
    if ((what & SURFACE_NORMALS) == SURFACE_NORMALS) {
        finish_normals(strip, strip->normals_q14);
        part.normals_q14 = strip->normals_q14;
    }
    if ((what & SURFACE_TRIANGLES) != 0) {
        part.triangle_count = triangles;
        part.triangles = strip->triangles;
    }
    visit(self, &part);
}

static void walk_rows(const struct reconstruct_result *result, unsigned what,
                      void (*visit)(void *self, const struct surface_part *part), void *self) {
    const size_t width = (size_t)result->plan.width_px;
    const bool normals = (what & SURFACE_NORMALS) == SURFACE_NORMALS;
    struct triangulate_plan plan;
    struct strip strip;
    struct arena own;
    arena_init(&own, result->walk_memory, strip_need_bytes(width, true));
    const bool taken = take_strip(&own, width, true, &strip);
    const int error = triangulate_plan_make(&result->plan, &result->vertical, &plan);
    INVARIANT(taken && error == ERROR_OK);
    for (int y = 0; y < result->plan.height_px; y++) {
        uint32_t triangles = 0;
        begin_row(result, y, &strip);
        if ((what & SURFACE_POINTS) != 0) {
            make_points(result, &plan, y, &strip);
        }
        if (y > 0 && (normals || (what & SURFACE_TRIANGLES) != 0)) {
            triangles = join(result, &strip, y, strip.triangles);
        }
        if (normals) {
            accumulate(&strip, strip.triangles, triangles);
        }
        if (y > 0) {
            visit_row(&strip, what, triangles, visit, self);
        }
        shift_strip(&strip);
    }
    visit_row(&strip, what, 0, visit, self);
}

void surface_walk(const struct reconstruct_result *result, unsigned what,
                  void (*visit)(void *self, const struct surface_part *part), void *self) {
    if (result->vertex_count > 0 && result->points == NULL) {
        walk_rows(result, what, visit, self);
        return;
    }
    const struct surface_part all = {
        .vertex_count = result->vertex_count,
        .points = result->points,
        .vertex_pixel = result->vertex_pixel,
        .normals_q14 = result->normals_q14,
        .triangle_count = result->triangle_count,
        .triangles = result->triangles,
    };
    visit(self, &all);
}
