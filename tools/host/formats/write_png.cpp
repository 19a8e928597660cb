// SPDX-License-Identifier: Apache-2.0
#include "tools/host/formats/write_png.hpp"

#include <png.h>

#include <algorithm>
#include <cmath>
#include <csetjmp>
#include <functional>
#include <vector>

#include "core/error.h"
#include "core/invariant.h"
#include "daemon/base/process.h"
#include "daemon/files/output_file.h"
#include "daemon/surface/result/result_figures.h"

namespace {

struct png_shape {
    int width_px, height_px, colour_type, bits;
    const colormap_rgb *palette;  // colours of palette pictures
    int colours;
    const char *comment = nullptr;  // NULL: none
    int transparent = -1;           // palette index; -1: none
};

/// Takes the bytes of the file.
using byte_sink = std::function<void(const unsigned char *bytes, std::size_t length)>;

/// Fills `row` with row y in the file's format (16 bit values most significant byte first).
using row_source = std::function<void(int y, unsigned char *row)>;

[[noreturn]] void on_error(png_structp png, png_const_charp) {
    png_longjmp(png, 1);
}

void on_warning(png_structp, png_const_charp) {}

void on_write(png_structp png, png_bytep bytes, size_t length) {
    // After an interruption, compressing would only delay the exit.
    if (interrupt_requested()) {
        png_error(png, "interrupted");
    }
    (*static_cast<const byte_sink *>(png_get_io_ptr(png)))(bytes, length);
}

void on_flush(png_structp) {}

void set_palette(png_structp png, png_infop info, const png_shape &shape) {
    png_color colours[PNG_MAX_PALETTE_LENGTH];
    INVARIANT(shape.colours >= 1 && shape.colours <= PNG_MAX_PALETTE_LENGTH);
    for (int i = 0; i < shape.colours; i++) {
        const colormap_rgb &c = shape.palette[i];
        colours[i] = {c[0], c[1], c[2]};
    }
    png_set_PLTE(png, info, colours, shape.colours);
    if (shape.transparent >= 0) {
        png_byte alpha[PNG_MAX_PALETTE_LENGTH];
        std::fill_n(alpha, shape.colours, png_byte{255});
        alpha[shape.transparent] = 0;
        png_set_tRNS(png, info, alpha, shape.colours, nullptr);
    }
}

/// Returns false when libpng itself fails, which only happens when memory runs out.
bool encode(const png_shape &shape, const row_source &source, const byte_sink &sink) {
    std::vector<unsigned char> row(
        static_cast<size_t>(shape.width_px) *
        static_cast<size_t>((shape.colour_type == PNG_COLOR_TYPE_RGB ? 3 : 1) * shape.bits / 8));
    png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, nullptr, on_error, on_warning);
    png_infop info = png != nullptr ? png_create_info_struct(png) : nullptr;
    if (info == nullptr || setjmp(png_jmpbuf(png)) != 0) {
        png_destroy_write_struct(&png, &info);
        return false;
    }
    png_set_write_fn(png, const_cast<byte_sink *>(&sink), on_write, on_flush);
    png_set_IHDR(png, info, static_cast<png_uint_32>(shape.width_px),
                 static_cast<png_uint_32>(shape.height_px), shape.bits, shape.colour_type,
                 PNG_INTERLACE_NONE, PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
    if (shape.colour_type == PNG_COLOR_TYPE_PALETTE) {
        set_palette(png, info, shape);
    }
    if (shape.comment != nullptr) {
        png_text text{};
        text.compression = PNG_TEXT_COMPRESSION_NONE;
        text.key = const_cast<char *>("Comment");
        text.text = const_cast<char *>(shape.comment);
        png_set_text(png, info, &text, 1);
    }
    // Half the time of the default level for a few per cent more bytes.
    png_set_compression_level(png, 3);
    png_write_info(png, info);
    for (int y = 0; y < shape.height_px; y++) {
        source(y, row.data());
        png_write_row(png, row.data());
    }
    png_write_end(png, info);
    png_destroy_write_struct(&png, &info);
    return true;
}

int write_file(const png_shape &shape, const row_source &source, const char *path,
               message *message) {
    output_file file;
    output_file_open(&file, path);
    const byte_sink sink = [&file](const unsigned char *bytes, std::size_t length) {
        output_file_write(&file, bytes, length);
    };
    const bool encoded = file.stream == nullptr || encode(shape, source, sink);
    const int error = output_file_close(&file, message);
    if (error == ERROR_OK && !encoded) {
        return message_set(message, ERROR_MEMORY, "%s: out of memory", path);
    }
    return error;
}

void put_u16(unsigned char *bytes, long value) {
    INVARIANT(value >= 0 && value <= 65535);
    bytes[0] = static_cast<unsigned char>(value >> 8);
    bytes[1] = static_cast<unsigned char>(value);
}

/// The comment of every picture of a result whose calibration mismatch was accepted.
const char *comment_of(const reconstruct_context *context) {
    return context->mismatch.text[0] != '\0' ? context->mismatch.text : nullptr;
}

int write_colour(const reconstruct_context *context, const image_rgb8 &image, const char *path,
                 message *message) {
    return write_file(
        {image.width, image.height, PNG_COLOR_TYPE_RGB, 8, nullptr, 0, comment_of(context)},
        [&](int y, unsigned char *row) {
            std::copy_n(image_rgb8_row(&image, y), 3 * image.width, row);
        },
        path, message);
}

}  // namespace

int write_png_disparity(const reconstruct_context *context, const char *path, message *message) {
    const match_output &match = context->result->match;
    const int width = match.reason.width;
    return write_file(
        {width, match.reason.height, PNG_COLOR_TYPE_GRAY, 16, nullptr, 0, comment_of(context)},
        [&](int y, unsigned char *row) {
            const int32_t *disparity_q8 = image_i32_row(&match.disparity_q8, y);
            const uint8_t *reason = image_u8_row(&match.reason, y);
            for (int x = 0; x < width; x++) {
                const bool valid =
                    reason[x] == REASON_VALID && disparity_q8[x] > 0 && disparity_q8[x] <= 65535;
                put_u16(row + 2 * x, valid ? disparity_q8[x] : 0);
            }
        },
        path, message);
}

int write_png_depth(const reconstruct_context *context, const char *path, message *message) {
    const reconstruct_result &result = *context->result;
    const int width = result.match.reason.width;
    uint32_t vertex = 0;  // vertices are in the order of their pixels
    return write_file(
        {width, result.match.reason.height, PNG_COLOR_TYPE_GRAY, 16, nullptr, 0,
         comment_of(context)},
        [&](int y, unsigned char *row) {
            std::fill_n(row, 2 * width, static_cast<unsigned char>(0));
            const uint32_t begin = static_cast<uint32_t>(y * width);
            const uint32_t end = begin + static_cast<uint32_t>(width);
            for (; vertex < result.vertex_count && result.vertex_pixel[vertex] < end; vertex++) {
                INVARIANT(result.vertex_pixel[vertex] >= begin);
                if (surface_figures_is_filled(&result, result.vertex_pixel[vertex])) {
                    continue;
                }
                const long z_mm = std::lround(result.points[vertex].z_um / 1000.0);
                put_u16(row + 2 * (result.vertex_pixel[vertex] - begin),
                        z_mm > 0 && z_mm <= 65535 ? z_mm : 0);
            }
        },
        path, message);
}

int write_png_reasons(const reconstruct_context *context, const char *path, message *message) {
    const image_u8 &reason = context->result->match.reason;
    return write_file(
        {reason.width, reason.height, PNG_COLOR_TYPE_PALETTE, 8, colormap_reasons, REASON_COUNT,
         comment_of(context)},
        [&](int y, unsigned char *row) {
            std::copy_n(image_u8_row(&reason, y), reason.width, row);
        },
        path, message);
}

int write_png_left(const reconstruct_context *context, const char *path, message *message) {
    return write_colour(context, context->result->left_colour, path, message);
}

int write_png_right(const reconstruct_context *context, const char *path, message *message) {
    return write_colour(context, context->result->right_colour, path, message);
}

namespace {

row_source rows_of(int width_px, int height_px, const std::vector<uint8_t> &indices) {
    const auto width = static_cast<size_t>(width_px);
    INVARIANT(indices.size() == width * static_cast<size_t>(height_px));
    return [width, &indices](int y, unsigned char *row) {
        std::copy_n(&indices[static_cast<size_t>(y) * width], width, row);
    };
}

}  // namespace

int write_png_palette(int width_px, int height_px, const std::vector<uint8_t> &indices,
                      const colormap_table &palette, const char *path, message *message) {
    return write_file({width_px, height_px, PNG_COLOR_TYPE_PALETTE, 8, palette.data(),
                       static_cast<int>(palette.size())},
                      rows_of(width_px, height_px, indices), path, message);
}

std::vector<uint8_t> write_png_bytes(int width_px, int height_px,
                                     const std::vector<uint8_t> &indices,
                                     const colormap_table &palette, int transparent) {
    std::vector<uint8_t> png;
    const byte_sink sink = [&png](const unsigned char *bytes, std::size_t length) {
        png.insert(png.end(), bytes, bytes + length);
    };
    const bool encoded = encode({width_px, height_px, PNG_COLOR_TYPE_PALETTE, 8, palette.data(),
                                 static_cast<int>(palette.size()), nullptr, transparent},
                                rows_of(width_px, height_px, indices), sink);
    return encoded ? png : std::vector<uint8_t>();
}
