// SPDX-License-Identifier: Apache-2.0
#include "tools/host/formats/pfm.hpp"

#include <cerrno>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <memory>

#include "daemon/files/input_file.h"

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

struct file_closer {
    void operator()(std::FILE *file) const { std::fclose(file); }
};
using file_handle = std::unique_ptr<std::FILE, file_closer>;

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
    struct message last_error;
    const file_handle file(input_file_open(path.c_str(), &last_error));
    if (!file) {
        *message = last_error.text;
        return false;
    }
    std::vector<unsigned char> bytes;
    unsigned char block[1 << 16];
    // The header is short, so a file longer than the largest legal map is rejected while reading.
    const std::size_t limit = std::size_t{4} * PFM_MAX_SIDE_PX * PFM_MAX_SIDE_PX + 256;
    for (std::size_t got; (got = std::fread(block, 1, sizeof block, file.get())) > 0;) {
        bytes.insert(bytes.end(), block, block + got);
        if (bytes.size() > limit) {
            *message = path + ": too large for a float map";
            return false;
        }
    }
    if (std::ferror(file.get()) != 0) {
        *message = path + ": " + std::strerror(errno);
        return false;
    }
    if (!pfm_parse(bytes.data(), bytes.size(), image, message)) {
        *message = path + ": " + *message;
        return false;
    }
    return true;
}
