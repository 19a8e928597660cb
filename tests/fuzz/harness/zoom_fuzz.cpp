// SPDX-License-Identifier: Apache-2.0
// The text of a calibration of all zooms with a valid checksum: the input is the text before the
// last line. An accepted text of the present version prints back byte by byte, and any has a
// calibration or an error at any state.
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <memory>
#include <string>
#include <vector>

#include "core/crc.h"
#include "core/error.h"
#include "fuzz_check.hpp"
#include "stereo/zoom/zoom_aim.h"
#include "stereo/zoom/zoom_grammar.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t *data, std::size_t size) {
    char line[32];
    std::snprintf(line, sizeof line, "crc32 %08x\n", crc_update(0, data, size));
    const std::string input = std::string(reinterpret_cast<const char *>(data), size) + line;
    auto parsed = std::make_unique<zoom_calibration>();
    calibration_fault fault = {-1, nullptr, nullptr, 0};
    const int code =
        zoom_calibration_parse(input.data(), input.size(), nullptr, parsed.get(), &fault);
    if (code != ERROR_OK) {
        FUZZ_CHECK(code < 0);
        FUZZ_CHECK(fault.line >= 0 && fault.field != nullptr && fault.reason != nullptr);
        return 0;
    }
    std::vector<char> text(ZOOM_TEXT_MAX_BYTES);
    const int length = zoom_calibration_print(parsed.get(), text.data(), text.size());
    FUZZ_CHECK(length > 0);
    FUZZ_CHECK(input.rfind(ZOOM_GRAMMAR_MAGIC "2", 0) != 0 ||
               std::string(text.data(), static_cast<size_t>(length)) == input);
    zoom_state state{};
    double point_mm[3];
    for (int side = 0; side < 2; side++) {
        state.side[side].zoom_counts = parsed->camera[side].zoom.max;
        state.side[side].focus_counts = parsed->camera[side].focus.min;
        state.side[side].pan_rad = parsed->camera[side].pan_rad.min;
    }
    calibration at;
    FUZZ_CHECK(zoom_calibration_at(parsed.get(), &state, &at, &fault) <= 0);
    zoom_point_ahead(parsed.get(), 1000, 10, point_mm);
    FUZZ_CHECK(zoom_aim(parsed.get(), point_mm, &state, nullptr) <= 0);
    return 0;
}
