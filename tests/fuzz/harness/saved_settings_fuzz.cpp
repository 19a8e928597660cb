// SPDX-License-Identifier: Apache-2.0
// Any record of saved settings is read or rejected with a message; what was read prints as a text
// that reads as the same; and its commands fit.
#include <cstdint>
#include <cstring>

#include "daemon/settings/saved_settings.h"
#include "fuzz_check.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t *data, std::size_t size) {
    saved_settings saved;
    message message_out;
    message_out.text[0] = '\0';
    const char *input = reinterpret_cast<const char *>(data);
    const int error = saved_settings_parse(input, size, &saved, &message_out);
    FUZZ_CHECK(error <= 0);
    if (error != 0) {
        FUZZ_CHECK(message_out.text[0] != '\0');
        return 0;
    }
    char text[SAVED_SETTINGS_BYTES];
    const std::size_t length = saved_settings_print(&saved, text);
    saved_settings again;
    FUZZ_CHECK(saved_settings_parse(text, length, &again, &message_out) == 0);
    FUZZ_CHECK(std::memcmp(again.values, saved.values, sizeof saved.values) == 0);
    static rig down;  // only the presence of a bridge in its profile is used
    char lines[SAVED_SETTINGS_LINES][SAVED_SETTINGS_LINE_BYTES];
    std::size_t of_cameras = 0;
    down.state = RIG_READY;
    const std::size_t count = saved_settings_commands(&saved, &down, lines, &of_cameras);
    FUZZ_CHECK(of_cameras <= count && count <= SAVED_SETTINGS_LINES);
    message why;
    why.text[0] = '\0';
    FUZZ_CHECK((saved_settings_check(&saved, &down, &why) != 0) == (why.text[0] != '\0'));
    return 0;
}
