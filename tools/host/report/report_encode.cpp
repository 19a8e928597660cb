// SPDX-License-Identifier: Apache-2.0
#include "tools/host/report/report_encode.hpp"

#include <png.h>
#include <zlib.h>

#include <csetjmp>
#include <cstddef>

#include "daemon/base/base64.h"
#include "tools/host/formats/image_jpeg.hpp"

namespace {

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
    for (std::size_t y = 0; y < static_cast<std::size_t>(height_px); y++) {
        png_write_row(png, &indices[y * static_cast<std::size_t>(width_px)]);
    }
    png_write_end(png, info);
    png_destroy_write_struct(&png, &info);
    return true;
}

}  // namespace

std::string report_encode_base64(const report_bytes &bytes) {
    std::string text(BASE64_TEXT_BYTES(bytes.size()), '\0');
    base64_encode(bytes.data(), bytes.size(), text.data());
    text.pop_back();  // the terminating zero
    return text;
}

report_bytes report_encode_deflate(const report_bytes &bytes) {
    uLongf size = compressBound(static_cast<uLong>(bytes.size()));
    report_bytes packed(size);
    if (compress2(packed.data(), &size, bytes.data(), static_cast<uLong>(bytes.size()), 6) !=
        Z_OK) {
        return {};
    }
    packed.resize(size);
    return packed;
}

std::string report_encode_png(int width_px, int height_px, const report_bytes &indices,
                              const colormap_table &palette) {
    report_bytes bytes;
    if (!encode_png(width_px, height_px, indices, palette, &bytes)) {
        return {};
    }
    return "data:image/png;base64," + report_encode_base64(bytes);
}

std::string report_encode_jpeg(const image_rgb8 &image, int quality) {
    const report_bytes bytes = image_jpeg_encode(image, quality);
    if (bytes.empty()) {
        return {};
    }
    return "data:image/jpeg;base64," + report_encode_base64(bytes);
}
