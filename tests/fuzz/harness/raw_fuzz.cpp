// SPDX-License-Identifier: Apache-2.0
// The first two bytes are width and height, the rest is the file. It is accepted exactly when its
// length fits and no word has more than ten bits; then the pixels are its words.
#include "daemon/images/image_pnm.h"
#include "image_property.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t *data, std::size_t size) {
    if (size < 2 || data[0] == 0 || data[1] == 0) {
        return 0;
    }
    image_request request{};
    request.scale = 1;
    request.raw_width_px = data[0];
    request.raw_height_px = data[1];
    const std::uint8_t *words = data + 2;
    const std::size_t count = std::size_t{data[0]} * data[1];
    bool expected = size - 2 == 2 * count;
    for (std::size_t i = 0; expected && i < count; i++) {
        expected = words[2 * i + 1] < 4;
    }
    bool accepted = false;
    check_image(image_raw_parse, words, size - 2, request, [&](const image_file &file) {
        accepted = true;
        for (std::size_t i = 0; i < count; i++) {
            FUZZ_CHECK(file.image.data[i] == (words[2 * i] | words[2 * i + 1] << 8));
        }
    });
    FUZZ_CHECK(accepted == expected);
    return 0;
}
