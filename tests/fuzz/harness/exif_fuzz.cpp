// SPDX-License-Identifier: Apache-2.0
// For any EXIF block the orientation is valid or absent.
#include <cstdint>

#include "fuzz_check.hpp"
#include "tools/host/formats/image_formats.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t *data, std::size_t size) {
    const int orientation = exif_orientation(data, size);
    FUZZ_CHECK(orientation >= 0 && orientation <= 8);
    return 0;
}
