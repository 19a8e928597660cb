// SPDX-License-Identifier: Apache-2.0
#include <cstdint>
#include <cstring>

#include "tools/host/formats/image_formats.hpp"

namespace {

constexpr std::size_t entry_bytes = 12;
constexpr std::uint32_t tag_orientation = 0x0112, type_short = 3;

/// The block with its byte order; reads outside of it return 0.
struct block {
    const unsigned char *data;
    std::size_t length;
    bool little_endian;

    std::uint32_t number(std::size_t at, std::size_t bytes) const {
        if (at > length || length - at < bytes) {
            return 0;
        }
        std::uint32_t value = 0;
        for (std::size_t i = 0; i < bytes; i++) {
            value = value << 8 | data[at + (little_endian ? bytes - 1 - i : i)];
        }
        return value;
    }
};

}  // namespace

int exif_orientation(const unsigned char *data, std::size_t length) {
    if (length < 8) {
        return 0;
    }
    const bool little_endian = std::memcmp(data, "II*\0", 4) == 0;
    if (!little_endian && std::memcmp(data, "MM\0*", 4) != 0) {
        return 0;
    }
    const block exif = {data, length, little_endian};
    const std::size_t directory = exif.number(4, 4);
    const std::size_t count = exif.number(directory, 2);
    for (std::size_t i = 0; i < count; i++) {
        const std::size_t entry = directory + 2 + i * entry_bytes;
        if (exif.number(entry, 2) == tag_orientation && exif.number(entry + 2, 2) == type_short &&
            exif.number(entry + 4, 4) == 1) {
            const std::uint32_t value = exif.number(entry + 8, 2);
            return value >= 1 && value <= 8 ? static_cast<int>(value) : 0;
        }
    }
    return 0;
}
