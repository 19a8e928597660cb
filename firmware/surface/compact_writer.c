// SPDX-License-Identifier: Apache-2.0
#include "surface/compact_writer.h"

#include <string.h>

#include "core/crc.h"
#include "core/decimal.h"
#include "core/error.h"
#include "core/invariant.h"

const size_t compact_kind_bytes[] = {
    [COMPACT_FLAG] = sizeof(bool),
    [COMPACT_INT] = sizeof(int),
    [COMPACT_U16] = sizeof(uint16_t),
    [COMPACT_U32] = sizeof(uint32_t),
    [COMPACT_U64] = sizeof(uint64_t),
    [COMPACT_SIZE] = sizeof(size_t),
    [COMPACT_REAL] = sizeof(double),
    [COMPACT_TEXT] = sizeof(char *),
    [COMPACT_LETTERS] = 0,
};

static void put(struct compact_writer *self, const void *bytes, size_t length) {
    self->crc = crc_update(self->crc, bytes, length);
    self->output.put(self->output.self, bytes, length);
}

static void put_word(struct compact_writer *self, const char *word) {
    put(self, word, strlen(word));
}

static void store_u32(uint8_t bytes[4], uint32_t value) {
    for (int i = 0; i < 4; i++) {
        bytes[i] = (uint8_t)(value >> (8 * i));
    }
}

// ---- the head

/// Line feeds and backslashes are written as \\n and \\\\.
void compact_writer_text(struct compact_writer *self, const char *name, const char *text) {
    put_word(self, name);
    put_word(self, " ");
    while (*text != '\0') {
        const size_t plain = strcspn(text, "\n\\");
        put(self, text, plain);
        text += plain;
        if (*text != '\0') {
            put_word(self, *text == '\n' ? "\\n" : "\\\\");
            text++;
        }
    }
    put_word(self, "\n");
}

/// Every bit of it, as C's %a does.
static void put_real(struct compact_writer *self, double value) {
    enum { FRACTION_BITS = 52, DIGITS = FRACTION_BITS / 4, BIAS = 1023 };
    static const char digits[] = "0123456789abcdef";
    char text[DIGITS + 1], exponent[DECIMAL_TEXT_BYTES];
    uint64_t bits;
    _Static_assert(sizeof bits == sizeof value, "a double has 64 bits");
    memcpy(&bits, &value, sizeof bits);
    const int biased = (int)(bits >> FRACTION_BITS & 0x7FF);
    const uint64_t fraction = bits & ((UINT64_C(1) << FRACTION_BITS) - 1);
    put_word(self, bits >> 63 != 0 ? " -" : " ");
    if (biased == 0x7FF) {
        put_word(self, fraction != 0 ? "nan" : "inf");
        return;
    }
    for (int i = 0; i < DIGITS; i++) {
        text[i] = digits[fraction >> (FRACTION_BITS - 4 - 4 * i) & 0xF];
    }
    text[DIGITS] = '\0';
    const int least = fraction != 0 ? 1 - BIAS : 0;
    decimal_print_integer(biased != 0 ? biased - BIAS : least, exponent);
    put_word(self, biased != 0 ? "0x1." : "0x0.");
    put_word(self, text);
    put_word(self, "p");
    put_word(self, exponent);
}

static int64_t integer_at(enum compact_kind kind, const char *at) {
    switch (kind) {
        case COMPACT_FLAG:
            return *(const bool *)at;
        case COMPACT_U16:
            return *(const uint16_t *)(const void *)at;
        case COMPACT_U32:
            return *(const uint32_t *)(const void *)at;
        case COMPACT_U64:
            return (int64_t) * (const uint64_t *)(const void *)at;
        case COMPACT_SIZE:
            return (int64_t) * (const size_t *)(const void *)at;
        default:
            return *(const int *)(const void *)at;
    }
}

static void put_field(struct compact_writer *self, const struct compact_field *field,
                      const char *at) {
    if (field->kind == COMPACT_TEXT || field->kind == COMPACT_LETTERS) {
        const char *text =
            field->kind == COMPACT_TEXT ? *(const char *const *)(const void *)at : at;
        if (text != NULL) {
            compact_writer_text(self, field->name, text);
        }
        return;
    }
    put_word(self, field->name);
    for (int i = 0; i < field->count; i++, at += compact_kind_bytes[field->kind]) {
        char text[DECIMAL_TEXT_BYTES];
        if (field->kind == COMPACT_REAL) {
            put_real(self, *(const double *)(const void *)at);
            continue;
        }
        decimal_print_integer(integer_at(field->kind, at), text);
        put_word(self, " ");
        put_word(self, text);
    }
    put_word(self, "\n");
}

void compact_writer_begin(struct compact_writer *self, const struct compact_output *output) {
    char version[DECIMAL_TEXT_BYTES];
    *self = (struct compact_writer){.output = *output};
    decimal_print_integer(COMPACT_VERSION, version);
    put_word(self, COMPACT_MAGIC);
    put_word(self, version);
    put_word(self, "\n");
}

void compact_writer_fields(struct compact_writer *self, const struct compact_field *fields,
                           size_t count, const void *record) {
    for (size_t i = 0; i < count; i++) {
        put_field(self, &fields[i], (const char *)record + fields[i].offset);
    }
}

int compact_writer_calibration(struct compact_writer *self, const struct calibration *calibration) {
    char text[CALIBRATION_TEXT_MAX_BYTES], length_text[DECIMAL_TEXT_BYTES];
    const int length = calibration_print(calibration, text, sizeof text);
    if (length < 0) {
        return length;
    }
    decimal_print_integer(length, length_text);
    compact_writer_text(self, "calibration", length_text);
    put(self, text, (size_t)length);
    put_word(self, "rows\n");
    return ERROR_OK;
}

// ---- the rows

/// Its packed length, then the bytes.
static void put_chunk(struct compact_writer *self, uint8_t *bytes, size_t length, uint8_t *packed) {
    uint8_t packed_length[4];
    const size_t packed_bytes = self->output.pack(self->output.self, bytes, length, packed);
    store_u32(packed_length, (uint32_t)packed_bytes);
    put(self, packed_length, sizeof packed_length);
    put(self, packed, packed_bytes);
}

static void gather_row(struct compact_band *band, const struct reconstruct_result *result, int y,
                       uint8_t *reason) {
    const size_t width = (size_t)band->width;
    const uint8_t *rgb = reconstruct_colour_row(result, y);
    const uint8_t *confidence = image_u8_row(&result->match.confidence, y);
    const uint8_t *sigma = image_u8_row(&result->sigma, y);
    memcpy(reason, image_u8_row(&result->match.reason, y), width);
    memcpy(band->row[COMPACT_DISPARITY][1], image_i32_row(&result->match.disparity_q8, y),
           width * sizeof(int32_t));
    for (size_t x = 0; x < width; x++) {
        const int32_t green = rgb[3 * x + 1];
        band->row[COMPACT_CONFIDENCE][1][x] = confidence[x];
        band->row[COMPACT_SIGMA][1][x] = subpixel_sigma_q8(sigma[x]);
        band->row[COMPACT_GREEN][1][x] = green;
        band->row[COMPACT_RED][1][x] = compact_wrap(rgb[3 * x] - green, 1, true);
        band->row[COMPACT_BLUE][1][x] = compact_wrap(rgb[3 * x + 2] - green, 1, true);
    }
    for (int i = 0; i < COMPACT_CHANNELS; i++) {
        compact_encode(band, (enum compact_channel)i, reason, y == 0);
    }
}

void compact_writer_rows(struct compact_writer *self, const struct reconstruct_result *result,
                         void *memory, uint8_t *packed) {
    compact_band_lay(result->plan.width_px, memory, &self->band);
    self->result = result;
    self->packed = packed;
    self->rows = 0;
}

int compact_writer_band(struct compact_writer *self) {
    struct compact_band *band = &self->band;
    const int height = self->result->plan.height_px;
    const int end = height - self->rows < band->rows_max ? height : self->rows + band->rows_max;
    uint8_t *reason = band->reason;
    INVARIANT(self->rows < height);
    memset(band->used, 0, sizeof band->used);
    for (; self->rows < end; self->rows++, reason += band->width) {
        gather_row(band, self->result, self->rows, reason);
    }
    put_chunk(self, band->reason, (size_t)(reason - band->reason), self->packed);
    for (int i = 0; i < COMPACT_CHANNELS; i++) {
        for (int byte = 0; byte < compact_forms[i].bytes; byte++) {
            put_chunk(self, band->chunk[i][byte], band->used[i], self->packed);
        }
    }
    if (end == height) {
        uint8_t crc[COMPACT_CRC_BYTES];
        store_u32(crc, self->crc);
        self->output.put(self->output.self, crc, sizeof crc);
    }
    return end;
}

// ---- without zlib

size_t compact_stored(void *self, uint8_t *bytes, size_t length, uint8_t *packed) {
    enum { ADLER_MODULUS = 65521, LAST_STORED = 1 };
    static const uint8_t head[] = {0x18, 0x19};  // deflate with a window of 512 bytes, a check
    uint8_t *at = packed;
    uint32_t a = 1, b = 0;
    (void)self;
    INVARIANT(length <= UINT16_MAX);
    memcpy(at, head, sizeof head);
    at += sizeof head;
    *at++ = LAST_STORED;
    *at++ = (uint8_t)length;
    *at++ = (uint8_t)(length >> 8);
    *at++ = (uint8_t)~length;
    *at++ = (uint8_t)(~length >> 8);
    memcpy(at, bytes, length);
    at += length;
    for (size_t i = 0; i < length; i++) {
        a += bytes[i];
        a -= a >= ADLER_MODULUS ? ADLER_MODULUS : 0;
        b += a;
        b -= b >= ADLER_MODULUS ? ADLER_MODULUS : 0;
    }
    const uint32_t adler = b << 16 | a;
    for (int shift = 24; shift >= 0; shift -= 8) {
        *at++ = (uint8_t)(adler >> shift);
    }
    return (size_t)(at - packed);
}

size_t compact_stored_rows_bytes(int width, int height) {
    const size_t band_rows = compact_band_pixels(width) / (size_t)width;
    const size_t bands = ((size_t)height + band_rows - 1) / band_rows;
    size_t chunks = 1;  // of a byte of every pixel: its reason, then its values
    for (int i = 0; i < COMPACT_CHANNELS; i++) {
        chunks += (size_t)compact_forms[i].bytes;
    }
    return chunks * (bands * (sizeof(uint32_t) + COMPACT_STORED_MORE_BYTES) +
                     (size_t)width * (size_t)height) +
           COMPACT_CRC_BYTES;
}
