// SPDX-License-Identifier: Apache-2.0
#include <stdlib.h>
#include <string.h>

#include "core/crc.h"
#include "core/invariant.h"
#include "daemon/images/picture.h"

enum {
    LITERALS = 256,
    END_OF_BLOCK = LITERALS,
    SYMBOLS = LITERALS + 1,
    NODES = 2 * SYMBOLS,
    CODE_BITS_MAX = 15,   // of deflate
    LENGTH_SYMBOLS = 19,  // of the code that encodes the code lengths
    LENGTH_BITS = 4,      // length of its symbols 0 to 15; the others are unused
    FIRST_LENGTHS = 3,    // symbols 16 to 18 come first
    DEFLATE_HEAD_BITS = 3 + 5 + 5 + 4 + 3 * LENGTH_SYMBOLS + LENGTH_BITS * (SYMBOLS + 1),
    FILTER_PAETH = 4,
    ADLER_MODULUS = 65521,
    ADLER_RUN = 5552,  // bytes before a sum can overflow
    ZLIB_HEAD_BYTES = 2,
    ZLIB_TAIL_BYTES = 4,
    CHUNK_BYTES = 12,  // without its data
    HEAD_BYTES = 13,
    COLOUR_GREY = 0,
    COLOUR_RGB = 2,
    MAX_SIDE_PX = 1 << 17,
};

static const uint8_t signature[] = {0x89, 'P', 'N', 'G', '\r', '\n', 0x1A, '\n'};
static const char software[] = "Software\0vergence";
static const char comment[] = "Comment";

struct code {
    uint16_t bits[SYMBOLS];  // in stream order, the first bit least significant
    uint8_t length[SYMBOLS];
};

struct encoder {
    const struct picture *picture;
    size_t row_bytes;  // including the filter byte
    uint8_t *row;      // filtered
    uint8_t *black;    // the row above the first
    uint64_t count[SYMBOLS];
    uint32_t adler_low, adler_high;
    struct code code;
    uint8_t *out;
    size_t filled;
    uint32_t waiting;  // bits of an incomplete byte
    unsigned waiting_bits;
};

// ---- rows

static uint8_t paeth(int left, int above, int corner) {
    const int estimate = left + above - corner;
    const int from_left = abs(estimate - left);
    const int from_above = abs(estimate - above);
    const int from_corner = abs(estimate - corner);
    if (from_left <= from_above && from_left <= from_corner) {
        return (uint8_t)left;
    }
    return (uint8_t)(from_above <= from_corner ? above : corner);
}

static void filter_row(struct encoder *self, int y) {
    const struct picture *picture = self->picture;
    const size_t channels = (size_t)picture->channels;
    const uint8_t *row = picture->pixels + (size_t)y * picture->row_bytes;
    const uint8_t *above = y > 0 ? row - picture->row_bytes : self->black;
    uint8_t *out = self->row;
    *out++ = FILTER_PAETH;
    for (size_t i = 0; i + 1 < self->row_bytes; i++) {
        const bool first = i < channels;
        const uint8_t guess =
            paeth(first ? 0 : row[i - channels], above[i], first ? 0 : above[i - channels]);
        out[i] = (uint8_t)(row[i] - guess);
    }
}

static void sum_row(struct encoder *self) {
    for (size_t i = 0; i < self->row_bytes;) {
        const size_t left = self->row_bytes - i;
        const size_t end = i + (left < ADLER_RUN ? left : ADLER_RUN);
        for (; i < end; i++) {
            self->adler_low += self->row[i];
            self->adler_high += self->adler_low;
        }
        self->adler_low %= ADLER_MODULUS;
        self->adler_high %= ADLER_MODULUS;
    }
}

static void look_at_rows(struct encoder *self) {
    self->adler_low = 1;
    for (int y = 0; y < self->picture->height_px; y++) {
        filter_row(self, y);
        sum_row(self);
        for (size_t i = 0; i < self->row_bytes; i++) {
            self->count[self->row[i]]++;
        }
    }
    self->count[END_OF_BLOCK] = 1;
}

// ---- Huffman code

// The lightest node without a parent, except `other`.
static int lightest(const uint64_t *weight, const int *parent, int nodes, int other) {
    int found = -1;
    for (int i = 0; i < nodes; i++) {
        if (weight[i] > 0 && parent[i] < 0 && i != other &&
            (found < 0 || weight[i] < weight[found])) {
            found = i;
        }
    }
    return found;
}

// Computes code lengths for these counts. Returns the longest.
static int make_lengths(const uint64_t count[SYMBOLS], uint8_t length[SYMBOLS]) {
    uint64_t weight[NODES] = {0};
    int parent[NODES];
    int nodes = SYMBOLS;
    memcpy(weight, count, SYMBOLS * sizeof *weight);
    for (int i = 0; i < NODES; i++) {
        parent[i] = -1;
    }
    for (;;) {
        const int a = lightest(weight, parent, nodes, -1);
        const int b = lightest(weight, parent, nodes, a);
        if (b < 0) {
            break;
        }
        INVARIANT(nodes < NODES);
        weight[nodes] = weight[a] + weight[b];
        parent[a] = parent[b] = nodes++;
    }
    int longest = 0;
    for (int i = 0; i < SYMBOLS; i++) {
        int depth = 0;
        for (int at = i; parent[at] >= 0; at = parent[at]) {
            depth++;
        }
        length[i] = (uint8_t)depth;
        longest = depth > longest ? depth : longest;
    }
    return longest;
}

static uint16_t reversed(uint32_t bits, unsigned count) {
    uint32_t out = 0;
    for (unsigned i = 0; i < count; i++) {
        out |= (bits >> i & 1U) << (count - 1 - i);
    }
    return (uint16_t)out;
}

static void make_code(struct encoder *self) {
    uint64_t count[SYMBOLS];
    memcpy(count, self->count, sizeof count);
    // Flatten the counts until no code is too long.
    while (make_lengths(count, self->code.length) > CODE_BITS_MAX) {
        for (int i = 0; i < SYMBOLS; i++) {
            count[i] = (count[i] + 1) / 2;
        }
    }
    uint32_t next = 0;
    for (unsigned bits = 1; bits <= CODE_BITS_MAX; bits++, next <<= 1) {
        for (int i = 0; i < SYMBOLS; i++) {
            if (self->code.length[i] == bits) {
                self->code.bits[i] = reversed(next++, bits);
            }
        }
    }
}

// ---- the stream

static void put_bits(struct encoder *self, uint32_t bits, unsigned count) {
    self->waiting |= bits << self->waiting_bits;
    self->waiting_bits += count;
    while (self->waiting_bits >= 8) {
        self->out[self->filled++] = (uint8_t)self->waiting;
        self->waiting >>= 8;
        self->waiting_bits -= 8;
    }
}

static void put_u32(struct encoder *self, uint32_t value) {
    for (int shift = 24; shift >= 0; shift -= 8) {
        self->out[self->filled++] = (uint8_t)(value >> shift);
    }
}

static void put_bytes(struct encoder *self, const void *bytes, size_t length) {
    memcpy(self->out + self->filled, bytes, length);
    self->filled += length;
}

static size_t deflated_bytes(const struct encoder *self) {
    uint64_t bits = DEFLATE_HEAD_BITS;
    for (int i = 0; i < SYMBOLS; i++) {
        bits += self->count[i] * self->code.length[i];
    }
    return (size_t)((bits + 7) / 8);
}

// One block, the last: its code, then the rows.
static void put_deflated(struct encoder *self) {
    put_bits(self, 1, 1);
    put_bits(self, 2, 2);  // dynamic Huffman code
    put_bits(self, SYMBOLS - (LITERALS + 1), 5);
    put_bits(self, 0, 5);  // one distance, unused
    put_bits(self, LENGTH_SYMBOLS - 4, 4);
    for (int i = 0; i < LENGTH_SYMBOLS; i++) {
        put_bits(self, i < FIRST_LENGTHS ? 0 : LENGTH_BITS, 3);
    }
    for (int i = 0; i < SYMBOLS; i++) {
        put_bits(self, reversed(self->code.length[i], LENGTH_BITS), LENGTH_BITS);
    }
    put_bits(self, reversed(1, LENGTH_BITS), LENGTH_BITS);
    for (int y = 0; y < self->picture->height_px; y++) {
        filter_row(self, y);
        for (size_t i = 0; i < self->row_bytes; i++) {
            put_bits(self, self->code.bits[self->row[i]], self->code.length[self->row[i]]);
        }
    }
    put_bits(self, self->code.bits[END_OF_BLOCK], self->code.length[END_OF_BLOCK]);
    put_bits(self, 0, (8 - self->waiting_bits) % 8);
}

// ---- chunks

// Writes the chunk's length and name. Returns the offset of the name.
static size_t begin_chunk(struct encoder *self, size_t length, const char *name) {
    put_u32(self, (uint32_t)length);
    put_bytes(self, name, 4);
    return self->filled - 4;
}

static void end_chunk(struct encoder *self, size_t begin) {
    put_u32(self, crc_update(0, self->out + begin, self->filled - begin));
}

static void put_head(struct encoder *self) {
    const struct picture *picture = self->picture;
    put_bytes(self, signature, sizeof signature);
    size_t chunk = begin_chunk(self, HEAD_BYTES, "IHDR");
    put_u32(self, (uint32_t)picture->width_px);
    put_u32(self, (uint32_t)picture->height_px);
    const uint8_t form[] = {8, picture->channels == 3 ? COLOUR_RGB : COLOUR_GREY, 0, 0, 0};
    put_bytes(self, form, sizeof form);
    end_chunk(self, chunk);
    chunk = begin_chunk(self, sizeof software - 1, "tEXt");
    put_bytes(self, software, sizeof software - 1);
    end_chunk(self, chunk);
    if (picture->text != NULL) {
        const size_t length = strlen(picture->text);
        chunk = begin_chunk(self, sizeof comment + length, "tEXt");
        put_bytes(self, comment, sizeof comment);
        put_bytes(self, picture->text, length);
        end_chunk(self, chunk);
    }
}

static void put_all(struct encoder *self, size_t deflated) {
    static const uint8_t zlib_head[ZLIB_HEAD_BYTES] = {0x78, 0x01};
    put_head(self);
    size_t chunk = begin_chunk(self, ZLIB_HEAD_BYTES + deflated + ZLIB_TAIL_BYTES, "IDAT");
    put_bytes(self, zlib_head, sizeof zlib_head);
    put_deflated(self);
    put_u32(self, self->adler_high << 16 | self->adler_low);
    INVARIANT(self->filled == chunk + 4 + ZLIB_HEAD_BYTES + deflated + ZLIB_TAIL_BYTES);
    end_chunk(self, chunk);
    chunk = begin_chunk(self, 0, "IEND");
    end_chunk(self, chunk);
}

uint8_t *picture_png(const struct picture *picture, size_t *bytes) {
    INVARIANT(picture->channels == 1 || picture->channels == 3);
    INVARIANT(picture->width_px >= 1 && picture->width_px <= MAX_SIDE_PX);
    INVARIANT(picture->height_px >= 1 && picture->height_px <= MAX_SIDE_PX);
    struct encoder self = {.picture = picture};
    self.row_bytes = 1 + (size_t)picture->width_px * (size_t)picture->channels;
    self.row = malloc(self.row_bytes);
    self.black = calloc(self.row_bytes, 1);
    if (self.row != NULL && self.black != NULL) {
        look_at_rows(&self);
        make_code(&self);
        const size_t deflated = deflated_bytes(&self);
        const size_t text =
            picture->text != NULL ? CHUNK_BYTES + sizeof comment + strlen(picture->text) : 0;
        *bytes = sizeof signature + 4 * CHUNK_BYTES + HEAD_BYTES + sizeof software - 1 + text +
                 ZLIB_HEAD_BYTES + deflated + ZLIB_TAIL_BYTES;
        self.out = deflated < INT32_MAX ? malloc(*bytes) : NULL;
        if (self.out != NULL) {
            put_all(&self, deflated);
            INVARIANT(self.filled == *bytes);
        }
    }
    free(self.row);
    free(self.black);
    return self.out;
}

bool picture_png_is_ours(const uint8_t *head, size_t bytes) {
    enum { SOFTWARE_AT = sizeof signature + CHUNK_BYTES + HEAD_BYTES + 4 };
    static const char name[] = "tEXtSoftware\0vergence";
    _Static_assert(SOFTWARE_AT + sizeof name - 1 <= PICTURE_HEAD_BYTES,
                   "the comment lies within the head");
    return bytes >= SOFTWARE_AT + sizeof name - 1 &&
           memcmp(head, signature, sizeof signature) == 0 &&
           memcmp(head + SOFTWARE_AT, name, sizeof name - 1) == 0;
}
