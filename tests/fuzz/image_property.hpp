// SPDX-License-Identifier: Apache-2.0
/// The property of an image reader, for every file.
#ifndef VERGENCE_TESTS_FUZZ_IMAGE_PROPERTY_HPP
#define VERGENCE_TESTS_FUZZ_IMAGE_PROPERTY_HPP

#include <cstdint>

#include "core/error.h"
#include "daemon/images/image_file.h"
#include "fuzz_check.hpp"

/// Parses `data`; on success hands the image to `inspect`, on failure expects a reason.
template <typename Inspect>
void check_image(image_file_parser *parse, const std::uint8_t *data, std::size_t size,
                 const image_request &request, Inspect inspect) {
    image_file file{};
    message text{};
    file.path = "file";
    file.request = &request;
    const int error = parse(data, size, &file, &text);
    FUZZ_CHECK(error <= 0);
    FUZZ_CHECK((error == ERROR_OK) == (text.text[0] == '\0'));
    if (error == ERROR_OK) {
        const raw_image &image = file.image;
        FUZZ_CHECK(image.width_px >= 1 && image.width_px <= IMAGE_MAX_SIDE_PX);
        FUZZ_CHECK(image.height_px >= 1 && image.height_px <= IMAGE_MAX_SIDE_PX);
        FUZZ_CHECK(image.bits >= 8 && image.bits <= 16 && file.rows_done == file.file_height_px);
        FUZZ_CHECK(image.stride == image.width_px * (image.layout == RAW_RGB ? 3 : 1));
        for (std::ptrdiff_t i = 0; i < image.stride * image.height_px; i++) {
            FUZZ_CHECK(image.data[i] >> image.bits == 0);
        }
        inspect(file);
    }
    image_file_free(&file);
}

#endif
