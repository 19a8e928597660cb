// SPDX-License-Identifier: Apache-2.0
#include <errno.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <zlib.h>

#include "core/arena.h"
#include "core/crc.h"
#include "core/error.h"
#include "core/invariant.h"
#include "daemon/files/input_file.h"
#include "daemon/surface/result/compact.h"
#include "stereo/surface.h"

enum { DISPARITY_Q8_MAX = (MATCH_DISPARITY_LIMIT + MATCH_MAX_DISPARITIES) * 256 };

struct reader {
    const char *path;
    uint8_t *bytes;  // the file
    size_t length;
    const uint8_t *at, *end;  // what is left of the rows
    struct compact_band band;
    void *band_memory;
    struct compact *compact;
    struct message *message;
};

bool compact_is(const char *path) {
    char start[sizeof COMPACT_MAGIC];
    size_t length = 0;
    struct message ignored;
    return input_file_read(path, start, sizeof start, &length, &ignored) == ERROR_OK &&
           length == sizeof start && memcmp(start, COMPACT_MAGIC, sizeof COMPACT_MAGIC - 1) == 0;
}

static int damaged(const struct reader *self) {
    return message_set(self->message, ERROR_CRC,
                       "%s: truncated or damaged (fetch or copy it again)", self->path);
}

static uint32_t get_u32(const uint8_t *bytes) {
    return (uint32_t)bytes[0] | (uint32_t)bytes[1] << 8 | (uint32_t)bytes[2] << 16 |
           (uint32_t)bytes[3] << 24;
}

/// Reads the whole file, with a zero after it.
static int load(struct reader *self) {
    FILE *stream = input_file_open(self->path, self->message);
    struct stat about;
    if (stream == NULL) {
        return ERROR_ARGUMENT;
    }
    const bool known = fstat(fileno(stream), &about) == 0 && about.st_size >= 0;
    const size_t size = known ? (size_t)about.st_size : 0;
    self->bytes = malloc(size + 1);
    self->length = self->bytes != NULL ? fread(self->bytes, 1, size, stream) : 0;
    const bool failed = !known || ferror(stream) != 0;
    fclose(stream);
    if (self->bytes == NULL) {
        return message_set(self->message, ERROR_MEMORY, "%s: out of memory", self->path);
    }
    self->bytes[self->length] = '\0';
    return failed
               ? message_set(self->message, ERROR_ARGUMENT, "%s: %s", self->path, strerror(errno))
               : ERROR_OK;
}

/// Checks the first line and the CRC.
static int check(const struct reader *self) {
    const size_t magic = sizeof COMPACT_MAGIC - 1;
    if (self->length < magic || memcmp(self->bytes, COMPACT_MAGIC, magic) != 0) {
        return message_set(self->message, ERROR_SYNTAX, "%s: not a compact surface", self->path);
    }
    const long version = strtol((const char *)self->bytes + magic, NULL, 10);
    if (version > COMPACT_VERSION) {
        return message_set(self->message, ERROR_VERSION,
                           "%s: a compact surface of version %ld; this program reads version %d "
                           "(use a newer one)",
                           self->path, version, COMPACT_VERSION);
    }
    const size_t summed = self->length - COMPACT_CRC_BYTES;
    return version == COMPACT_VERSION &&
                   crc_update(0, self->bytes, summed) == get_u32(self->bytes + summed)
               ? ERROR_OK
               : damaged(self);
}

/// Inflates the next chunk to exactly `length` bytes.
static bool get_chunk(struct reader *self, uint8_t *bytes, size_t length) {
    uLongf inflated = (uLongf)length;
    if (self->end - self->at < 4) {
        return false;
    }
    const size_t packed = get_u32(self->at);
    self->at += 4;
    if ((size_t)(self->end - self->at) < packed) {
        return false;
    }
    uint8_t none = 0;
    const int code = uncompress(length > 0 ? bytes : &none, &inflated, self->at, (uLong)packed);
    self->at += packed;
    return code == Z_OK && inflated == length;
}

/// The reasons of a band are there: reads its other chunks.
static bool get_channels(struct reader *self, size_t pixels) {
    struct compact_band *band = &self->band;
    size_t kept = 0;
    for (size_t i = 0; i < pixels; i++) {
        if (band->reason[i] >= REASON_COUNT) {
            return false;
        }
        kept += compact_is_kept(COMPACT_DISPARITY, band->reason[i]);
    }
    for (int i = 0; i < COMPACT_CHANNELS; i++) {
        for (int byte = 0; byte < compact_forms[i].bytes; byte++) {
            if (!get_chunk(self, band->chunk[i][byte], i == COMPACT_DISPARITY ? kept : pixels)) {
                return false;
            }
        }
    }
    memset(band->used, 0, sizeof band->used);
    return true;
}

/// False: a disparity or a sigma that no matcher finds.
static bool spread_row(struct reader *self, int y, const uint8_t *reason) {
    struct compact_band *band = &self->band;
    const struct reconstruct_result *result = &self->compact->result;
    const size_t width = (size_t)band->width;
    uint8_t *rgb = image_rgb8_row(&result->left_colour, y);
    uint8_t *confidence = image_u8_row(&result->match.confidence, y);
    uint8_t *sigma = image_u8_row(&result->sigma, y);
    int32_t *disparity_q8 = image_i32_row(&result->match.disparity_q8, y);
    for (int i = 0; i < COMPACT_CHANNELS; i++) {
        compact_decode(band, (enum compact_channel)i, reason, y == 0);
    }
    memcpy(image_u8_row(&result->match.reason, y), reason, width);
    for (size_t x = 0; x < width; x++) {
        const int32_t green = band->row[COMPACT_GREEN][0][x];
        confidence[x] = (uint8_t)band->row[COMPACT_CONFIDENCE][0][x];
        sigma[x] = subpixel_sigma_code(band->row[COMPACT_SIGMA][0][x]);
        rgb[3 * x] = (uint8_t)(green + band->row[COMPACT_RED][0][x]);
        rgb[3 * x + 1] = (uint8_t)green;
        rgb[3 * x + 2] = (uint8_t)(green + band->row[COMPACT_BLUE][0][x]);
        disparity_q8[x] = band->row[COMPACT_DISPARITY][0][x];
        if (subpixel_sigma_q8(sigma[x]) != band->row[COMPACT_SIGMA][0][x] ||
            disparity_q8[x] < -DISPARITY_Q8_MAX || disparity_q8[x] > DISPARITY_Q8_MAX) {
            return false;
        }
    }
    return true;
}

static bool get_rows(struct reader *self) {
    struct compact_band *band = &self->band;
    struct reconstruct_result *result = &self->compact->result;
    const int height = result->plan.height_px;
    for (int y = 0; y < height;) {
        const int end = height - y < band->rows_max ? height : y + band->rows_max;
        const size_t pixels = (size_t)(end - y) * (size_t)band->width;
        const uint8_t *reason = band->reason;
        if (!get_chunk(self, band->reason, pixels) || !get_channels(self, pixels)) {
            return false;
        }
        for (size_t i = 0; i < pixels; i++) {
            result->reason_count[reason[i]]++;
        }
        for (; y < end; y++, reason += band->width) {
            if (!spread_row(self, y, reason)) {
                return false;
            }
        }
    }
    return self->at == self->end;
}

/// Takes the maps from `arena`.
static void take_maps(struct arena *arena, struct reconstruct_result *result) {
    const int width = result->plan.width_px, height = result->plan.height_px;
    const size_t pixels = (size_t)width * (size_t)height;
    struct match_output *match = &result->match;
    match->disparity_q8 =
        (struct image_i32){arena_take(arena, pixels, sizeof(int32_t)), width, height, width};
    match->reason = (struct image_u8){arena_take(arena, pixels, 1), width, height, width};
    match->confidence = (struct image_u8){arena_take(arena, pixels, 1), width, height, width};
    result->sigma = (struct image_u8){arena_take(arena, pixels, 1), width, height, width};
    result->left_colour =
        (struct image_rgb8){arena_take(arena, pixels, 3), width, height, (ptrdiff_t)3 * width};
    result->left = result->right = (struct image_u8){NULL, width, height, width};
    result->right_colour = (struct image_rgb8){NULL, width, height, (ptrdiff_t)3 * width};
}

/// Points, normals and triangles, as many as there were.
static int make_surface(struct reader *self, const struct parallel *parallel, struct arena *arena) {
    struct reconstruct_result *result = &self->compact->result;
    const struct surface_depths all = surface_depths_of(0, 0);
    const uint32_t vertices = result->vertex_count, triangles = result->triangle_count;
    result->vertex_count = result->triangle_count = 0;
    int error = surface_triangulate(parallel, arena, &all, false, result);
    error = error == ERROR_OK ? surface_mesh(arena, result) : error;
    INVARIANT(error != ERROR_MEMORY);
    const bool same = result->vertex_count == vertices && result->triangle_count == triangles;
    return error == ERROR_OK && same
               ? ERROR_OK
               : message_set(self->message, ERROR_SYNTAX, "%s: its pixels do not give its surface",
                             self->path);
}

static int make_result(struct reader *self, const struct parallel *parallel) {
    struct reconstruct_result *result = &self->compact->result;
    const int width = result->plan.width_px, height = result->plan.height_px;
    const size_t pixels = (size_t)width * (size_t)height;
    const size_t bytes =
        5 * arena_need_bytes(pixels, 4) + surface_need_bytes(width, height, pixels);
    struct arena arena;
    self->compact->memory = malloc(bytes);
    self->band_memory = calloc(1, compact_band_bytes(width));
    if (self->compact->memory == NULL || self->band_memory == NULL) {
        return message_set(self->message, ERROR_MEMORY, "%s: out of memory", self->path);
    }
    compact_band_lay(width, self->band_memory, &self->band);
    arena_init(&arena, self->compact->memory, bytes);
    take_maps(&arena, result);
    return get_rows(self)
               ? make_surface(self, parallel, &arena)
               : message_set(self->message, ERROR_SYNTAX, "%s: its rows are wrong", self->path);
}

static int read_all(struct reader *self, const struct parallel *parallel) {
    int line = 0;
    int error = load(self);
    error = error == ERROR_OK ? check(self) : error;
    if (error != ERROR_OK) {
        return error;
    }
    struct compact *compact = self->compact;
    self->end = self->bytes + self->length - COMPACT_CRC_BYTES;
    compact->head = (char *)self->bytes;
    const size_t head = compact_head_parse(compact, &line);
    if (head == 0) {
        return message_set(self->message, ERROR_SYNTAX, "%s: line %d is wrong", self->path, line);
    }
    self->at = self->bytes + head;
    return make_result(self, parallel);
}

int compact_read(const char *path, const struct parallel *parallel, struct compact **compact,
                 struct message *message) {
    struct reader self = {.path = path, .message = message};
    self.compact = calloc(1, sizeof *self.compact);
    int error = self.compact == NULL ? message_set(message, ERROR_MEMORY, "%s: out of memory", path)
                                     : read_all(&self, parallel);
    free(self.band_memory);
    if (error != ERROR_OK) {
        free(self.bytes);
        if (self.compact != NULL) {
            self.compact->head = NULL;
        }
        compact_free(self.compact);
        self.compact = NULL;
    }
    *compact = self.compact;
    return error;
}

void compact_free(struct compact *compact) {
    if (compact != NULL) {
        free(compact->head);
        free(compact->memory);
        free(compact);
    }
}
