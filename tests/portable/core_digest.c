// SPDX-License-Identifier: Apache-2.0
// One checksum per module over what the core computes from fixed pseudo-random inputs. Built for
// several processors and compilers, it must print the same line: see
// tests/command/repository/portable_test.py. To cover another module, add a function and its line
// in `modules`.
#include <inttypes.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/crc.h"
#include "core/error.h"
#include "core/math.h"
#include "digest_match.h"
#include "digest_numbers.h"
#include "digest_search.h"
#include "stereo/geometry/calibration.h"
#include "stereo/geometry/geometry.h"
#include "stereo/geometry/lens.h"
#include "stereo/geometry/rectify.h"
#include "stereo/geometry/triangulate.h"
#include "stereo/image/debayer.h"
#include "stereo/image/reason.h"
#include "stereo/match/checks.h"
#include "stereo/match/kernels.h"
#include "stereo/mesh.h"

static uint32_t digest_math(void) {
    uint32_t crc = 0;
    for (int i = 0; i < draws(20000, 100); i++) {
        const double range = i % 2 == 0 ? 4.0 : 1e6;
        crc = add_double(crc, math_sin(uniform(-range, range)));
        crc = add_double(crc, math_cos(uniform(-range, range)));
        const double y = uniform(-3, 3), x = uniform(-3, 3);
        crc = add_double(crc, math_atan2(y, x));
        crc = add_double(crc, math_exp(uniform(-700, 700)));
        crc = add_double(crc, math_log(uniform(0, 1e9)));
    }
    return crc;
}

static uint32_t digest_geometry(void) {
    uint32_t crc = 0;
    for (int i = 0; i < draws(3000, 30); i++) {
        double r_rad[3], R[9], again_rad[3] = {0}, a[3], b[3], origin[3] = {0};
        for (int k = 0; k < 3; k++) {
            r_rad[k] = uniform(-2, 2);
            a[k] = uniform(-1, 1);
            b[k] = uniform(-1, 1);
        }
        geometry_rotation_from_vector(r_rad, R);
        crc = add_doubles(crc, R, 9);
        crc = add_bits(crc, (uint64_t)geometry_vector_from_rotation(R, again_rad), 4);
        crc = add_doubles(crc, again_rad, 3);
        struct geometry_midpoint middle = {.s = 0};
        crc = add_bits(crc, geometry_rays_midpoint(origin, a, r_rad, b, &middle), 1);
        crc = add_doubles(crc, middle.point_mm, 3);
        crc = add_double(crc, middle.miss_mm);
    }
    return crc;
}

static struct lens random_lens(int width_px, int height_px, double f_px) {
    for (;;) {
        // One draw per statement: C leaves the order within an initialiser open.
        struct lens made = {.width_px = width_px, .height_px = height_px};
        made.fx_px = f_px * uniform(0.99, 1.01);
        made.fy_px = f_px * uniform(0.99, 1.01);
        made.cx_px = width_px * uniform(0.45, 0.55);
        made.cy_px = height_px * uniform(0.45, 0.55);
        const double corner2 = (width_px * width_px + height_px * height_px) / (4 * f_px * f_px);
        made.k1 = uniform(-0.08, 0.08) / corner2;
        made.k2 = uniform(-0.03, 0.03) / (corner2 * corner2);
        made.p1 = uniform(-0.002, 0.002);
        made.p2 = uniform(-0.002, 0.002);
        if (lens_validate(&made) == ERROR_OK) {
            return made;
        }
    }
}

static uint32_t digest_lens(void) {
    uint32_t crc = 0;
    for (int i = 0; i < draws(200, 2); i++) {
        const struct lens lens = random_lens(640, 480, uniform(200, 9000));
        crc = add_double(crc, lens_fold_radius(&lens));
        for (int k = 0; k < draws(20, 4); k++) {
            const double pixel_px[2] = {uniform(0, 639), uniform(0, 479)};
            double ray[3] = {0};
            crc = add_bits(crc, lens_ray(&lens, pixel_px, ray), 1);
            crc = add_doubles(crc, ray, 3);
        }
    }
    return crc;
}

// The short form makes one, and one plan: its lenses cost the most.
static struct calibration random_rig(void) {
    static struct calibration rig;
    if (is_short && rig.id[0] != 0) {
        return rig;
    }
    rig = (struct calibration){.id = "digest"};
    const double f_px = uniform(150, 6000);
    rig.left = random_lens(320, 240, f_px);
    rig.right = random_lens(320, 240, f_px);
    const double tilt_rad = 16 / f_px;
    rig.rotation_right_left_rad[0] = uniform(-tilt_rad, tilt_rad);
    rig.rotation_right_left_rad[1] = uniform(0.02, 0.17);
    rig.rotation_right_left_rad[2] = uniform(-0.1, 0.1);
    const double centre_mm[3] = {uniform(50, 500), 0, 0};
    double R_right_left[9], t_mm[3];
    geometry_rotation_from_vector(rig.rotation_right_left_rad, R_right_left);
    geometry_rotate(R_right_left, centre_mm, t_mm);
    for (int k = 0; k < 3; k++) {
        rig.translation_right_left_mm[k] = -t_mm[k];
    }
    return rig;
}

struct rig_plan {
    struct calibration rig;
    struct rectify_plan plan;
    int error;
};

static const struct rig_plan *random_plan(void) {
    static const struct rectify_options options = {.scale = 1};
    static struct rig_plan made;
    if (!is_short || made.rig.id[0] == 0) {
        made.rig = random_rig();
        made.error = rectify_plan_make(&made.rig, &options, &made.plan);
    }
    return &made;
}

static uint32_t add_plan(uint32_t crc, const struct rectify_plan *plan) {
    crc = add_bits(crc, (uint64_t)plan->width_px, 4);
    crc = add_bits(crc, (uint64_t)plan->height_px, 4);
    crc = add_bits(crc, (uint64_t)plan->disparity_min, 4);
    crc = add_bits(crc, (uint64_t)plan->disparity_count, 4);
    crc = add_doubles(crc, plan->R_rect_left, 9);
    crc = add_doubles(crc, plan->R_rect_right, 9);
    const double numbers[] = {plan->f_px,  plan->cx_left_px,    plan->cx_right_px,
                              plan->cy_px, plan->depth_near_mm, plan->depth_far_mm};
    return add_doubles(crc, numbers, 6);
}

// Coordinates and pixels of some rows.
static uint32_t add_rows(uint32_t crc, const struct rectify_plan *plan,
                         const struct calibration *rig, enum rectify_side side) {
    const size_t bytes = rectify_table_need_bytes(plan);
    void *memory = must_have(bytes);
    struct arena working;
    struct rectify_table table;
    arena_init(&working, memory, bytes);
    if (rectify_table_make(plan, rig, side, &working, &table) != ERROR_OK) {
        free(memory);
        return add_bits(crc, 0xbad, 2);
    }
    const size_t width = (size_t)plan->width_px;
    const int raw_width = table.raw_width_px, raw_height = table.raw_height_px;
    uint8_t *raw = must_have((size_t)raw_width * (size_t)raw_height);
    for (int i = 0; i < raw_width * raw_height; i++) {
        raw[i] = (uint8_t)(next_random() >> 56);
    }
    const struct rectify_strip strip = {.end = raw_height,
                                        .grey = {raw, raw_width, raw_height, raw_width}};
    int32_t *work_q16 = must_have(2 * width * sizeof *work_q16);
    uint8_t *row = must_have(width);
    for (int y = 0; y < plan->height_px; y += draws(7, 24)) {
        const struct rectify_extent extent = rectify_row_extent(&table, y, work_q16);
        memset(row, 0, width);
        rectify_row_strip(&table, &strip, &extent, y, row, NULL, work_q16);
        crc = add_bits(crc, (uint64_t)extent.span.begin, 2);
        crc = add_bits(crc, (uint64_t)extent.span.end, 2);
        for (size_t x = 0; x < width; x++) {
            crc = add_bits(crc, (uint32_t)work_q16[x], 4);
            crc = add_bits(crc, (uint32_t)work_q16[width + x], 4);
            crc = add_bits(crc, row[x], 1);
        }
    }
    free(row);
    free(work_q16);
    free(raw);
    free(memory);
    return crc;
}

static uint32_t digest_rectify(void) {
    uint32_t crc = 0;
    for (int i = 0; i < draws(30, 1); i++) {
        const struct rig_plan *made = random_plan();
        crc = add_bits(crc, (uint64_t)made->error, 4);
        if (made->error == ERROR_OK) {
            crc = add_plan(crc, &made->plan);
            crc = add_rows(crc, &made->plan, &made->rig, RECTIFY_LEFT);
            crc = add_rows(crc, &made->plan, &made->rig, RECTIFY_RIGHT);
        }
    }
    return crc;
}

static uint32_t digest_triangulate(void) {
    uint32_t crc = 0;
    for (int i = 0; i < draws(100, 1); i++) {
        const struct rig_plan *made = random_plan();
        const struct rectify_plan *plan = &made->plan;
        struct triangulate_plan fixed;
        struct triangulate_vertical vertical = {.samples = i % 2};
        vertical.offset_px = uniform(-1, 1);
        vertical.slope_x = uniform(-1e-3, 1e-3);
        vertical.slope_y = uniform(-1e-3, 1e-3);
        vertical.rms_px = uniform(0, 0.5);
        if (made->error != ERROR_OK || triangulate_plan_make(plan, &vertical, &fixed) != ERROR_OK) {
            continue;
        }
        for (int k = 0; k < 300; k++) {
            struct triangulate_point point = {0};
            const int x = (int)(next_random() % (unsigned)plan->width_px);
            const int y = (int)(next_random() % (unsigned)plan->height_px);
            const int32_t disparity_q8 =
                256 * plan->disparity_min +
                (int32_t)(next_random() % (256u * (unsigned)plan->disparity_count));
            crc = add_bits(crc, triangulate_match(&fixed, x, y, disparity_q8, 20, &point), 1);
            crc = add_bits(crc, (uint32_t)point.x_um, 4);
            crc = add_bits(crc, (uint32_t)point.y_um, 4);
            crc = add_bits(crc, (uint32_t)point.z_um, 4);
            crc = add_bits(crc, point.miss_um, 4);
            crc = add_bits(crc, point.sigma_um, 4);
        }
    }
    return crc;
}

static uint32_t digest_mesh(void) {
    enum { WIDTH = 200 };
    uint32_t crc = 0;
    for (int i = 0; i < draws(50, 2); i++) {
        int32_t disparity_q8[2][WIDTH];
        uint32_t vertex[2][WIDTH];
        struct triangulate_point point[2][WIDTH];
        for (int x = 0; x < 2 * WIDTH; x++) {
            const int row = x / WIDTH, column = x % WIDTH;
            disparity_q8[row][column] = (int32_t)(next_random() % 600u);
            vertex[row][column] = next_random() % 5u == 0 ? MESH_NO_VERTEX : (uint32_t)x;
            struct triangulate_point *p = &point[row][column];
            p->x_um = (int32_t)(next_random() >> 40);
            p->y_um = (int32_t)(next_random() >> 40);
            p->z_um = (int32_t)(next_random() >> 35);
        }
        const struct mesh_options options = {WIDTH, MESH_DEFAULT_GAP_Q8};
        const struct mesh_row rows[2] = {{disparity_q8[0], vertex[0]},
                                         {disparity_q8[1], vertex[1]}};
        uint32_t triangles[2 * WIDTH][3];
        const int count = mesh_join_rows(&options, &rows[0], &rows[1], triangles);
        crc = add_bits(crc, (uint64_t)count, 4);
        for (int t = 0; t < count; t++) {
            int64_t sum[3] = {0};
            int16_t normal_q14[3];
            const struct triangulate_point *all = point[0];
            mesh_accumulate_normal(&all[triangles[t][0]], &all[triangles[t][1]],
                                   &all[triangles[t][2]], sum);
            mesh_normal_q14(sum, normal_q14);
            for (int k = 0; k < 3; k++) {
                crc = add_bits(crc, triangles[t][k], 4);
                crc = add_bits(crc, (uint16_t)normal_q14[k], 2);
            }
        }
    }
    return crc;
}

static uint32_t digest_speckle_filter(void) {
    uint32_t crc = 0;
    for (int i = 0; i < draws(20, 1); i++) {
        for (int k = 0; k < PAIR_PIXELS; k++) {
            pair.disparity_q8[k] = (int32_t)(next_random() % (200u + 100u * (unsigned)i));
            pair.reason[k] = (uint8_t)(next_random() % 3u == 0 ? REASON_OCCLUDED : REASON_VALID);
        }
        const int speckle_px = 2 + 4 * i;
        const size_t bytes = speckle_filter_need_bytes(PAIR_WIDTH, speckle_px, 1);
        void *memory = must_have(bytes);
        struct arena working;
        arena_init(&working, memory, bytes);
        struct match_output output = pair_output();
        must_succeed(speckle_filter_run_all(speckle_px, &parallel_serial, &working, &output),
                     "speckle_filter");
        free(memory);
        for (int k = 0; k < PAIR_PIXELS; k++) {
            crc = add_bits(crc, pair.reason[k], 1);
        }
    }
    return crc;
}

static uint32_t digest_debayer(void) {
    enum { WIDTH = 61, HEIGHT = 20 };
    uint32_t crc = 0;
    static uint16_t raw[WIDTH * HEIGHT], rgb[3 * WIDTH];
    static int32_t work[3 * (WIDTH + DEBAYER_MARGIN_PX)];
    for (int bits = 8; bits <= 16; bits += draws(1, 4)) {
        for (int i = 0; i < WIDTH * HEIGHT; i++) {
            raw[i] = (uint16_t)(next_random() >> (64 - bits));
        }
        const struct image_u16 mosaic = {raw, WIDTH, HEIGHT, WIDTH};
        for (int y = 0; y < HEIGHT; y++) {
            debayer_row(&mosaic, bits, y, rgb, work);
            for (int i = 0; i < 3 * WIDTH; i++) {
                crc = add_bits(crc, rgb[i], 2);
            }
        }
    }
    return crc;
}

static uint32_t digest_calibration(void) {
    uint32_t crc = 0;
    for (int i = 0; i < draws(50, 1); i++) {
        const struct calibration rig = random_rig();
        struct calibration again;
        char text[2][CALIBRATION_TEXT_MAX_BYTES + 1];
        const int length = calibration_print(&rig, text[0], sizeof text[0]);
        must_succeed(length < 0 ? length : ERROR_OK, "printing a calibration");
        must_succeed(calibration_parse(text[0], (size_t)length, &again, NULL),
                     "parsing a calibration");
        must_succeed(calibration_print(&again, text[1], sizeof text[1]) - length,
                     "printing it again");
        crc = crc_update(crc, text[1], (size_t)length);
    }
    return crc;
}

static const struct {
    const char *name;
    uint32_t (*digest)(void);
} modules[] = {
    {"math", digest_math},
    {"geometry", digest_geometry},
    {"lens", digest_lens},
    {"rectify", digest_rectify},
    {"triangulate", digest_triangulate},
    {"mesh", digest_mesh},
    {"match", digest_match},
    {"paper", digest_paper},
    {"refine", digest_refine},
    {"speckle_filter", digest_speckle_filter},
    {"debayer", digest_debayer},
    {"focus", digest_focus},
    {"exposure", digest_exposure},
    {"calibration", digest_calibration},
    {"focus_search", digest_focus_search},
    {"exposure_search", digest_exposure_search},
    {"measure", digest_measure},
};

// core_digest [--short] [LEVEL]: the matcher's level that this program has to select.
int main(int argc, char **argv) {
    is_short = argc > 1 && strcmp(argv[1], "--short") == 0;
    if (is_short) {
        shorten_pair();
    }
    argc -= is_short;
    argv += is_short;
    const char *chosen = match_kernels_best()->name;
    if (argc > 1 && strcmp(chosen, argv[1]) != 0) {
        fprintf(stderr, "core_digest: the matcher runs %s, not %s\n", chosen, argv[1]);
        return 1;
    }
    for (size_t i = 0; i < sizeof modules / sizeof modules[0]; i++) {
        random_state = 0x9e3779b97f4a7c15u;  // each module separately: a change of one does not
                                             // affect the others
        printf("%s%s %08" PRIx32, i == 0 ? "" : "  ", modules[i].name, modules[i].digest());
    }
    putchar('\n');
    return 0;
}
