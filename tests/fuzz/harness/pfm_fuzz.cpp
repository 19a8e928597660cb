// SPDX-License-Identifier: Apache-2.0
// A float map is refused with a reason or gives exactly the floats in the file.
#include <cstdint>
#include <cstring>
#include <string>

#include "fuzz_check.hpp"
#include "tools/host/formats/pfm.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t *data, std::size_t size) {
    pfm_image image;
    std::string message;
    if (!pfm_parse(data, size, &image, &message)) {
        FUZZ_CHECK(!message.empty() && image.values.empty() && image.width_px == 0);
        return 0;
    }
    const std::size_t width = static_cast<std::size_t>(image.width_px);
    const std::size_t height = static_cast<std::size_t>(image.height_px);
    FUZZ_CHECK(width >= 1 && width <= PFM_MAX_SIDE_PX && height >= 1 && height <= PFM_MAX_SIDE_PX);
    FUZZ_CHECK(image.values.size() == width * height && size > 4 * width * height);
    // Every value occurs in the file, in one of the two byte orders.
    unsigned char bytes[4], turned[4];
    std::memcpy(bytes, image.values.data(), 4);
    for (int i = 0; i < 4; i++) {
        turned[i] = bytes[3 - i];
    }
    bool found = false;
    for (std::size_t at = 0; at + 4 <= size && !found; at++) {
        found = std::memcmp(data + at, bytes, 4) == 0 || std::memcmp(data + at, turned, 4) == 0;
    }
    FUZZ_CHECK(found);
    return 0;
}
