// SPDX-License-Identifier: Apache-2.0
#include "tools/host/report_encode.hpp"

#include <jpeglib.h>
#include <png.h>
#include <zlib.h>

#include <csetjmp>
#include <cstddef>
#include <cstdio>
#include <cstdlib>

namespace {

/// Ends an image library's work without its usual exit().
struct jpeg_failure {
    jpeg_error_mgr manager;
    std::jmp_buf where;
};

void jpeg_give_up(j_common_ptr info) {
    std::longjmp(reinterpret_cast<jpeg_failure *>(info->err)->where, 1);
}

void jpeg_be_quiet(j_common_ptr) {}

/// Encodes into memory that the caller frees; false on failure. Plain C objects only: an error
/// leaves by longjmp.
bool encode_jpeg(const image_rgb8 &image, int quality, unsigned char **data, unsigned long *size) {
    jpeg_compress_struct compress;
    jpeg_failure failure;
    compress.err = jpeg_std_error(&failure.manager);
    failure.manager.error_exit = jpeg_give_up;
    failure.manager.output_message = jpeg_be_quiet;
    if (setjmp(failure.where) != 0) {
        jpeg_destroy_compress(&compress);
        return false;
    }
    jpeg_create_compress(&compress);
    jpeg_mem_dest(&compress, data, size);
    compress.image_width = static_cast<JDIMENSION>(image.width);
    compress.image_height = static_cast<JDIMENSION>(image.height);
    compress.input_components = 3;
    compress.in_color_space = JCS_RGB;
    jpeg_set_defaults(&compress);
    jpeg_set_quality(&compress, quality, TRUE);
    jpeg_start_compress(&compress, TRUE);
    while (compress.next_scanline < compress.image_height) {
        JSAMPROW row = image_rgb8_row(&image, static_cast<int>(compress.next_scanline));
        jpeg_write_scanlines(&compress, &row, 1);
    }
    jpeg_finish_compress(&compress);
    jpeg_destroy_compress(&compress);
    return true;
}

void append_png_bytes(png_structp png, png_bytep data, png_size_t length) {
    auto *bytes = static_cast<report_bytes *>(png_get_io_ptr(png));
    bytes->insert(bytes->end(), data, data + length);
}

void flush_nothing(png_structp) {}

bool encode_png(int width_px, int height_px, const report_bytes &indices,
                const colormap_table &palette, report_bytes *bytes) {
    png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, nullptr, nullptr, nullptr);
    png_infop info = png != nullptr ? png_create_info_struct(png) : nullptr;
    if (info == nullptr || setjmp(png_jmpbuf(png)) != 0) {
        png_destroy_write_struct(&png, &info);
        return false;
    }
    png_set_write_fn(png, bytes, append_png_bytes, flush_nothing);
    png_set_IHDR(png, info, static_cast<png_uint_32>(width_px), static_cast<png_uint_32>(height_px),
                 8, PNG_COLOR_TYPE_PALETTE, PNG_INTERLACE_NONE, PNG_COMPRESSION_TYPE_DEFAULT,
                 PNG_FILTER_TYPE_DEFAULT);
    png_color colours[256];
    png_byte alpha[256];
    for (std::size_t i = 0; i < 256; i++) {
        colours[i] = {palette[i][0], palette[i][1], palette[i][2]};
        alpha[i] = i == REPORT_TRANSPARENT ? 0 : 255;
    }
    png_set_PLTE(png, info, colours, 256);
    png_set_tRNS(png, info, alpha, 256, nullptr);
    png_write_info(png, info);
    for (std::size_t y = 0; y < static_cast<std::size_t>(height_px); y++)
        png_write_row(png, &indices[y * static_cast<std::size_t>(width_px)]);
    png_write_end(png, info);
    png_destroy_write_struct(&png, &info);
    return true;
}

}  // namespace

std::string report_encode_base64(const report_bytes &bytes) {
    static const char letters[] =
        "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    std::string text;
    text.reserve((bytes.size() + 2) / 3 * 4);
    for (std::size_t i = 0; i < bytes.size(); i += 3) {
        const std::size_t left = bytes.size() - i;
        const unsigned group = static_cast<unsigned>(bytes[i]) << 16 |
                               (left > 1 ? static_cast<unsigned>(bytes[i + 1]) << 8 : 0U) |
                               (left > 2 ? static_cast<unsigned>(bytes[i + 2]) : 0U);
        text.push_back(letters[group >> 18]);
        text.push_back(letters[group >> 12 & 63U]);
        text.push_back(left > 1 ? letters[group >> 6 & 63U] : '=');
        text.push_back(left > 2 ? letters[group & 63U] : '=');
    }
    return text;
}

report_bytes report_encode_deflate(const report_bytes &bytes) {
    uLongf size = compressBound(static_cast<uLong>(bytes.size()));
    report_bytes packed(size);
    if (compress2(packed.data(), &size, bytes.data(), static_cast<uLong>(bytes.size()), 6) != Z_OK)
        return {};
    packed.resize(size);
    return packed;
}

std::string report_encode_png(int width_px, int height_px, const report_bytes &indices,
                              const colormap_table &palette) {
    report_bytes bytes;
    if (!encode_png(width_px, height_px, indices, palette, &bytes))
        return {};
    return "data:image/png;base64," + report_encode_base64(bytes);
}

std::string report_encode_jpeg(const image_rgb8 &image, int quality) {
    unsigned char *data = nullptr;
    unsigned long size = 0;
    std::string uri;
    if (encode_jpeg(image, quality, &data, &size))
        uri = "data:image/jpeg;base64," + report_encode_base64(report_bytes(data, data + size));
    std::free(data);
    return uri;
}
