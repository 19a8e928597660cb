// SPDX-License-Identifier: Apache-2.0
/// A picture of the surface for readers whose browser cannot draw it.
#ifndef VERGENCE_TOOLS_HOST_REPORT_REPORT_STILL_HPP
#define VERGENCE_TOOLS_HOST_REPORT_REPORT_STILL_HPP

#include <string>

#include "stereo/reconstruct.h"

/// The surface in its colours, seen obliquely, as a JPEG `data:` URI; "" without points.
std::string report_still(const reconstruct_result &result);

#endif
