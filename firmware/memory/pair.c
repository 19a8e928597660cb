// SPDX-License-Identifier: Apache-2.0
#include "memory/pair.h"

#include <string.h>

#include "console/pair/capture.h"
#include "core/arena.h"
#include "core/error.h"
#include "core/invariant.h"
#include "memory/files.h"

enum { HEAD_BYTES = 32, NAME_BYTES = 24, VALUE_BYTES = 2 };

static struct arena arena;

/// Pairs that a measurement keeps, at the beginning of the arena.
static struct {
    bool keeps;  // a measurement is under way
    struct pair pair[MEMORY_KEPT];
    bool taken[MEMORY_KEPT];
    uint16_t *data[MEMORY_KEPT][RIG_SIDES];
    size_t used_bytes;  // of the arena
} kept;

/// The last pair. Merged frames are behind those that are kept.
static struct {
    struct pair pair;
    bool taken;
    char name[NAME_BYTES];
    unsigned lent;      // images in the arena
    size_t used_bytes;  // of the arena, by these
} last;

void memory_pair_begin(const struct arena *lent) {
    arena = *lent;
}

const struct pair *memory_pair_last(const char **name) {
    *name = last.name;
    return last.taken ? &last.pair : NULL;
}

struct arena *memory_pair_arena(void) {
    memory_files_remove(MEMORY_FILE_SURFACE);
    arena_release(&arena, last.used_bytes);
    return &arena;
}

struct arena *memory_pair_arena_rest(void) {
    return &arena;
}

// ---- pairs that are kept

static void forget(void);

bool memory_pair_begin_keeping(int width_px, int height_px) {
    const size_t values = (size_t)width_px * (size_t)height_px;
    bool enough = true;
    kept.keeps = false;
    forget();
    for (int i = 0; i < MEMORY_KEPT; i++) {
        for (int side = 0; side < RIG_SIDES; side++) {
            kept.data[i][side] = arena_take(&arena, values, sizeof(uint16_t));
            enough = enough && kept.data[i][side] != NULL;
        }
    }
    kept.keeps = enough;
    kept.used_bytes = enough ? arena_mark(&arena) : 0;
    last.used_bytes = kept.used_bytes;
    arena_release(&arena, kept.used_bytes);
    return enough;
}

void memory_pair_end_keeping(void) {
    kept.keeps = false;
}

void memory_pair_keep(enum memory_kept which) {
    struct pair *pair = &kept.pair[which];
    INVARIANT(kept.keeps && last.taken);
    *pair = last.pair;
    for (int side = 0; side < RIG_SIDES; side++) {
        struct raw_image *image = &pair->frame[side].image;
        const size_t row_bytes = VALUE_BYTES * (size_t)image->width_px;
        for (int row = 0; row < image->height_px; row++) {
            memcpy(kept.data[which][side] + (size_t)row * (size_t)image->width_px,
                   raw_image_row(image, row), row_bytes);
        }
        image->data = kept.data[which][side];
        image->stride = image->width_px;
        image->release = NULL;
        image->owner = NULL;
    }
    kept.taken[which] = true;
}

const struct pair *memory_pair_numbered(uint32_t number) {
    for (int i = 0; i < MEMORY_KEPT; i++) {
        if (kept.taken[i] && kept.pair[i].number == number) {
            return &kept.pair[i];
        }
    }
    return last.taken && last.pair.number == number ? &last.pair : NULL;
}

// ---- files of the pair

/// A PGM file: the head, then values of two bytes, the higher one first.
static size_t image_head(const struct raw_image *image, char head[HEAD_BYTES]) {
    struct command_text text = command_text_begin(head, HEAD_BYTES);
    command_text_add(&text, "P5\n");
    command_text_add_integer(&text, image->width_px);
    command_text_add(&text, " ");
    command_text_add_integer(&text, image->height_px);
    command_text_add(&text, "\n");
    command_text_add_integer(&text, (1 << image->bits) - 1);
    command_text_add(&text, "\n");
    return text.length;
}

static void read_image(const void *source, size_t offset, void *to, size_t bytes) {
    const struct raw_image *image = source;
    char head[HEAD_BYTES];
    uint8_t *out = to;
    const size_t head_bytes = image_head(image, head),
                 row_bytes = VALUE_BYTES * (size_t)image->width_px;
    for (; bytes > 0 && offset < head_bytes; bytes--) {
        *out++ = (uint8_t)head[offset++];
    }
    size_t row = (offset - head_bytes) / row_bytes, at = (offset - head_bytes) % row_bytes;
    for (; bytes > 0; row++, at = 0) {
        const uint16_t *values = raw_image_row(image, (int)row);
        for (; bytes > 0 && at < row_bytes; at++, bytes--) {
            const uint16_t value = values[at / VALUE_BYTES];
            *out++ = (uint8_t)(at % VALUE_BYTES == 0 ? value >> 8 : value);
        }
    }
}

static void put_image(enum memory_file file, const char *name, const struct raw_image *image) {
    char head[HEAD_BYTES];
    const size_t values = (size_t)image->width_px * (size_t)image->height_px;
    memory_files_put(file, last.name, name, read_image, image,
                     image_head(image, head) + VALUE_BYTES * values);
}

// ---- capture

static void forget(void) {
    if (last.taken) {
        pair_release(last.pair.frame);
    }
    if (!kept.keeps) {
        memset(&kept, 0, sizeof kept);
    }
    last.taken = false;
    last.used_bytes = kept.used_bytes;
    (void)memory_pair_arena();
    memory_files_remove(MEMORY_FILE_LEFT);
    memory_files_remove(MEMORY_FILE_RIGHT);
}

static void *lend(size_t bytes) {
    void *memory = arena_take(&arena, bytes, 1);
    last.lent += memory != NULL;
    return memory;
}

static void give_back(void *memory) {
    INVARIANT(memory == NULL || last.lent > 0);
    last.lent -= memory != NULL;
    if (last.lent == 0) {
        arena_release(&arena, kept.used_bytes);
    }
}

static int run_capture(const struct command_call *call) {
    static const struct pair_memory memory = {lend, give_back};
    static struct registers_all registers;
    const struct command_value *values = call->values;
    const struct pair_options options = capture_options(values, &memory);
    if (values[CAPTURE_NAME].given || command_is_set(&values[CAPTURE_ADD])) {
        return command_refuse(
            call, ERROR_UNSUPPORTED,
            "capture: there is no disk for sessions (omit NAME and add; \"fetch\" copies "
            "the pair)");
    }
    if (values[CAPTURE_AVERAGE].given && values[CAPTURE_BRACKET].given) {
        return command_refuse(call, ERROR_ARGUMENT,
                              "capture: average and bracket exclude each other (omit one)");
    }
    forget();
    const int error = capture_take(call->rig, &options, &last.pair, &registers);
    if (error != ERROR_OK) {
        return error;
    }
    last.taken = true;
    last.used_bytes = arena_mark(&arena);
    struct command_text name = command_text_begin(last.name, sizeof last.name);
    command_text_add(&name, "pair-");
    command_text_add_integer(&name, last.pair.number);
    put_image(MEMORY_FILE_LEFT, "left.pgm", &last.pair.frame[RIG_LEFT].image);
    put_image(MEMORY_FILE_RIGHT, "right.pgm", &last.pair.frame[RIG_RIGHT].image);
    capture_reply(call, &last.pair);
    return ERROR_OK;
}

const struct command *memory_pair_table(size_t *count) {
    static const struct command commands[] = {
        {.name = "capture",
         .summary = "capture a pair of frames",
         .help =
             "Keeps the pair in memory until the next capture, as the files pair-N/left.pgm and "
             "right.pgm. Fails if something moved between the frames.",
         .arguments = capture_arguments,
         .argument_count = CAPTURE_ARGUMENTS,
         .flags = COMMAND_NEEDS_RIG | COMMAND_LONG | COMMAND_MOVES | COMMAND_GROUP_MEASURE |
                  COMMAND_DAILY,
         .run = run_capture},
    };
    *count = sizeof commands / sizeof commands[0];
    return commands;
}
