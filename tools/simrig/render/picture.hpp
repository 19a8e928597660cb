// SPDX-License-Identifier: Apache-2.0
/// Writes frames and truth as files.
#ifndef VERGENCE_TOOLS_SIMRIG_RENDER_PICTURE_HPP
#define VERGENCE_TOOLS_SIMRIG_RENDER_PICTURE_HPP

#include <string>

#include "tools/simrig/render/frame.hpp"

namespace world {

/// Eight bits, three channels.
struct Picture {
    int columns = 0;
    int rows = 0;
    std::vector<std::uint8_t> rgb;
};

/// A frame as a photograph: demosaiced (Malvar, He, Cutler 2004), white balanced by the sensor's
/// filters, sRGB with a soft shoulder. `exposure`: what white is multiplied by.
Picture developed(const Frame &frame, const Sensor &sensor, double exposure);

/// Each writes one file; throws std::runtime_error with the file's name on failure.
void write_png(const std::string &path, const Picture &picture);
void write_raw_pgm(const std::string &path, const Frame &frame);  ///< 16 bits, largest value 1023
void write_depth_pfm(const std::string &path, const Truth &truth);
void write_normal_pfm(const std::string &path, const Truth &truth);  ///< x, y, z as three channels
void write_object_pgm(const std::string &path, const Truth &truth);  ///< 8 bits, the objects' ids
void write_camera_yaml(const std::string &path, const Truth &truth);

/// The camera in the middle of the frame's exposure and the window, as YAML: pixels are those of
/// the whole array, the pose is T_world_camera. tools/simrig/README.md describes the keys.
std::string camera_text(const Truth &truth);

}  // namespace world

#endif
