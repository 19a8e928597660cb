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

float float_at(const std::string &bytes, size_t at) {
    float value = 0;
    REQUIRE(at + 4 <= bytes.size());
    std::memcpy(&value, bytes.data() + at, 4);
    return value;
}

}  // namespace

TEST_CASE("PLY: header and bytes agree") {
    const std::string ply = written(write_ply);
    const std::string end = "end_header\n";
    const size_t data = ply.find(end) + end.size();
    CHECK(ply.find("element vertex 3\n") != std::string::npos);
    CHECK(ply.find("element face 1\n") != std::string::npos);
    REQUIRE(ply.size() == data + 3 * 35 + 13);
    CHECK(float_at(ply, data) == 1.0f);
    CHECK(float_at(ply, data + 4) == -2.0f);
    CHECK(float_at(ply, data + 8) == 3.0f);
    CHECK(float_at(ply, data + 20) == -1.0f);
    CHECK(static_cast<unsigned char>(ply[data + 24]) == 3);  // red of pixel 1
    CHECK(float_at(ply, data + 27) == 0.007f);
    CHECK(float_at(ply, data + 31) == 0.005f);
    CHECK(float_at(ply, data + 2 * 35 + 31) == 4e6f);
    CHECK(ply[data + 3 * 35] == 3);
    CHECK(ply[data + 3 * 35 + 9] == 2);
}

TEST_CASE("PFM: rows from below, infinity where rejected, negative disparities kept") {
    const std::string pfm = written(write_pfm);
    const std::string head = "Pf\n16 8\n-1.0\n";
    REQUIRE(pfm.size() == head.size() + 4 * 16 * 8);
    CHECK(pfm.compare(0, head.size(), head) == 0);
    const size_t top_row = head.size() + 4 * 16 * 7;
    CHECK(float_at(pfm, top_row + 4) == -1.5f);
    CHECK(std::isinf(float_at(pfm, top_row)));
    CHECK(float_at(pfm, head.size() + 4 * 15) == 2.5f);  // pixel 127, the last of the last row
}

TEST_CASE("PCD and PGM have the sizes that they state") {
    const std::string pcd = written(write_pcd);
    const std::string marker = "DATA binary\n";
    CHECK(pcd.find("POINTS 3\n") != std::string::npos);
    CHECK(pcd.size() == pcd.find(marker) + marker.size() + 3 * 20);
    const std::string pgm = written(write_reasons);
    const std::string size = "16 8\n255\n";
    REQUIRE(pgm.size() == pgm.find(size) + size.size() + 16 * 8);
    CHECK(pgm[pgm.size() - 128] == REASON_OCCLUDED);
    CHECK(pgm[pgm.size() - 127] == REASON_VALID);
}

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
