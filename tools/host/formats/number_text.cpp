// SPDX-License-Identifier: Apache-2.0
#include "tools/host/formats/number_text.hpp"

#include <charconv>
#include <cmath>

std::string number_text(double value, int digits) {
    char text[64];
    const bool large = std::abs(value) >= std::pow(10.0, digits) && std::abs(value) < 1e15;
    const auto end =
        large ? std::to_chars(text, text + sizeof text, value, std::chars_format::fixed, 0)
              : std::to_chars(text, text + sizeof text, value, std::chars_format::general, digits);
    return std::string(text, end.ptr);
}
