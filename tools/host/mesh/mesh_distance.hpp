// SPDX-License-Identifier: Apache-2.0
/// Distance between a simplified surface and the measured points: each point's distance from the
/// plane of the triangle that covers its pixel in the rectified left image.
#ifndef VERGENCE_TOOLS_HOST_MESH_MESH_DISTANCE_HPP
#define VERGENCE_TOOLS_HOST_MESH_MESH_DISTANCE_HPP

#include <array>
#include <cstdint>
#include <vector>

#include "stereo/reconstruct.h"

struct mesh_distance {
    double median_mm = 0, p99_mm = 0, max_mm = 0;
    std::uint32_t uncovered = 0;  // points that no triangle covers
};

/// Which vertices of the full surface have a triangle; the others are isolated points.
std::vector<bool> mesh_distance_joined(const reconstruct_result &full);

/// Normal of a triangle, twice as long as its area in square micrometres, towards the camera.
std::array<double, 3> mesh_distance_normal(const triangulate_point &a, const triangulate_point &b,
                                           const triangulate_point &c);

/// `triangles`: three indices of the full surface's vertices each.
mesh_distance mesh_distance_measure(const reconstruct_result &full, const std::vector<bool> &joined,
                                    const std::vector<std::uint32_t> &triangles);

#endif
