// SPDX-License-Identifier: Apache-2.0
/// Captures whose corners the detector finds in rendered frames, kept as a text: rendering takes
/// minutes, solving seconds.
#ifndef VERGENCE_TESTS_ZOOM_RENDERED_BOARD_HPP
#define VERGENCE_TESTS_ZOOM_RENDERED_BOARD_HPP

#include <string>
#include <vector>

#include "tests/study/zoom/study_rig.hpp"
#include "tools/simrig/render/frame.hpp"

namespace zoom_study {

/// A mosaic developed to grey, as the daemon does for matching.
std::vector<uint8_t> develop_grey(const world::Frame &frame);

/// Twelve board positions, the lenses' positions known exactly. `only` >= 0: only that pair is
/// rendered, the other ones have simulated corners.
calib::zoom_observations rendered_capture(const std::string &rig, uint64_t seed, int only);

void write_corners(const calib::zoom_observations &seen, const std::string &path);
/// Throws std::runtime_error.
calib::zoom_observations read_corners(const std::string &path);

/// The largest distance in px between the corners of a pair and those of the kept one; throws if
/// they are not the same corners.
double corner_distance(const calib::zoom_observations &seen, const calib::zoom_observations &kept,
                       size_t pair);

}  // namespace zoom_study

#endif
