// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <memory>

#include "core/error.h"
#include "stereo/image/debayer.h"
#include "tools/host/calibrate/calibrate_views.hpp"
#include "tools/host/formats/image_formats.hpp"

namespace {

const int max_shrink = 8;  // ratio of the largest file's side to the core's

struct file_closer {
    void operator()(image_file *file) const {
        image_file_free(file);
        delete file;
    }
};
using file_owner = std::unique_ptr<image_file, file_closer>;

/// Values have at least eight bits; brighter values lose their lowest bits.
int surplus_bits(uint16_t brightest) {
    int bits = 8;
    while (brightest >> bits != 0) {
        bits++;
    }
    return bits - 8;
}

/// Grey of one pixel with the weights of television, in 1/65536.
uint8_t grey_of(const uint16_t rgb[3], int surplus) {
    const uint32_t sum = 19595u * rgb[0] + 38470u * rgb[1] + 7471u * rgb[2] + 32768u;
    return static_cast<uint8_t>(std::min(sum >> 16 >> surplus, 255u));
}

void grey_rows(const image_file &file, std::vector<uint8_t> *grey) {
    const raw_image &image = file.image;
    const size_t width = static_cast<size_t>(image.width_px);
    const int surplus = surplus_bits(file.brightest);
    const bool mosaic = image.layout == RAW_BAYER_GRBG;
    std::vector<uint16_t> rgb(mosaic ? 3 * width : 0);
    std::vector<int32_t> work(mosaic ? 3 * (width + DEBAYER_MARGIN_PX) : 0);
    const image_u16 raw = {file.pixels, image.width_px, image.height_px, image.stride};
    grey->resize(width * static_cast<size_t>(image.height_px));
    uint8_t *to = grey->data();
    for (int y = 0; y < image.height_px; y++) {
        const uint16_t *from = image.data + y * image.stride;
        if (mosaic) {
            debayer_row(&raw, image.bits, y, rgb.data(), work.data());
            from = rgb.data();
        }
        for (size_t x = 0; x < width; x++) {
            *to++ = image.layout == RAW_GREY ? static_cast<uint8_t>(from[x] >> surplus)
                                             : grey_of(from + 3 * x, surplus);
        }
    }
}

}  // namespace

bool calibrate_image_read(const std::string &path, bool mosaic, calibrate_image *image,
                          std::string *error) {
    const image_format_list formats = image_formats();
    image_request request{};
    request.bayer = mosaic ? IMAGE_BAYER_GRBG : IMAGE_BAYER_BY_FORMAT;
    const file_owner file(new image_file{});
    message last_error{};
    int code = ERROR_TOO_LARGE;
    for (int shrink = 1; code == ERROR_TOO_LARGE && shrink <= max_shrink; shrink++) {
        request.scale = 1.0 / shrink;
        code = image_file_read(path.c_str(), formats.first, formats.count, &request, file.get(),
                               &last_error);
    }
    if (code != ERROR_OK) {
        *error = last_error.text;
        return false;
    }
    image->width_px = file->image.width_px;
    image->height_px = file->image.height_px;
    image->file_width_px = file->file_width_px;
    image->file_height_px = file->file_height_px;
    image->shrink = file->shrink;
    image->full_scale = ((1 << file->image.bits) - 1) >> surplus_bits(file->brightest);
    image->orientation = file->orientation;
    grey_rows(*file, &image->grey);
    return true;
}

void calibrate_image_enlarge(calibrate_image *image) {
    if (image->shrink == 1) {
        return;
    }
    std::vector<uint8_t> large;
    large.reserve(static_cast<size_t>(image->file_width_px) *
                  static_cast<size_t>(image->file_height_px));
    for (int y = 0; y < image->file_height_px; y++) {
        // Pixels that did not fill a whole block when the picture was shrunk repeat the last one.
        const int from_y = std::min(y / image->shrink, image->height_px - 1);
        const uint8_t *row = image->grey.data() + size_t(from_y) * size_t(image->width_px);
        for (int x = 0; x < image->file_width_px; x++) {
            large.push_back(row[std::min(x / image->shrink, image->width_px - 1)]);
        }
    }
    image->grey.swap(large);
    image->width_px = image->file_width_px;
    image->height_px = image->file_height_px;
    image->shrink = 1;
}
