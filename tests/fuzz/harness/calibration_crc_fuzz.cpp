// SPDX-License-Identifier: Apache-2.0
// The calibration text with a valid checksum, so that changes reach deep into the parser:
// the input is the text before the last line.
#include <cstdint>
#include <cstdio>

#include "calibration_property.hpp"
#include "core/crc.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t *data, std::size_t size) {
    std::string text(reinterpret_cast<const char *>(data), size);
    char line[32];
    std::snprintf(line, sizeof line, "crc32 %08x\n", crc_update(0, data, size));
    check_calibration_text(text + line);
    return 0;
}
