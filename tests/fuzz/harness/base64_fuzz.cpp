// SPDX-License-Identifier: Apache-2.0
// Decoded Base64 encodes to the same text, for any size of the output.
#include <cstring>
#include <string>
#include <vector>

#include "core/base64.h"
#include "fuzz_check.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t *data, std::size_t size) {
    const std::string text(reinterpret_cast<const char *>(data), size);
    const std::size_t length = std::strlen(text.c_str());
    std::vector<std::uint8_t> bytes(length / 4 * 3 + 1);
    const long count = base64_decode(text.c_str(), bytes.data(), bytes.size());
    if (count < 0) {
        return 0;
    }
    const auto done = static_cast<std::size_t>(count);
    FUZZ_CHECK(done <= length / 4 * 3);
    std::vector<char> again(BASE64_TEXT_BYTES(done));
    base64_encode(bytes.data(), done, again.data());
    FUZZ_CHECK(std::strcmp(again.data(), text.c_str()) == 0);
    std::vector<std::uint8_t> less(done);
    FUZZ_CHECK(base64_decode(text.c_str(), less.data(), done) == count);
    FUZZ_CHECK(done == 0 || base64_decode(text.c_str(), less.data(), done - 1) == -1);
    return 0;
}
