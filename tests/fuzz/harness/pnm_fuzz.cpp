// SPDX-License-Identifier: Apache-2.0
// An accepted image written as binary PNM and read again is the same image.
#include <string>

#include "daemon/images/image_pnm.h"
#include "image_property.hpp"

namespace {

std::string as_binary(const raw_image &image) {
    std::string text = image.layout == RAW_RGB ? "P6 " : "P5 ";
    text += std::to_string(image.width_px) + " " + std::to_string(image.height_px) + " " +
            std::to_string((1 << image.bits) - 1) + "\n";
    for (std::ptrdiff_t i = 0; i < image.stride * image.height_px; i++) {
        if (image.bits > 8) {
            text.push_back(static_cast<char>(image.data[i] >> 8));
        }
        text.push_back(static_cast<char>(image.data[i]));
    }
    return text;
}

void check_again(const image_file &first) {
    const std::string text = as_binary(first.image);
    image_request request{};
    request.scale = 1;
    bool same = false;
    check_image(image_pnm_parse, reinterpret_cast<const std::uint8_t *>(text.data()), text.size(),
                request, [&](const image_file &again) {
                    same = again.image.width_px == first.image.width_px &&
                           again.image.bits == first.image.bits &&
                           again.image.stride == first.image.stride &&
                           as_binary(again.image) == text;
                });
    FUZZ_CHECK(same);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t *data, std::size_t size) {
    image_request request{};
    request.scale = 1;
    check_image(image_pnm_parse, data, size, request, check_again);
    request.scale = 0.3;
    request.bits = 10;
    request.bayer = IMAGE_BAYER_GRBG;
    check_image(image_pnm_parse, data, size, request, [](const image_file &file) {
        FUZZ_CHECK(file.image.layout == RAW_BAYER_GRBG && file.image.bits == 10);
    });
    request.bayer = IMAGE_BAYER_NONE;
    check_image(image_pnm_parse, data, size, request, [](const image_file &file) {
        FUZZ_CHECK(file.file_width_px <= IMAGE_MAX_SIDE_PX ||
                   file.image.width_px == file.file_width_px / file.shrink);
    });
    return 0;
}
