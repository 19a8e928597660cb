// SPDX-License-Identifier: Apache-2.0
// The reader accepts what a foreign parser accepts, and finds the same members.
#include <algorithm>
#include <nlohmann/json.hpp>
#include <string>

#include "daemon/base/json_reader.h"
#include "fuzz_check.hpp"

namespace {

int depth_of(const nlohmann::json &value) {
    int deepest = -1;
    if (value.is_structured()) {
        for (const auto &member : value) {
            deepest = std::max(deepest, depth_of(member));
        }
    }
    return deepest + 1;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t *data, std::size_t size) {
    const std::string text(reinterpret_cast<const char *>(data), size);
    const json_value whole = json_reader_parse(text.data(), text.size());
    const char *behind = text.data();
    for (json_value one = json_reader_next(whole, {nullptr, 0}); one.text != nullptr;
         one = json_reader_next(whole, one)) {
        FUZZ_CHECK(one.text > behind && one.text + one.length <= text.data() + text.size());
        FUZZ_CHECK(json_reader_parse(one.text, one.length).text != nullptr);
        behind = one.text;
    }
    const auto other = nlohmann::json::parse(text, nullptr, false);
    // It takes a zero for the end.
    if (other.is_discarded() || text.find('\0') != std::string::npos) {
        return 0;  // the other one also refuses texts that are not UTF-8, and numbers out of range
    }
    FUZZ_CHECK((whole.text != nullptr) == (depth_of(other) <= JSON_READER_DEPTH_MAX));
    if (whole.text == nullptr || !other.is_object()) {
        return 0;
    }
    for (const char *name : {"ok", "id", "error"}) {
        const json_value found = json_reader_member(whole, name);
        if (found.text == nullptr) {
            FUZZ_CHECK(!other.contains(name) || text.find('\\') != std::string::npos);
            continue;
        }
        FUZZ_CHECK(other.contains(name));
        FUZZ_CHECK(json_reader_parse(found.text, found.length).text != nullptr);
        int64_t number = 0;
        char word[64];
        json_reader_integer(found, &number);
        json_reader_text(found, word, sizeof word);
    }
    return 0;
}
