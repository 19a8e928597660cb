// SPDX-License-Identifier: Apache-2.0
// The built-in readers: PNM, raw, and the limits and shrinking shared by all formats.
#include <doctest/doctest.h>

#include <cstring>
#include <filesystem>
#include <random>
#include <string>
#include <vector>

#include "core/error.h"
#include "daemon/images/image_pnm.h"
#include "scratch.hpp"
#include "synthetic/seed.hpp"

namespace {

/// A file parsed from memory; freed by its destructor.
struct parsed {
    image_file file{};
    message text{};
    image_request request{};
    int error;

    parsed(const std::string &bytes, const image_request &wanted,
           image_file_parser *parse = image_pnm_parse)
        : request(wanted) {
        file.path = "test.pnm";
        file.request = &request;
        // A copy of exact size, so that a sanitizer detects a read beyond it.
        std::vector<unsigned char> exact(bytes.begin(), bytes.end());
        error = parse(exact.data(), exact.size(), &file, &text);
    }
    parsed(const parsed &) = delete;
    parsed &operator=(const parsed &) = delete;
    ~parsed() { image_file_free(&file); }

    std::vector<int> values() const {
        const raw_image &image = file.image;
        const int channels = image.layout == RAW_RGB ? 3 : 1;
        std::vector<int> result;
        for (int y = 0; y < image.height_px; y++) {
            for (int x = 0; x < image.width_px * channels; x++) {
                result.push_back(image.data[y * image.stride + x]);
            }
        }
        return result;
    }
};

image_request plain() {
    image_request request{};
    request.scale = 1;
    return request;
}

std::string be16(int value) {
    return {static_cast<char>(value >> 8), static_cast<char>(value & 255)};
}

}  // namespace

TEST_CASE("maxval determines the bits") {
    const parsed ten("P5 2 1 1023\n" + be16(0) + be16(1023), plain());
    REQUIRE(ten.error == ERROR_OK);
    CHECK(ten.file.image.bits == 10);
    CHECK(ten.values() == std::vector<int>{0, 1023});
    const parsed sixteen("P5 2 1 65535\n" + be16(258) + be16(65535), plain());
    REQUIRE(sixteen.error == ERROR_OK);
    CHECK(sixteen.file.image.bits == 16);
    CHECK(sixteen.values() == std::vector<int>{258, 65535});
    // Other ranges are stretched to the next full range of bits.
    const parsed bits("P2 4 1 3 0 1 2 3", plain());
    REQUIRE(bits.error == ERROR_OK);
    CHECK(bits.values() == std::vector<int>{0, 85, 170, 255});
    const parsed thousand("P2 3 1 1000 0 500 1000", plain());
    REQUIRE(thousand.error == ERROR_OK);
    CHECK(thousand.file.image.bits == 10);
    CHECK(thousand.values() == std::vector<int>{0, 512, 1023});
}

TEST_CASE("damaged PNM is rejected") {
    const char *wrong[] = {
        "P5",
        "P5 ",
        "P5 2 2",
        "P5 2 2 255",
        "P5 2 2 0\n1234",
        "P5 0 2 255\n",
        "P5 2 0 255\n",
        "P5 -2 2 255\n",
        "P5 2 2 65536\n",
        "P5 x 2 255\nabcd",
        "P7 2 2 255\n",
        "P5 2 2 255\nabc",
        "P2 2 1 255 1",
        "P2 2 1 255 1 256",
        "P2 2 1 255 1 x",
        "P5 2 99999999999999999999 255\nabcd",
    };
    for (const char *bytes : wrong) {
        CAPTURE(bytes);
        const parsed file(bytes, plain());
        CHECK(file.error < 0);
        CHECK(std::strlen(file.text.text) > 10);
    }
}

TEST_CASE("a header cannot request more memory than its file justifies") {
    const parsed bomb("P6 32000 32000 65535\nabc", plain());
    CHECK(bomb.error == ERROR_SYNTAX);
    const parsed wide("P5 100000 100000 255\nabc", plain());
    CHECK(wide.error == ERROR_TOO_LARGE);
}

TEST_CASE("the message for a large image names the limit and --scale") {
    const std::string bytes = "P5 4097 2 255\n" + std::string(2 * 4097, 'a');
    const parsed refused(bytes, plain());
    CHECK(refused.error == ERROR_TOO_LARGE);
    CHECK(std::strstr(refused.text.text, "4096") != nullptr);
    CHECK(std::strstr(refused.text.text, "--scale 0.5") != nullptr);
    image_request half = plain();
    half.scale = 0.5;
    const parsed shrunk(bytes, half);
    REQUIRE(shrunk.error == ERROR_OK);
    CHECK(shrunk.file.shrink == 2);
    CHECK(shrunk.file.image.width_px == 2048);
    CHECK(shrunk.file.image.height_px == 1);
}

TEST_CASE("shrinking averages whole blocks") {
    std::mt19937 random(static_cast<unsigned>(synthetic::test_seed()));
    const int width = 4100, height = 7, factor = 3;
    std::string bytes = "P6 4100 7 255\n";
    std::vector<int> raw;
    for (int i = 0; i < 3 * width * height; i++) {
        raw.push_back(static_cast<int>(random() % 256));
        bytes.push_back(static_cast<char>(raw.back()));
    }
    image_request third = plain();
    third.scale = 0.333;
    const parsed file(bytes, third);
    REQUIRE(file.error == ERROR_OK);
    REQUIRE(file.file.shrink == factor);
    const std::vector<int> values = file.values();
    REQUIRE(values.size() == 3u * (width / factor) * (height / factor));
    for (size_t at = 0; at < values.size(); at++) {
        const int c = static_cast<int>(at % 3), x = static_cast<int>(at / 3) % (width / factor);
        const int y = static_cast<int>(at / 3) / (width / factor);
        double sum = 0;
        for (int i = 0; i < factor * factor; i++) {
            const int from_x = x * factor + i % factor, from_y = y * factor + i / factor;
            sum += raw[static_cast<size_t>((from_y * width + from_x) * 3 + c)];
        }
        CHECK(values[at] ==
              doctest::Approx(sum / (factor * factor)).epsilon(0.51 / 1000).scale(1000));
    }
}

TEST_CASE("bits and mosaics are as the user states") {
    image_request twelve = plain();
    twelve.bits = 12;
    const parsed stated("P5 2 1 65535\n" + be16(5) + be16(4095), twelve);
    REQUIRE(stated.error == ERROR_OK);
    CHECK(stated.file.image.bits == 12);
    const parsed beyond("P5 2 1 65535\n" + be16(5) + be16(4096), twelve);
    CHECK(beyond.error == ERROR_RANGE);
    CHECK(std::strstr(beyond.text.text, "--bits") != nullptr);
    image_request mosaic = plain();
    mosaic.bayer = IMAGE_BAYER_GRBG;
    const parsed grey("P5 2 2 255\nabcd", mosaic);
    REQUIRE(grey.error == ERROR_OK);
    CHECK(grey.file.image.layout == RAW_BAYER_GRBG);
    const parsed colour("P6 1 1 255\nabc", mosaic);
    CHECK(colour.error == ERROR_ARGUMENT);
}

TEST_CASE("raw frames are little-endian words of ten bits") {
    image_request request = plain();
    request.raw_width_px = 2;
    request.raw_height_px = 1;
    const parsed file(std::string("\x01\x02\xff\x03", 4), request, image_raw_parse);
    REQUIRE(file.error == ERROR_OK);
    CHECK(file.values() == std::vector<int>{0x201, 0x3ff});
    CHECK(file.file.image.bits == 10);
    CHECK(file.file.image.layout == RAW_BAYER_GRBG);
    CHECK(parsed(std::string(3, 'a'), request, image_raw_parse).error == ERROR_SYNTAX);
    CHECK(parsed(std::string(5, 'a'), request, image_raw_parse).error == ERROR_SYNTAX);
    CHECK(parsed(std::string("\x01\x02\xff\x04", 4), request, image_raw_parse).error ==
          ERROR_RANGE);
    CHECK(parsed(std::string(), plain(), image_raw_parse).error == ERROR_SYNTAX);
    const parsed sensor(std::string(2 * 2048 * 1536, '\1'), plain(), image_raw_parse);
    REQUIRE(sensor.error == ERROR_OK);
    CHECK(sensor.file.image.width_px == 2048);
    CHECK(sensor.file.image.height_px == 1536);
}

TEST_CASE("a file that cannot be loaded is named, with the right error code") {
    const image_format formats[] = {{"PGM/PPM", "pgm", image_pnm_probe, image_pnm_read}};
    const image_request request = plain();
    const scratch here;
    const auto code_of = [&](const std::string &path) {
        image_file file{};
        message text{};
        const int error = image_file_read(path.c_str(), formats, 1, &request, &file, &text);
        CHECK(std::string(text.text).find(path) == 0);
        image_file_free(&file);
        return error;
    };
    CHECK(code_of(here / "missing.pgm") == ERROR_ARGUMENT);
    CHECK(code_of(here.path) == ERROR_ARGUMENT);
    CHECK(code_of(here.write("empty.pgm", "")) == ERROR_SYNTAX);
    CHECK(code_of(here.write("other.pgm", "GIF89a")) == ERROR_SYNTAX);
    const std::string huge = here.write("huge.pgm", "P5 9 9 255\n");
    std::filesystem::resize_file(huge, (uint64_t{1} << 30) + 1);  // takes no space on disk
    CHECK(code_of(huge) == ERROR_TOO_LARGE);
}

namespace {

// A format whose files are PGM or PPM after one digit: the orientation.
int read_turned(const char *path, const image_request *, image_file *file, message *text) {
    return image_file_load(
        path,
        [](const unsigned char *data, size_t length, image_file *into, message *reason) {
            into->orientation = data[0] - '0';
            return image_pnm_parse(data + 1, length - 1, into, reason);
        },
        file, text);
}

const image_format turned_format[] = {{"turned", "turned", nullptr, read_turned}};

// Distance from one side of an image of this size to the pixel (x, y).
int distance_from(const std::string &side, int width, int height, int x, int y) {
    return side == "top"      ? y
           : side == "bottom" ? height - 1 - y
           : side == "left"   ? x
                              : width - 1 - x;
}

// Position in the file of pixel (x, y) of the shown image of this size: EXIF states the side of the
// shown image on which the file's first row and first column are.
void place_in_file(int orientation, int width, int height, int x, int y, int *column, int *row) {
    static const char *const sides[9][2] = {
        {"top", "left"},     {"top", "left"},     {"top", "right"},
        {"bottom", "right"}, {"bottom", "left"},  {"left", "top"},
        {"right", "top"},    {"right", "bottom"}, {"left", "bottom"}};
    *row = distance_from(sides[orientation][0], width, height, x, y);
    *column = distance_from(sides[orientation][1], width, height, x, y);
}

}  // namespace

TEST_CASE("shrinking then turning equals turning then shrinking") {
    std::mt19937_64 random(synthetic::test_seed());
    const scratch here;
    const int columns = 4100, rows = 7, factor = 3;
    std::string pixels;
    for (int i = 0; i < columns * rows; i++) {
        pixels += static_cast<char>(random() % 256);
    }
    for (int orientation = 1; orientation <= 8; orientation++) {
        CAPTURE(orientation);
        const bool swaps = orientation >= 5;
        const int width = swaps ? rows : columns, height = swaps ? columns : rows;
        std::string upright =
            "1P5 " + std::to_string(width) + " " + std::to_string(height) + " 255\n";
        for (int y = 0; y < height; y++) {
            for (int x = 0; x < width; x++) {
                int column = 0, row = 0;
                place_in_file(orientation, width, height, x, y, &column, &row);
                upright += pixels[static_cast<size_t>(row * columns + column)];
            }
        }
        const std::string paths[2] = {
            here.write("a.turned", std::to_string(orientation) + "P5 4100 7 255\n" + pixels),
            here.write("b.turned", upright)};
        image_request request = plain();
        request.scale = 1.0 / factor;
        image_file files[2] = {};
        for (int i = 0; i < 2; i++) {
            message text{};
            REQUIRE(image_file_read(paths[i].c_str(), turned_format, 1, &request, &files[i],
                                    &text) == ERROR_OK);
        }
        CHECK(files[0].shrink == factor);
        REQUIRE(files[0].image.width_px == width / factor);
        REQUIRE(files[1].image.width_px == width / factor);
        REQUIRE(files[0].image.height_px == files[1].image.height_px);
        const size_t bytes = sizeof(uint16_t) * static_cast<size_t>(files[0].image.width_px) *
                             static_cast<size_t>(files[0].image.height_px);
        CHECK(std::memcmp(files[0].pixels, files[1].pixels, bytes) == 0);
        for (image_file &file : files) {
            image_file_free(&file);
        }
    }
}

TEST_CASE("a mosaic cannot be turned") {
    const scratch here;
    const std::string path = here.write("a.turned", "6P5 2 2 255\nabcd");
    image_request request = plain();
    request.bayer = IMAGE_BAYER_GRBG;
    image_file file{};
    message text{};
    CHECK(image_file_read(path.c_str(), turned_format, 1, &request, &file, &text) ==
          ERROR_ARGUMENT);
    CHECK(std::strstr(text.text, "mosaic") != nullptr);
}
