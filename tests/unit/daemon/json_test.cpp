// SPDX-License-Identifier: Apache-2.0
// The JSON writer, checked with an independent parser.
#include "daemon/base/json.h"

#include <doctest/doctest.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <limits>
#include <nlohmann/json.hpp>
#include <random>
#include <string>

#include "synthetic/seed.hpp"

namespace {

/// The text that `write` produces between json_begin and json_end.
template <typename Writer>
std::string printed(Writer write) {
    char *text = nullptr;
    size_t length = 0;
    FILE *stream = open_memstream(&text, &length);
    json out;
    json_begin(&out, stream);
    write(&out);
    json_end(&out);
    REQUIRE(std::fclose(stream) == 0);
    const std::string result(text, length);
    std::free(text);
    return result;
}

nlohmann::json parsed_text(const std::string &value) {
    return nlohmann::json::parse(
        printed([&](json *out) { json_text(out, nullptr, value.c_str()); }));
}

}  // namespace

TEST_CASE("every kind of value is parsed back") {
    const std::string text = printed([](json *out) {
        json_open_object(out, nullptr);
        json_integer(out, "least", std::numeric_limits<int64_t>::min());
        json_real(out, "pi", 3.14159265358979312, 17);
        json_real(out, "nan", std::nan(""), 6);
        json_real(out, "infinite", HUGE_VAL, 6);
        json_bool(out, "yes", true);
        json_text(out, "missing", nullptr);
        json_open_array(out, "empty");
        json_close_array(out);
        json_open_array(out, "nested");
        json_open_object(out, nullptr);
        json_close_object(out);
        const double row[3] = {1, -2.5, 1e300};
        json_reals(out, nullptr, row, 3, 9);
        json_close_array(out);
        json_close_object(out);
    });
    const nlohmann::json value = nlohmann::json::parse(text);
    CHECK(value["least"].get<int64_t>() == std::numeric_limits<int64_t>::min());
    CHECK(value["pi"].get<double>() == 3.14159265358979312);
    CHECK(value["nan"].is_null());
    CHECK(value["infinite"].is_null());
    CHECK(value["yes"].get<bool>());
    CHECK(value["missing"].is_null());
    CHECK(value["empty"].empty());
    CHECK(value["nested"][1] == nlohmann::json({1, -2.5, 1e300}));
    CHECK(value.size() == 8);
}

TEST_CASE("texts are escaped") {
    const std::string awkward = "quote \" backslash \\ tab \t bell \x07 line\nfeed /\x7f";
    CHECK(parsed_text(awkward).get<std::string>() == awkward);
    const std::string foreign =
        "Gr\xc3\xb6\xc3\x9f"
        "e \xe4\xb8\xad \xf0\x9f\x98\x80";
    CHECK(parsed_text(foreign).get<std::string>() == foreign);
    // Latin-1, an overlong slash, a surrogate, a truncated sequence.
    CHECK(parsed_text("a\xf6z").get<std::string>() == "a\xef\xbf\xbdz");
    CHECK(parsed_text("\xc0\xaf").get<std::string>() == "\xef\xbf\xbd\xef\xbf\xbd");
    CHECK(parsed_text("\xed\xa0\x80").get<std::string>().find("\xed") == std::string::npos);
    CHECK(parsed_text("\xe4\xb8").get<std::string>() == "\xef\xbf\xbd\xef\xbf\xbd");
}

TEST_CASE("random bytes always give a document that parses") {
    std::mt19937 random(static_cast<unsigned>(synthetic::test_seed()));
    for (int round = 0; round < 20000; round++) {
        std::string bytes;
        const size_t length = random() % 12;
        for (size_t i = 0; i < length; i++) {
            bytes.push_back(static_cast<char>(1 + random() % 255));
        }
        CHECK(parsed_text(bytes).is_string());
    }
}
