// SPDX-License-Identifier: Apache-2.0
// An image of the board is checked without reading beyond it. What is accepted is whole, and stays
// accepted with anything behind it.
#include <cstdint>
#include <vector>

#include "daemon/system/fit.h"
#include "fuzz_check.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t *data, std::size_t size) {
    std::vector<std::uint8_t> image(data, data + size);
    fit found{};
    message text{};
    if (fit_check(image.data(), image.size(), &found, &text) != 0) {
        FUZZ_CHECK(text.text[0] != '\0');
        return 0;
    }
    FUZZ_CHECK(found.bytes <= image.size() && found.parts > 0 && found.board[0] != '\0');
    const std::size_t bytes = found.bytes;
    image.resize(bytes);
    FUZZ_CHECK(fit_check(image.data(), image.size(), &found, &text) == 0);
    FUZZ_CHECK(fit_check(image.data(), image.size() - 1, &found, &text) != 0);
    image.resize(bytes + 100, 0xff);
    FUZZ_CHECK(fit_check(image.data(), image.size(), &found, &text) == 0);
    return 0;
}
