// SPDX-License-Identifier: Apache-2.0
// Any settings file is accepted or refused with its line; accepted settings, printed key by key and
// read again, are the same.
#include <cstring>
#include <string>

#include "daemon/settings/config.h"
#include "fuzz_check.hpp"

namespace {

std::string printed(const config &settings) {
    std::string text;
    for (size_t i = 0; i < config_key_count(); i++) {
        char value[CONFIG_TEXT_BYTES + 16];
        config_key_print(&settings, i, value, sizeof value);
        text += std::string(config_key_name(i)) + " = " + value + "\n";
    }
    return text;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t *data, std::size_t size) {
    config settings;
    message message_out;
    config_defaults(&settings);
    message_out.text[0] = '\0';
    const int error =
        config_parse(&settings, "FILE", reinterpret_cast<const char *>(data), size, &message_out);
    FUZZ_CHECK(error <= 0);
    if (error != 0) {
        FUZZ_CHECK(std::strncmp(message_out.text, "FILE:", 5) == 0);
        return 0;
    }
    const std::string text = printed(settings);
    config again;
    config_defaults(&again);
    FUZZ_CHECK(config_parse(&again, "FILE", text.data(), text.size(), &message_out) == 0);
    FUZZ_CHECK(printed(again) == text);
    return 0;
}
