// SPDX-License-Identifier: Apache-2.0
/// A calibration of all zooms on a page, and its states by name.
#ifndef VERGENCE_TOOLS_HOST_INFO_INFO_ZOOM_HPP
#define VERGENCE_TOOLS_HOST_INFO_INFO_ZOOM_HPP

#include <memory>
#include <string>

#include "stereo/zoom/zoom_calibration.h"
#include "tools/host/info/info.hpp"

/// The calibration in a file; empty if the file is something else, or, with `message` set, damaged.
std::unique_ptr<zoom_calibration> info_zoom_read(const std::string &path, std::string *message);

/// Explains it: ranges, focal length with its uncertainty over the zooms, checks.
info_page info_zoom(const std::string &path, const zoom_calibration &value);

/// A state by name: "zoom=421,pan=3.97,right_pan=-3.97,focus=540" (counts and degrees; without a
/// side: of both; "distance=1800", in mm, focuses both lenses and turns both cameras there), or the
/// pair SESSION or SESSION:NUMBER. False, with a line in `message`, if the name is not valid.
bool info_zoom_state(const std::string &name, const zoom_calibration &value, zoom_state *state,
                     std::string *message);

#endif
