// SPDX-License-Identifier: Apache-2.0
// Cycles of the stereo pipeline on the simulated BF537: tools/bench bf537 builds, runs and reads
// it. Each line is the name of a stage, its cycles in thousands, what they are divided by, the
// stacks, a checksum, and what went to and from SDRAM (enum sdram_event); the last ones have the
// frames' size, in that of the surface, and the bytes of its working memory and of the two frames.
#include <inttypes.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "bf537/l1.h"
#include "bf537_scene.h"
#include "core/arena.h"
#include "core/crc.h"
#include "core/error.h"
#include "core/invariant.h"
#include "core/parallel.h"
#include "stereo/geometry/rectify.h"
#include "stereo/image/reason.h"
#include "stereo/match/match.h"
#include "stereo/mesh.h"
#include "stereo/pictures.h"
#include "stereo/reconstruct.h"
#include "stereo/row_residual.h"
#include "stereo/subpixel.h"
#include "stereo/surface.h"
#include "surface/compact_writer.h"
#include "surface/surface_figures.h"

enum {
    RAW_BITS = 10,
    WORKING_BYTES = 12 << 20,
    STACK_BYTES = 64 << 10,
    PAINT = 0x5a,
    PAINT_BELOW = 128,  // the frame that paints
};

static struct arena working;
static uint64_t read_cycles(void) {
    uint32_t low, high;
    __asm__ volatile("%0 = cycles; %1 = cycles2;" : "=d"(low), "=d"(high));
    return (uint64_t)high << 32 | low;
}

static void start_cycles(void) {
    uint32_t bits;
    __asm__ volatile("%0 = syscfg; bitset(%0, 1); syscfg = %0;" : "=d"(bits));
}

// Counted by tools/bfin_devices/dv-bfin_mmu.c, which has them here.
enum sdram_event { LOADED_BYTES, STORED_BYTES, FILLED_LINES, WRITTEN_LINES, SDRAM_EVENTS };

struct sdram_use {
    uint32_t events[SDRAM_EVENTS];
};

static struct sdram_use read_sdram_use(void) {
    return *(const volatile struct sdram_use *)0x90000000;
}

static void *must_take(size_t count, size_t element_bytes) {
    void *taken = arena_take(&working, count, element_bytes);
    INVARIANT(taken != NULL);
    return taken;
}

// The stack below a stage, and that of its parts: painted before it, and what of them was used
// after it.
static uint8_t *stack_end;
extern uint8_t part_stack_begin[] __asm__("_bf537_l1_stack_begin");
extern uint8_t part_stack_end[] __asm__("_bf537_l1_stack_end");

static void paint(uint8_t *begin, const uint8_t *end) {
    for (uint8_t *at = begin; at < end; at++) {
        *(volatile uint8_t *)at = PAINT;
    }
}

static int used_of(const uint8_t *begin, const uint8_t *end) {
    while (begin < end && *(const volatile uint8_t *)begin == PAINT) {
        begin++;
    }
    return (int)(end - begin);
}

__attribute__((noinline)) static void paint_stack(void) {
    stack_end = (uint8_t *)__builtin_frame_address(0) - PAINT_BELOW;
    paint(stack_end - STACK_BYTES, stack_end);
    paint(part_stack_begin, part_stack_end);
}

struct cost {
    uint64_t cycles;
    struct sdram_use sdram;
};

static struct cost read_cost(void) {
    const struct sdram_use sdram = read_sdram_use();
    return (struct cost){read_cycles(), sdram};
}

static struct cost cost_since(const struct cost *begin) {
    struct cost cost = {.cycles = read_cycles() - begin->cycles, .sdram = read_sdram_use()};
    for (int i = 0; i < SDRAM_EVENTS; i++) {
        cost.sdram.events[i] -= begin->sdram.events[i];
    }
    return cost;
}

static void print_stage(const char *stage, const struct cost *cost, uint32_t units, uint32_t crc) {
    printf("%s %" PRIu32 " %" PRIu32 " %d %d %08" PRIx32, stage,
           (uint32_t)((cost->cycles + 500) / 1000), units,
           used_of(stack_end - STACK_BYTES, stack_end) + PAINT_BELOW,
           used_of(part_stack_begin, part_stack_end), crc);
    for (int i = 0; i < SDRAM_EVENTS; i++) {
        printf(" %" PRIu32, cost->sdram.events[i]);
    }
    printf("\n");
}

static struct image_u8 take_image(int width, int height) {
    return (struct image_u8){must_take((size_t)width * (size_t)height, 1), width, height, width};
}

static uint32_t crc_of(const struct match_output *output) {
    const size_t pixels = (size_t)output->reason.width * (size_t)output->reason.height;
    uint32_t crc = crc_update(0, output->disparity_q8.data, pixels * sizeof(int32_t));
    crc = crc_update(crc, output->reason.data, pixels);
    return crc_update(crc, output->confidence.data, pixels);
}

static void count_bytes(void *self, const void *bytes, size_t length) {
    uint32_t *crc = self;
    *crc = crc_update(*crc, bytes, length);
}

// The rows of the surface's file, as they are without zlib.
static uint32_t write_rows(const struct reconstruct_result *result) {
    const int width = result->plan.width_px;
    uint32_t crc = 0;
    const struct compact_output output = {compact_stored, count_bytes, &crc};
    struct compact_writer writer;
    compact_writer_begin(&writer, &output);
    compact_writer_rows(&writer, result, must_take(compact_band_bytes(width), 1),
                        must_take(compact_band_pixels(width) + COMPACT_STORED_MORE_BYTES, 1));
    while (compact_writer_band(&writer) < result->plan.height_px) {
    }
    return crc;
}

// A surface that is not kept, and its file.
static void run_surface(const struct match_output *match, const struct image_u8 *sigma) {
    const int width = sigma->width, height = sigma->height;
    const struct calibration rig = rig_of(2 * width, 2 * height);
    struct reconstruct_result result = {
        .match = *match,
        .sigma = *sigma,
        .plan = plan_of(&rig, width, height),
        .vertical = {.offset_px = 0.2, .slope_x = 1e-3, .rms_px = 0.1, .samples = 1},
        .left_colour = {must_take((size_t)width * (size_t)height, 3), width, height, 3 * width},
        .max_gap_q8 = MESH_DEFAULT_GAP_Q8,
        .arena_peak_bytes = WORKING_BYTES};
    result.plan.cx_right_px += width / 8;
    const struct surface_depths depths = surface_depths_of(500, 4000);
    struct surface_figures_spread spread;
    paint_stack();
    struct cost begin = read_cost();
    int error = surface_triangulate(&parallel_serial, &working, &depths, true, &result);
    error = error == ERROR_OK ? surface_mesh(&working, &result) : error;
    struct cost cost = cost_since(&begin);
    INVARIANT(error == ERROR_OK);
    const uint32_t points = result.vertex_count;
    print_stage("mesh", &cost, points, result.triangle_count);
    paint_stack();
    begin = read_cost();
    const bool found = surface_figures_find_spread(&result, NULL, points, &working, &spread);
    cost = cost_since(&begin);
    INVARIANT(found);
    print_stage("spread", &cost, points, crc_update(0, &spread, sizeof spread));
    memset(result.left_colour.data, 128, (size_t)width * (size_t)height * 3);
    paint_stack();
    begin = read_cost();
    const uint32_t crc = write_rows(&result);
    cost = cost_since(&begin);
    print_stage("file", &cost, (uint32_t)(width * height), crc);
}

static void run_residual(const struct match_input *input, const struct match_output *match) {
    struct row_residual residual;
    struct triangulate_vertical vertical = {0};
    const size_t mark = arena_mark(&working);
    paint_stack();
    const struct cost begin = read_cost();
    const int error = row_residual_begin(&residual, input, match, &working);
    INVARIANT(error == ERROR_OK);
    row_residual_add(&residual, match->reason.height);
    row_residual_finish(&residual, &vertical);
    const struct cost cost = cost_since(&begin);
    INVARIANT(vertical.samples > 0);
    print_stage("residual", &cost, (uint32_t)vertical.samples,
                crc_update(0, &vertical.offset_px, sizeof vertical.offset_px));
    arena_release(&working, mark);
}

static void match_and_fit(const struct match_input *input, enum match_preset preset, int width,
                          int height, int disparities) {
    const size_t mark = arena_mark(&working);
    struct match_options options = match_default_options(0, disparities);
    options.preset = preset;
    const size_t pixels = (size_t)width * (size_t)height;
    struct match_output output = {
        .disparity_q8 = {must_take(pixels, sizeof(int32_t)), width, height, width},
        .reason = take_image(width, height),
        .confidence = take_image(width, height),
    };
    paint_stack();
    struct cost begin = read_cost();
    int error = match_run(input, &options, &parallel_serial, NULL, NULL, &working, &output);
    struct cost cost = cost_since(&begin);
    INVARIANT(error == ERROR_OK);
    const bool is_paper = preset == MATCH_PRESET_PAPER;
    const uint32_t all = (uint32_t)pixels * (uint32_t)disparities;
    const uint32_t units = is_paper ? all : (uint32_t)match_work(width, height, &options);
    print_stage(match_preset_name(preset), &cost, units, crc_of(&output));
    if (is_paper) {
        arena_release(&working, mark);
        return;
    }
    struct subpixel fit;
    struct image_u8 sigma = take_image(width, height);
    paint_stack();
    begin = read_cost();
    error = subpixel_begin(&fit, input, &parallel_serial, &working, &output, &sigma, false);
    INVARIANT(error == ERROR_OK);
    subpixel_advance(&fit, height);
    cost = cost_since(&begin);
    print_stage("subpixel", &cost, (uint32_t)pixels,
                crc_update(crc_of(&output), sigma.data, pixels));
    run_residual(input, &output);
    run_surface(&output, &sigma);
    arena_release(&working, mark);
}

static void run_matching(int width, int height, int disparities) {
    const size_t mark = arena_mark(&working);
    const struct image_u8 left = take_image(width, height), right = take_image(width, height);
    fill_texture(left.data, width, height);
    fill_right(&left, &right, disparities);
    const struct match_input input = {.left = left, .right = right, .resampled = true};
    match_and_fit(&input, MATCH_PRESET_BOARD, width, height, disparities);
    match_and_fit(&input, MATCH_PRESET_PAPER, width, height, disparities);
    arena_release(&working, mark);
}

// The clock of the pictures, asked before they develop, between, and after they rectify a few rows.
struct picture_clock {
    struct sdram_use before, used[3];  // since the last question; [1]: develop, [2]: rectify
    int next;
};

static uint64_t clock_cycles(void *self) {
    struct picture_clock *clock = self;
    const struct sdram_use now = read_sdram_use();
    for (int i = 0; i < SDRAM_EVENTS; i++) {
        clock->used[clock->next].events[i] += now.events[i] - clock->before.events[i];
    }
    clock->before = now;
    clock->next = (clock->next + 1) % 3;
    return read_cycles();
}

static struct picture_side take_side(int width, int height, int raw_width, int raw_height) {
    const size_t raw_pixels = (size_t)raw_width * (size_t)raw_height;
    uint16_t *data = must_take(raw_pixels, sizeof *data);
    for (size_t i = 0; i < raw_pixels; i++) {
        data[i] = (uint16_t)(i % 512 + (next_random() & 255));
    }
    return (struct picture_side){
        .raw = {.data = data,
                .width_px = raw_width,
                .height_px = raw_height,
                .stride = raw_width,
                .bits = RAW_BITS,
                .layout = RAW_BAYER_GRBG},
        .span = must_take((size_t)height, sizeof(struct rectify_span)),
        .grey = take_image(width, height),
        .colour = {must_take((size_t)width * (size_t)height, 3), width, height, 3 * width},
    };
}

// What each new zoom or pan takes, with the range of depths that the surface above has.
static void run_plan(const struct calibration *rig) {
    struct rectify_options options = reconstruct_default_options().rectify;
    options.depth_near_mm = 500;
    options.depth_far_mm = 4000;
    struct rectify_plan plan;
    paint_stack();
    const struct cost begin = read_cost();
    const int error = rectify_plan_make(rig, &options, &plan);
    const struct cost cost = cost_since(&begin);
    INVARIANT(error == ERROR_OK);
    print_stage("plan", &cost, 1, (uint32_t)plan.width_px << 16 | (uint32_t)plan.height_px);
}

static void run_pictures(int width, int height, int raw_width, int raw_height) {
    const struct calibration rig = rig_of(raw_width, raw_height);
    run_plan(&rig);
    const struct rectify_plan plan = plan_of(&rig, width, height);
    struct picture_clock clock = {0};
    struct pictures pictures = {
        .parallel = &parallel_serial, .now_us = clock_cycles, .clock = &clock};
    for (int i = 0; i < 2; i++) {
        pictures.side[i] = take_side(width, height, raw_width, raw_height);
    }
    paint_stack();
    const struct cost begin = read_cost();
    const int error = pictures_begin(&pictures, &plan, &rig, &working);
    const struct cost prepare = cost_since(&begin);
    INVARIANT(error == ERROR_OK);
    const size_t pixels = (size_t)width * (size_t)height;
    print_stage("prepare", &prepare, (uint32_t)pixels, 0);
    paint_stack();
    pictures_rows(&pictures, 0, height);
    uint32_t crc = 0;
    for (int i = 0; i < 2; i++) {
        crc = crc_update(crc, pictures.side[i].grey.data, pixels);
        crc = crc_update(crc, pictures.side[i].colour.data, 3 * pixels);
    }
    const struct cost develop = {pictures.develop_us, clock.used[1]};
    const struct cost rectify = {pictures.rectify_us, clock.used[2]};
    print_stage("develop", &develop, 2 * (uint32_t)(raw_width * raw_height), crc);
    print_stage("rectify", &rectify, (uint32_t)pixels, crc);
}

// Of a surface as firmware/memory makes it, from frames of `times` its width and height.
static void print_memory(int width, int height, int disparities, int times) {
    const struct calibration rig = rig_of(times * width, times * height);
    struct rectify_plan plan = plan_of(&rig, width, height);
    plan.f_px = plan.fy_px = rig.left.fx_px / times;
    plan.disparity_count = disparities;
    const struct raw_image raw = {.width_px = times * width,
                                  .height_px = times * height,
                                  .stride = times * width,
                                  .bits = RAW_BITS,
                                  .layout = RAW_BAYER_GRBG};
    struct reconstruct_options options = reconstruct_default_options();
    options.preset = MATCH_PRESET_BOARD;
    options.recompute_surface = options.remake_pictures = true;
    const struct reconstruct_need need = reconstruct_needs(&raw, &raw, &rig, &plan, &options, 1);
    const size_t frame_bytes = (size_t)raw.width_px * (size_t)raw.height_px * sizeof *raw.data;
    printf("memory %d %lu %lu\n", times, (unsigned long)need.bytes, 2 * (unsigned long)frame_bytes);
}

int main(int argc, char **argv) {
    INVARIANT(argc == 8);
    int sizes[7];
    for (int i = 0; i < 7; i++) {
        sizes[i] = atoi(argv[i + 1]);
    }
    void *memory = malloc(WORKING_BYTES);
    INVARIANT(memory != NULL);
    arena_init(&working, memory, WORKING_BYTES);
    bf537_l1_lend(&working);
    start_cycles();
    run_matching(sizes[0], sizes[1], sizes[2]);
    run_pictures(sizes[3], sizes[4], sizes[5], sizes[6]);
    print_memory(sizes[0], sizes[1], sizes[2], 1);
    print_memory(sizes[0], sizes[1], sizes[2], 2);
    return 0;
}
