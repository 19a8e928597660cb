// SPDX-License-Identifier: Apache-2.0
#include "tools/host/formats/pfm.hpp"

#include <cstdint>
#include <cstdlib>
#include <cstring>

#include "core/error.h"
#include "tools/host/formats/whole_file.hpp"

namespace {

struct cursor {
    const unsigned char *data;
    std::size_t length;
    std::size_t at;
};

bool is_space(unsigned char c) {
    return c == ' ' || c == '\t' || c == '\n' || c == '\r';
}

/// The next word of the header; empty at the end or when longer than any legal one.
std::string next_word(cursor *in) {
    while (in->at < in->length && is_space(in->data[in->at])) {
        in->at++;
    }
    std::string word;
    while (in->at < in->length && !is_space(in->data[in->at]) && word.size() < 32) {
        word.push_back(static_cast<char>(in->data[in->at++]));
    }
    return word;
}

bool parse_side(const std::string &word, int *side) {
    if (word.empty() || word.size() > 5) {
        return false;
    }
    int value = 0;
    for (const char c : word) {
        if (c < '0' || c > '9') {
            return false;
        }
        value = value * 10 + (c - '0');
    }
    *side = value;
    return value >= 1 && value <= PFM_MAX_SIDE_PX;
}

bool parse_scale(const std::string &word, bool *little_endian) {
    char *end = nullptr;
    const double scale = std::strtod(word.c_str(), &end);
    *little_endian = scale < 0;
    return !word.empty() && *end == '\0' && scale != 0 && scale == scale;
}

float float_of_bytes(const unsigned char *bytes, bool little_endian) {
    const std::uint32_t b0 = bytes[0], b1 = bytes[1], b2 = bytes[2], b3 = bytes[3];
    const std::uint32_t bits =
        little_endian ? b0 | b1 << 8 | b2 << 16 | b3 << 24 : b3 | b2 << 8 | b1 << 16 | b0 << 24;
    float value = 0;
    std::memcpy(&value, &bits, sizeof value);
    return value;
}

}  // namespace

bool pfm_parse(const unsigned char *data, std::size_t length, pfm_image *image,
               std::string *message) {
    cursor in{data, length, 0};
    const std::string magic = next_word(&in);
    if (magic != "Pf") {
        *message = magic == "PF" ? "a colour float map, PF (expected one value per pixel, Pf)"
                                 : "not a portable float map (it does not begin with Pf)";
        return false;
    }
    int width_px = 0, height_px = 0;
    if (!parse_side(next_word(&in), &width_px) || !parse_side(next_word(&in), &height_px)) {
        *message = "the float map's width and height must be integers from 1 to " +
                   std::to_string(PFM_MAX_SIDE_PX);
        return false;
    }
    bool little_endian = true;
    if (!parse_scale(next_word(&in), &little_endian)) {
        *message = "the float map's scale must be a number other than 0";
        return false;
    }
    in.at++;  // exactly one white space before the pixels
    const std::size_t pixels =
        static_cast<std::size_t>(width_px) * static_cast<std::size_t>(height_px);
    if (in.at > length || length - in.at < 4 * pixels) {
        *message = "the float map is truncated: " + std::to_string(width_px) + "x" +
                   std::to_string(height_px) + " pixels need " + std::to_string(4 * pixels) +
                   " bytes";
        return false;
    }
    std::vector<float> values(pixels);
    const std::size_t row = static_cast<std::size_t>(width_px);
    for (std::size_t y = 0; y < static_cast<std::size_t>(height_px); y++) {
        const unsigned char *from =
            data + in.at + 4 * row * (static_cast<std::size_t>(height_px) - 1 - y);
        for (std::size_t x = 0; x < row; x++) {
            values[y * row + x] = float_of_bytes(from + 4 * x, little_endian);
        }
    }
    image->width_px = width_px;
    image->height_px = height_px;
    image->values.swap(values);
    return true;
}

bool pfm_read(const std::string &path, pfm_image *image, std::string *message) {
    // The header is short, so a file longer than the largest legal map is rejected while reading.
    const std::size_t limit = std::size_t{4} * PFM_MAX_SIDE_PX * PFM_MAX_SIDE_PX + 256;
    std::string bytes;
    if (whole_file_read(path, limit, "a float map", &bytes, message) != ERROR_OK) {
        return false;
    }
    if (!pfm_parse(reinterpret_cast<const unsigned char *>(bytes.data()), bytes.size(), image,
                   message)) {
        *message = path + ": " + *message;
        return false;
    }
    return true;
}
