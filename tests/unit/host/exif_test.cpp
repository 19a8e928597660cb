// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <random>
#include <string>
#include <vector>

#include "synthetic/seed.hpp"
#include "tools/host/formats/image_formats.hpp"

namespace {

std::string number(unsigned value, int bytes, bool little_endian) {
    std::string text;
    for (int i = 0; i < bytes; i++) {
        const int shift = 8 * (little_endian ? i : bytes - 1 - i);
        text += static_cast<char>(value >> shift & 0xff);
    }
    return text;
}

// An EXIF block with a directory of three entries, the second one of this tag, type and value.
std::string block(bool little_endian, unsigned tag, unsigned type, unsigned value) {
    const auto n = [&](unsigned v, int bytes) { return number(v, bytes, little_endian); };
    const std::string head = (little_endian ? "II" : "MM") + n(42, 2) + n(12, 4) + "gap!";
    const std::string maker = n(0x010f, 2) + n(2, 2) + n(4, 4) + "Eye" + n(0, 1);
    const std::string resolution = n(0x0128, 2) + n(3, 2) + n(1, 4) + n(2, 2) + n(0, 2);
    const std::string entry =
        n(tag, 2) + n(type, 2) + n(1, 4) + (type == 3 ? n(value, 2) + n(0, 2) : n(value, 4));
    return head + n(3, 2) + maker + entry + resolution + n(0, 4);
}

int orientation(const std::string &text) {
    // A copy of exact size, so that a sanitizer detects a read beyond it.
    const std::vector<unsigned char> exact(text.begin(), text.end());
    return exif_orientation(exact.data(), exact.size());
}

}  // namespace

TEST_CASE("the orientation is found in either byte order") {
    for (const bool little_endian : {false, true}) {
        for (unsigned value = 1; value <= 8; value++) {
            CHECK(orientation(block(little_endian, 0x0112, 3, value)) == static_cast<int>(value));
        }
        for (const unsigned value : {0u, 9u, 255u, 65535u}) {
            CHECK(orientation(block(little_endian, 0x0112, 3, value)) == 0);
        }
        CHECK(orientation(block(little_endian, 0x0113, 3, 6)) == 0);
        CHECK(orientation(block(little_endian, 0x0112, 2, 6)) == 0);
    }
}
