// SPDX-License-Identifier: Apache-2.0
#include "core/utf8.h"

#include <doctest/doctest.h>

#include <string>

namespace {

std::string copied(const std::string &text, size_t bytes) {
    std::string to(bytes, 'x');
    utf8_copy_printable(text.c_str(), &to[0], bytes);
    return to.c_str();
}

}  // namespace

TEST_CASE("a text is copied in whole characters, without control characters") {
    CHECK(copied("na\u00efve", 16) == "na\u00efve");
    CHECK(copied("na\u00efve", 5) == "na\u00ef");
    CHECK(copied("na\u00efve", 4) == "na");
    CHECK(copied("\u20ac", 3).empty());
    CHECK(copied("a\033b\xff", 16) == "a?b?");
    CHECK(copied("a\u202eb", 16) == "a???b");
    CHECK(copied("abc", 1).empty());
}
