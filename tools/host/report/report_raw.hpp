// SPDX-License-Identifier: Apache-2.0
/// Where the pixels of the page are in the images as they were taken.
#ifndef VERGENCE_TOOLS_HOST_REPORT_REPORT_RAW_HPP
#define VERGENCE_TOOLS_HOST_REPORT_REPORT_RAW_HPP

#include <string>

#include "daemon/surface/result/reconstruct_context.h"

/// A coarse grid over the rectified images as JSON: {"step":, "columns":, "left": [x,y,...],
/// "right": [...]}, to be interpolated linearly; row by row, nodes `step` pixels apart from pixel
/// (0,0) on, null outside the lens's model. "null" without a calibration.
std::string report_raw_grid(const reconstruct_context &context);

#endif
