// SPDX-License-Identifier: Apache-2.0
// The parts of the page. The page as a whole: tests/command/report_test.py.
#include "tools/host/report/report.hpp"

#include <doctest/doctest.h>
#include <zlib.h>

#include <cmath>
#include <cstdio>
#include <fstream>
#include <random>
#include <sstream>
#include <vector>

#include "core/error.h"
#include "scratch.hpp"
#include "synthetic/seed.hpp"
#include "tools/host/formats/colormap.hpp"
#include "tools/host/formats/report_text.hpp"
#include "tools/host/report/report_figures.hpp"
#include "tools/host/report/report_layers.hpp"

namespace {

/// A flat grey pair, where nothing can be measured.
struct flat_run {
    std::vector<std::uint16_t> pixels = std::vector<std::uint16_t>(96 * 64, 128);
    calibration camera{};
    reconstruct_options options = reconstruct_default_options();
    reconstruct_result result{};
    std::vector<unsigned char> memory;
    arena lent{};
    int error = 0;

    flat_run() {
        std::snprintf(camera.id, sizeof camera.id, "flat");
        camera.rectified = true;
        camera.left = camera.right = {
            96, 64, 100, 100, 47.5, 31.5, 0, 0, 0, 0, 0, 0, 0, 0, LENS_BROWN_CONRADY};
        camera.translation_right_left_mm[0] = -50;
        options.rectify.disparity_count = 16;
        rectify_plan plan;
        REQUIRE(rectify_plan_make(&camera, &options.rectify, &plan) == ERROR_OK);
        const raw_image image = {pixels.data(), 96, 64, 96, 8, RAW_GREY, nullptr, nullptr};
        memory.resize(reconstruct_needs(&image, &image, &camera, &plan, &options, 1).bytes);
        arena_init(&lent, memory.data(), memory.size());
        const reconstruct_environment nothing{};
        error = reconstruct_run(&image, &image, &camera, &plan, &options, &nothing, &lent, &result);
    }
};

}  // namespace

TEST_CASE("text from outside cannot become markup") {
    CHECK(report_text_escape("<a href=\"x\">'&") == "&lt;a href=&quot;x&quot;&gt;&#39;&amp;");
    CHECK(report_text_escape("caf\xC3\xA9 \x01\n") == "caf\xC3\xA9   ");
    CHECK(report_text_escape("bad\xFF\xC3") == "bad\xEF\xBF\xBD\xEF\xBF\xBD");
    CHECK(report_text_json("</script>\"\\\n") == "\"\\u003c/script\\u003e\\\"\\\\\\u000a\"");
}

TEST_CASE("numbers are formatted for people") {
    CHECK(report_text_count(0) == "0");
    CHECK(report_text_count(999) == "999");
    CHECK(report_text_count(1234567) ==
          "1\xE2\x80\xAF"
          "234\xE2\x80\xAF"
          "567");
    CHECK(report_text_length(0.0421, "mm") == "0.042 mm");
    CHECK(report_text_length(812.44, "mm") == "812.4 mm");
    CHECK(report_text_length(12345, "mm") == "12.35 m");
    CHECK(report_text_length(12345, "units") == "12345 units");
    CHECK(report_text_bytes(1500000) == "1.5 MB");
    CHECK(report_text_file_name("/a/b/c.png") == "c.png");
    CHECK(report_text_file_name("c.png") == "c.png");
    CHECK(report_text_file_name("/a/b/") == "b");
}

TEST_CASE("no digit is printed that the deviation does not support") {
    CHECK(number_text_with_sigma(1792.3456, 1.234) == "1792.3 +- 1.2");
    CHECK(number_text_with_sigma(1792.3456, 0.0996) == "1792.35 +- 0.10");
    CHECK(number_text_with_sigma(1792.3456, 123.4) == "1790 +- 120");
    CHECK(number_text_with_sigma(1, 0.996) == "1.0 +- 1.0");
    CHECK(number_text_with_sigma(-0.04, 12) == "0 +- 12");
    CHECK(number_text_with_sigma(5.25, 0) == "5.25 +- 0");
    CHECK(number_text_with_sigma(5.25, NAN) == "5.25 +- nan");
}

TEST_CASE("parts are inserted into a page by name") {
    CHECK(report_text_fill("a {{x}} b {{y}}{{x}}", {{"x", "1"}, {"y", "{{x}}"}}) == "a 1 b {{x}}1");
    CHECK(report_text_fill("nothing {{ open", {}) == "nothing {{ open");
}

TEST_CASE("base64 follows the examples of RFC 4648") {
    const auto encode = [](const std::string &text) {
        return report_encode_base64(report_bytes(text.begin(), text.end()));
    };
    CHECK(encode("") == "");
    CHECK(encode("f") == "Zg==");
    CHECK(encode("fo") == "Zm8=");
    CHECK(encode("foo") == "Zm9v");
    CHECK(encode("foobar") == "Zm9vYmFy");
    CHECK(encode("\xFB\xFF") == "+/8=");
}

TEST_CASE("packed bytes unpack") {
    const auto seed = static_cast<unsigned>(synthetic::test_seed());
    INFO("seed ", seed);
    std::mt19937 random(seed);
    report_bytes bytes(100000);
    for (unsigned char &b : bytes) {
        b = static_cast<unsigned char>(random() % 7);
    }
    const report_bytes packed = report_encode_deflate(bytes);
    CHECK(packed.size() < bytes.size() / 2);
    report_bytes back(bytes.size());
    uLongf size = back.size();
    REQUIRE(uncompress(back.data(), &size, packed.data(), packed.size()) == Z_OK);
    CHECK(back == bytes);
}

TEST_CASE("sigma codes come back within their step") {
    CHECK(report_layers_sigma_code(0) == 0);
    CHECK(report_layers_sigma_code(-1) == 0);
    for (double sigma_mm = 0.002; sigma_mm < 5000; sigma_mm *= 1.37) {
        const int code = report_layers_sigma_code(sigma_mm);
        const double back =
            report_layers_sigma_first_mm * std::pow(report_layers_sigma_ratio, code - 1);
        CHECK(back == doctest::Approx(sigma_mm).epsilon(0.034));
    }
    CHECK(report_layers_sigma_code(1e-9) == 1);
    CHECK(report_layers_sigma_code(1e9) == 255);
}

TEST_CASE("rows are rated in plain words") {
    const auto rows = [](double median_px, int samples, const char *fault) {
        triangulate_vertical vertical{};
        vertical.median_px = median_px;
        vertical.samples = samples;
        return report_figures_assess_rows(vertical, fault);
    };
    CHECK(std::string(rows(0, 0, nullptr).word) == "not measured");
    CHECK(std::string(rows(0.05, 500, nullptr).grade) == "good");
    CHECK(std::string(rows(0.05, 500, "a trend").grade) == "fair");
    CHECK(std::string(rows(0.05, 500, "a trend").sentence).find("a trend") != std::string::npos);
    CHECK(std::string(rows(0.5, 500, nullptr).grade) == "fair");
    CHECK(std::string(rows(2.5, 500, nullptr).word) == "poor");
}

TEST_CASE("a pair without a surface still gets its page") {
    flat_run run;
    REQUIRE(run.error == ERROR_NO_SURFACE);
    reconstruct_context context{};
    context.result = &run.result;
    context.calibration = &run.camera;
    context.options = &run.options;
    context.left_path = "l.png";
    context.right_path = "r.png";
    context.calibration_format = "vergence";
    context.metric = true;
    context.shrink = 1;
    context.version = context.build_id = "test";
    const scratch here;
    const std::string path = here / "report.html";
    struct message message {};
    REQUIRE(report_write(&context, path.c_str(), &message) == ERROR_OK);
    std::ifstream file(path);
    std::stringstream text;
    text << file.rdbuf();
    CHECK(text.str().find("No surface") != std::string::npos);
    CHECK(text.str().find("field of view</th>") != std::string::npos);
    CHECK(text.str().find(lens_kind_name(run.camera.right.kind)) != std::string::npos);
    CHECK(text.str().find("{{") == std::string::npos);
    CHECK(text.str().find("nan") == std::string::npos);
    CHECK(report_write(&context, (here / "no/report.html").c_str(), &message) == ERROR_BUFFER);
    CHECK(std::string(message.text).find("/no/report.html") != std::string::npos);
    CHECK(report_write(&context, "/dev/full", &message) == ERROR_FULL);
}
