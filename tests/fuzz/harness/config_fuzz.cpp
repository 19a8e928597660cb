// SPDX-License-Identifier: Apache-2.0
// Any file of settings ("s" before its text) or profile ("p") is accepted or refused in one line;
// what is accepted, printed key by key and read again, is the same.
#include <cstring>
#include <string>

#include "daemon/settings/config.h"
#include "fuzz_check.hpp"

namespace {

std::string printed(const config &settings, bool profile) {
    std::string text = profile ? std::string("like = ") + settings.like + "\n" : "";
    for (size_t i = 0; i < config_key_count(); i++) {
        char value[CONFIG_TEXT_BYTES + 16];
        config_key_print(&settings, i, value, sizeof value);
        if (!profile || config_key_is_of_rig(i)) {
            text += std::string(config_key_name(i)) + " = " + value + "\n";
        }
    }
    return text;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t *data, std::size_t size) {
    config settings, again;
    message message_out;
    message_out.text[0] = '\0';
    if (size == 0) {
        return 0;
    }
    const bool profile = data[0] == 'p';
    const char *name = profile ? "x.profile" : "x.conf";
    const int error = config_parse(&settings, name, reinterpret_cast<const char *>(data + 1),
                                   size - 1, &message_out);
    FUZZ_CHECK(error <= 0 && (error != 0) == (message_out.text[0] != '\0'));
    if (error != 0) {
        return 0;
    }
    rig_profile_error profile_error;
    FUZZ_CHECK(rig_profile_check(&settings.profile, &profile_error) == 0);
    const std::string text = printed(settings, profile);
    FUZZ_CHECK(config_parse(&again, name, text.data(), text.size(), &message_out) == 0);
    FUZZ_CHECK(printed(again, profile) == text);
    return 0;
}
