// SPDX-License-Identifier: Apache-2.0
// Images for people: our PNG files as read by libpng, and reduced frames.
#include "daemon/images/picture.h"

#include <doctest/doctest.h>

#include <cstdlib>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include "core/error.h"
#include "scratch.hpp"
#include "synthetic/seed.hpp"
#include "tools/host/formats/image_formats.hpp"

namespace {

using pixels = std::vector<uint8_t>;

std::string encoded(const pixels &values, int width, int height, int channels,
                    const char *text = nullptr) {
    const picture shown{const_cast<uint8_t *>(values.data()),  width, height, channels,
                        static_cast<size_t>(width * channels), text,  nullptr};
    size_t bytes = 0;
    const std::unique_ptr<uint8_t, void (*)(void *)> file(picture_png(&shown, &bytes), std::free);
    REQUIRE(file != nullptr);
    return std::string(reinterpret_cast<const char *>(file.get()), bytes);
}

/// The contents of the file as libpng reads them.
pixels decoded(const std::string &file, int width, int height, int channels) {
    const scratch folder;
    const image_request request{};
    const image_format format{"PNG", "png", image_png_probe, image_png_read};
    image_file image{};
    message message{};
    const std::string path = folder.write("a.png", file);
    REQUIRE_MESSAGE(image_file_read(path.c_str(), &format, 1, &request, &image, &message) == 0,
                    message.text);
    CHECK(image.image.width_px == width);
    CHECK(image.image.height_px == height);
    CHECK(image.image.layout == (channels == 3 ? RAW_RGB : RAW_GREY));
    const size_t count = static_cast<size_t>(width * height * channels);
    pixels values(image.image.data, image.image.data + count);
    image_file_free(&image);
    return values;
}

void check_same(const pixels &values, int width, int height, int channels) {
    CAPTURE(width);
    CAPTURE(channels);
    CHECK(decoded(encoded(values, width, height, channels), width, height, channels) == values);
}

}  // namespace

TEST_CASE("libpng reads back what was written") {
    std::mt19937_64 random(synthetic::test_seed());
    for (const int channels : {1, 3}) {
        for (const int width : {1, 2, 7, 640}) {
            pixels noise(static_cast<size_t>(width * 50 * channels));
            for (uint8_t &value : noise) {
                value = static_cast<uint8_t>(random());
            }
            check_same(noise, width, 50, channels);
            check_same(pixels(noise.size(), 0), width, 50, channels);
            check_same(pixels(noise.size(), 255), width, 50, channels);
        }
        check_same(pixels(static_cast<size_t>(channels), 77), 1, 1, channels);
        check_same(pixels(static_cast<size_t>(2 * 4096 * channels), 9), 2, 4096, channels);
    }
}

TEST_CASE("a smooth image becomes much smaller than its pixels") {
    pixels values(640 * 480);
    for (size_t i = 0; i < values.size(); i++) {
        values[i] = static_cast<uint8_t>(i % 640 / 4 + i / 640 / 8);
    }
    CHECK(encoded(values, 640, 480, 1).size() < values.size() / 4);
}

TEST_CASE("our files are recognised by their first bytes") {
    const auto is_ours = [](const std::string &file, size_t bytes) {
        return picture_png_is_ours(reinterpret_cast<const uint8_t *>(file.data()),
                                   std::min(bytes, file.size()));
    };
    const std::string file = encoded(pixels(12, 1), 2, 2, 3, "left: zoom 422\nfocus 500");
    CHECK(is_ours(file, PICTURE_HEAD_BYTES));
    CHECK(file.find("Comment" + std::string(1, '\0') + "left: zoom 422\nfocus 500") !=
          std::string::npos);
    CHECK(decoded(file, 2, 2, 3) == pixels(12, 1));
    CHECK_FALSE(is_ours(file, 40));
    CHECK_FALSE(is_ours("", PICTURE_HEAD_BYTES));
    std::string other = file;
    other.replace(other.find("vergence"), 8, "GIMP 2.1");
    CHECK_FALSE(is_ours(other, PICTURE_HEAD_BYTES));
}

TEST_CASE("a frame is reduced by whole squares") {
    // Grey: each value is its own position's.
    std::vector<uint16_t> values(7 * 5);
    for (size_t i = 0; i < values.size(); i++) {
        values[i] = static_cast<uint16_t>(i * 7);
    }
    raw_image raw{values.data(), 7, 5, 7, 8, RAW_GREY, nullptr, nullptr};
    const develop_balance balance = develop_balance_of(&raw);
    for (const int channels : {1, 3}) {
        // Rows are spaced further apart than they are long.
        pixels out(static_cast<size_t>(2 * 20), 99);
        picture picture{out.data(), 3, 2, channels, 20, nullptr, nullptr};
        REQUIRE(picture_develop(&raw, &balance, 2, &picture) == ERROR_OK);
        for (size_t y = 0; y < 2; y++) {
            for (size_t x = 0; x < 3; x++) {
                const size_t corner = 2 * y * 7 + 2 * x;
                const int sum =
                    values[corner] + values[corner + 1] + values[corner + 7] + values[corner + 8];
                for (size_t c = 0; c < static_cast<size_t>(channels); c++) {
                    CHECK(out[20 * y + static_cast<size_t>(channels) * x + c] == (sum + 2) / 4);
                }
            }
            CHECK(out[20 * y + 3 * static_cast<size_t>(channels)] == 99);
        }
    }
    raw.bits = 7;
    pixels out(20);
    picture picture{out.data(), 3, 2, 1, 10, nullptr, nullptr};
    CHECK(picture_develop(&raw, &balance, 2, &picture) == ERROR_ARGUMENT);
}
