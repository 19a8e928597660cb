// SPDX-License-Identifier: Apache-2.0
// Bytes as a lens controller's line may deliver them: the reader that takes one byte at a time
// returns the same answers as a simple one that has them all.
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "device/lens_v3lc_answer.h"
#include "fuzz_check.hpp"

namespace {

struct Answer {
    int lens;
    int values[LENS_V3LC_VALUES];
    bool operator==(const Answer &other) const {
        return lens == other.lens && values[0] == other.values[0] && values[1] == other.values[1] &&
               values[2] == other.values[2];
    }
};

// -1: none, as below.
int lens_of(const std::string &record, bool single) {
    if (single) {
        return record.find(':') == std::string::npos && record.size() <= LENS_V3LC_RECORD ? 0 : -1;
    }
    return record == "V3LC 1" ? 0 : record == "V3LC 2" ? 1 : -1;
}

int value_of(const std::string &record) {
    const size_t colon = record.find(':');
    const size_t digits =
        colon == std::string::npos ? colon : record.find_first_not_of(' ', colon + 1);
    if (digits == std::string::npos || record.size() - digits > 4 ||
        record.find_first_not_of("0123456789", digits) != std::string::npos ||
        record.size() > LENS_V3LC_RECORD) {
        return -1;
    }
    return std::stoi(record.substr(digits));
}

// Records with an answer's lens and the three values behind it.
std::vector<Answer> plainly(const std::string &text, bool single) {
    std::vector<std::string> records(1);
    for (const char byte : text) {
        if (byte == '\r' || byte == '\n') {
            records.emplace_back();
        } else {
            records.back() += byte;
        }
    }
    records.pop_back();  // has no end yet
    std::vector<Answer> answers;
    std::optional<Answer> begun;
    int count = 0;
    for (const std::string &record : records) {
        if (record.empty()) {
            continue;
        }
        const int lens = lens_of(record, single);
        int value = lens >= 0 ? -1 : value_of(record);
        const bool whole = record.size() <= LENS_V3LC_RECORD;
        if (single && begun && count == 2 && whole && record.find(':') != std::string::npos) {
            value = 0;
        }
        if (begun && value >= 0) {
            begun->values[count++] = value;
            if (count == LENS_V3LC_VALUES) {
                answers.push_back(*begun);
                begun.reset();
            }
            continue;
        }
        count = 0;
        begun = lens >= 0 ? std::optional<Answer>(Answer{lens, {0, 0, 0}}) : std::nullopt;
    }
    return answers;
}

void check(const std::string &text, bool single) {
    lens_v3lc_answer reader{};
    std::vector<Answer> answers;
    for (const char byte : text) {
        const lens_v3lc_event event = lens_v3lc_answer_take(&reader, single, uint8_t(byte));
        FUZZ_CHECK(event == LENS_V3LC_NOTHING || byte == '\r' || byte == '\n');
        FUZZ_CHECK(reader.count < LENS_V3LC_VALUES && reader.length <= LENS_V3LC_RECORD + 1);
        if (event == LENS_V3LC_ANSWER) {
            answers.push_back(
                {reader.number, {reader.values[0], reader.values[1], reader.values[2]}});
            for (const int value : answers.back().values) {
                FUZZ_CHECK(value >= 0 && value <= 9999);
            }
        }
    }
    FUZZ_CHECK(answers == plainly(text, single));
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t *data, std::size_t size) {
    const std::string text(reinterpret_cast<const char *>(data), size);
    check(text, false);
    check(text, true);
    return 0;
}
