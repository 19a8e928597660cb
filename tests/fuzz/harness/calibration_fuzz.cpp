// SPDX-License-Identifier: Apache-2.0
// The unchanged calibration text: its checksum rejects nearly every change.
#include <cstdint>

#include "calibration_property.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t *data, std::size_t size) {
    check_calibration_text(std::string(reinterpret_cast<const char *>(data), size));
    return 0;
}
