// SPDX-License-Identifier: Apache-2.0
/// The property of the calibration parser, for every text.
#ifndef VERGENCE_TESTS_FUZZ_CALIBRATION_PROPERTY_HPP
#define VERGENCE_TESTS_FUZZ_CALIBRATION_PROPERTY_HPP

#include <cstring>
#include <string>

#include "core/error.h"
#include "fuzz_check.hpp"
#include "stereo/geometry/calibration.h"
#include "stereo/geometry/rectify.h"

/// An accepted text prints back byte by byte, and its pair is planned or refused; a refused text
/// names line and reason and leaves the result alone.
inline void check_calibration_text(const std::string &input) {
    calibration parsed, before;
    std::memset(&parsed, 0x5a, sizeof parsed);
    std::memcpy(&before, &parsed, sizeof parsed);
    calibration_fault fault = {-1, nullptr, nullptr, 0};
    const int code = calibration_parse(input.data(), input.size(), &parsed, &fault);
    if (code != ERROR_OK) {
        FUZZ_CHECK(code < 0);
        FUZZ_CHECK(fault.line >= 0 && fault.field != nullptr && fault.reason != nullptr);
        FUZZ_CHECK(std::memcmp(&before, &parsed, sizeof parsed) == 0);
        return;
    }
    char text[CALIBRATION_TEXT_MAX_BYTES];
    const int length = calibration_print(&parsed, text, sizeof text);
    FUZZ_CHECK(length > 0 && std::string(text, static_cast<size_t>(length)) == input);
    FUZZ_CHECK(calibration_validate(&parsed, nullptr) == ERROR_OK);
    (void)calibration_vergence_depth_mm(&parsed);
    rectify_options options = {};
    options.scale = 1;
    rectify_plan plan;
    if (rectify_plan_make(&parsed, &options, &plan) == ERROR_OK) {
        FUZZ_CHECK(plan.width_px > 0 && plan.height_px > 0 && plan.disparity_count > 0);
        FUZZ_CHECK(plan.depth_near_mm > 0 && plan.depth_near_mm <= plan.depth_far_mm);
    }
}

#endif
