// SPDX-License-Identifier: Apache-2.0
// Any record of saved settings is read or rejected with a message; what was read prints as the same
// bytes, or, from an older version, as bytes that read as the same; and its commands fit.
#include <cstdint>
#include <cstring>

#include "daemon/settings/kept_settings.h"
#include "fuzz_check.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t *data, std::size_t size) {
    kept_settings kept;
    message said;
    said.text[0] = '\0';
    const char *input = reinterpret_cast<const char *>(data);
    const int error = kept_settings_parse(input, size, &kept, &said);
    FUZZ_CHECK(error <= 0);
    if (error != 0) {
        FUZZ_CHECK(said.text[0] != '\0');
        return 0;
    }
    char text[KEPT_SETTINGS_BYTES];
    const std::size_t length = kept_settings_print(&kept, text);
    const char current[] = "vergence settings 2";
    if (std::memcmp(text, input, sizeof current - 1) == 0) {
        FUZZ_CHECK(length == size && std::memcmp(text, input, size) == 0);
    } else {
        kept_settings again;
        FUZZ_CHECK(kept_settings_parse(text, length, &again, &said) == 0);
        FUZZ_CHECK(std::memcmp(again.values, kept.values, sizeof kept.values) == 0);
    }
    static rig down;  // of its profile only the presence of a bridge is used
    char lines[KEPT_SETTINGS_LINES][KEPT_SETTINGS_LINE_BYTES];
    std::size_t of_cameras = 0;
    down.state = RIG_READY;
    const std::size_t count = kept_settings_commands(&kept, &down, lines, &of_cameras);
    FUZZ_CHECK(of_cameras <= count && count <= KEPT_SETTINGS_LINES);
    message why;
    why.text[0] = '\0';
    FUZZ_CHECK((kept_settings_check(&kept, &down, &why) != 0) == (why.text[0] != '\0'));
    return 0;
}
