// SPDX-License-Identifier: Apache-2.0
#include "core/base64.h"

#include <doctest/doctest.h>

#include <random>
#include <string>

#include "synthetic/seed.hpp"

namespace {

std::string encoded(const std::string &bytes) {
    std::string text(BASE64_TEXT_BYTES(bytes.size()), '?');
    base64_encode(bytes.data(), bytes.size(), text.data());
    CHECK(text.back() == '\0');
    text.pop_back();
    return text;
}

/// "refused" if the text is not valid.
std::string decoded(const std::string &text, std::size_t capacity = 1000) {
    std::string bytes(capacity + 1, '#');
    const long count = base64_decode(text.c_str(), bytes.data(), capacity);
    CHECK(bytes.back() == '#');
    if (count < 0) {
        return "refused";
    }
    bytes.resize(static_cast<std::size_t>(count));
    return bytes;
}

}  // namespace

TEST_CASE("the examples of RFC 4648") {
    const std::string examples[][2] = {
        {"", ""},
        {"f", "Zg=="},
        {"fo", "Zm8="},
        {"foo", "Zm9v"},
        {"foob", "Zm9vYg=="},
        {"fooba", "Zm9vYmE="},
        {"foobar", "Zm9vYmFy"},
    };
    for (const auto &example : examples) {
        CHECK(encoded(example[0]) == example[1]);
        CHECK(decoded(example[1]) == example[0]);
    }
}

TEST_CASE("random bytes are decoded to themselves, and only the canonical text is accepted") {
    std::mt19937_64 random(synthetic::test_seed());
    for (int i = 0; i < 2000; i++) {
        std::string bytes(random() % 300, '\0');
        for (char &c : bytes) {
            c = static_cast<char>(random());
        }
        std::string text = encoded(bytes);
        REQUIRE(decoded(text) == bytes);
        REQUIRE(decoded(text, bytes.size()) == bytes);
        if (bytes.empty()) {
            continue;
        }
        REQUIRE(decoded(text, bytes.size() - 1) == "refused");
        // A modified text is decoded to other bytes, or rejected.
        text[random() % text.size()] = static_cast<char>(1 + random() % 255);
        const std::string other = decoded(text);
        REQUIRE((other == "refused" || encoded(other) == text));
    }
}

TEST_CASE("invalid Base64 is rejected") {
    for (const char *text : {"Z", "Zg", "Zg=", "=", "====", "Zg==Zg==", "Z===", "Zh==", "Zm9=",
                             "Zm 9", "Zm9v\n", "Zm9-", "Zm9_", "Z=8="}) {
        CHECK_MESSAGE(decoded(text) == "refused", text);
    }
}
