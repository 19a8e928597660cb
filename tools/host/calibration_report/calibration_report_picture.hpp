// SPDX-License-Identifier: Apache-2.0
/// Grey pictures of the page: loading, shrinking, rectifying, encoding.
#ifndef VERGENCE_TOOLS_HOST_CALIBRATION_REPORT_CALIBRATION_REPORT_PICTURE_HPP
#define VERGENCE_TOOLS_HOST_CALIBRATION_REPORT_CALIBRATION_REPORT_PICTURE_HPP

#include <cstdint>
#include <string>
#include <vector>

#include "tools/host/calibration_report/calibration_report.hpp"
#include "tools/host/convert/export.hpp"

struct calibration_picture {
    std::vector<std::uint8_t> grey;  // rows without gaps
    int width_px = 0, height_px = 0;
};

/// Calls the page's loader. Returns false when the picture is unavailable.
bool calibration_picture_load(const calibration_page &page, std::size_t capture, int camera,
                              calibration_picture *picture);

/// At most `width_px` wide, by the mean of the pixels that a new one covers.
calibration_picture calibration_picture_shrink(const calibration_picture &picture, int width_px);

/// What the rectified camera of `side` (0 left, 1 right) sees, `scale` times the size of the left
/// raw image (scale <= 1); black outside the raw image.
calibration_picture calibration_picture_rectify(const calibration_picture &raw,
                                                const calibration &rig,
                                                const export_rectified &rectified, int side,
                                                double scale);

/// A data: URI; "" on failure.
std::string calibration_picture_jpeg(const calibration_picture &picture);

#endif
