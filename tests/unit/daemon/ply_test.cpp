// SPDX-License-Identifier: Apache-2.0
// The writers of every build, on a hand-made result: bytes, and full disks.
#include <doctest/doctest.h>
#include <unistd.h>

#include <cmath>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "core/error.h"
#include "daemon/files/output_file.h"
#include "daemon/surface/result/result_figures.h"
#include "daemon/surface/result/write.h"

namespace {

/// Three points and one triangle in an image of 16 x 8 pixels.
struct handmade {
    static constexpr int width = 16, height = 8;
    std::vector<int32_t> disparity_q8 = std::vector<int32_t>(width * height, 640);
    std::vector<uint8_t> reason = std::vector<uint8_t>(width * height, REASON_OCCLUDED);
    std::vector<uint8_t> rgb = std::vector<uint8_t>(3 * width * height);
    triangulate_point points[3] = {
        {1000, -2000, 3000, 5, 7}, {-1500, 0, 70000, 0, 9}, {0, 2500, 2000000000, 4000000000u, 11}};
    uint32_t pixels[3] = {1, 17, 127};
    int16_t normals[3][3] = {{0, 0, -16384}, {16384, 0, 0}, {0, -16384, 0}};
    uint32_t triangles[1][3] = {{0, 1, 2}};
    calibration rig{};
    reconstruct_options options{};
    reconstruct_result result{};
    reconstruct_context context{};

    handmade() {
        for (size_t i = 0; i < rgb.size(); i++) {
            rgb[i] = static_cast<uint8_t>(i);
        }
        for (const uint32_t pixel : pixels) {
            reason[pixel] = REASON_VALID;
        }
        disparity_q8[1] = -384;
        std::strcpy(rig.id, "handmade");
        rig.translation_right_left_mm[0] = -100;
        result.plan.width_px = width;
        result.plan.height_px = height;
        result.plan.depth_far_mm = INFINITY;
        result.match.disparity_q8 = {disparity_q8.data(), width, height, width};
        result.match.reason = {reason.data(), width, height, width};
        result.left_colour = {rgb.data(), width, height, 3 * width};
        result.points = points;
        result.vertex_pixel = pixels;
        result.normals_q14 = normals;
        result.triangles = triangles;
        result.vertex_count = 3;
        result.triangle_count = 1;
        result.reason_count[REASON_VALID] = 3;
        context.result = &result;
        context.calibration = &rig;
        context.options = &options;
        context.calibration_format = "by \"hand\"";
        context.left_path = "l";
        context.right_path = "r";
        context.metric = true;
        context.version = "1";
        context.build_id = "b";
    }
    handmade(const handmade &) = delete;
    handmade &operator=(const handmade &) = delete;
};

using writer = int (*)(const reconstruct_context *, const char *, message *);
const writer writers[] = {write_pfm, write_ply, write_pcd, write_reasons, write_result};

std::string written(writer write) {
    const handmade made;
    std::string path = (std::filesystem::temp_directory_path() / "vergence-ply-XXXXXX").string();
    const int fd = mkstemp(path.data());
    REQUIRE(fd >= 0);
    close(fd);
    message text;
    CHECK(write(&made.context, path.c_str(), &text) == ERROR_OK);
    std::ifstream file(path, std::ios::binary);
    const std::string bytes((std::istreambuf_iterator<char>(file)), {});
    std::filesystem::remove(path);
    return bytes;
}

}  // namespace

TEST_CASE("JSON: quantiles, infinities and quotes") {
    const nlohmann::json value = nlohmann::json::parse(written(write_result));
    CHECK(value["plan"]["depth_far_mm"].is_null());
    CHECK(value["calibration"]["format"] == "by \"hand\"");
    CHECK(value["bounds_mm"]["max"][2] == 2000000.0);
    CHECK(value["bounds_mm"]["min"][0] == -1.5);
    CHECK(value["depth_mm"]["p1"] == 3.0);
    CHECK(value["depth_mm"]["median"] == 70.0);
    CHECK(value["density_percent"].get<double>() == doctest::Approx(300.0 / 128));
    CHECK(value["vertical_disparity"].is_null());
}

TEST_CASE("every writer reports a full disk") {
    const handmade made;
    for (const writer write : writers) {
        message text;
        CHECK(write(&made.context, "/dev/full", &text) == ERROR_FULL);
        CHECK(std::string(text.text).find("No space left") != std::string::npos);
        CHECK(write(&made.context, "/nowhere/file", &text) == ERROR_BUFFER);
        CHECK(std::string(text.text).find("/nowhere/file") != std::string::npos);
    }
}

TEST_CASE("pieces of any length are written in order") {
    std::string path = (std::filesystem::temp_directory_path() / "vergence-out-XXXXXX").string();
    const int fd = mkstemp(path.data());
    REQUIRE(fd >= 0);
    close(fd);
    std::string expected = "head";
    output_file file;
    output_file_open(&file, path.c_str());
    std::fputs("head", file.stream);
    for (size_t length = 0; length < 3 * OUTPUT_FILE_BUFFER_BYTES; length = length * 3 / 2 + 1) {
        const std::string piece(length, static_cast<char>('a' + length % 26));
        output_file_write(&file, piece.data(), piece.size());
        expected += piece;
    }
    message text;
    CHECK(output_file_close(&file, &text) == ERROR_OK);
    std::ifstream stream(path, std::ios::binary);
    CHECK(std::string((std::istreambuf_iterator<char>(stream)), {}) == expected);
    std::filesystem::remove(path);
}
