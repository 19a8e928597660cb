// SPDX-License-Identifier: Apache-2.0
/// Lengths, planes and cylinders from the points of a surface, with their standard deviations.
///
/// A deviation has two parts. The points' own errors: each point's predicted sigma, where points of
/// one block of the image (`fit_block_px`) share their error, as the matcher's windows overlap; for
/// fits of many blocks it is taken from the residuals of the blocks (Liang and Zeger, "Longitudinal
/// data analysis using generalized linear models", 1986). And what all depths share, which no
/// averaging removes: an offset of the disparity, so that it grows with the square of the depth.
#ifndef VERGENCE_TOOLS_HOST_FIT_FIT_HPP
#define VERGENCE_TOOLS_HOST_FIT_FIT_HPP

#include <array>
#include <cstddef>
#include <string>
#include <vector>

#include "tools/host/fit/fit_types.hpp"

/// Depth (z) of a point.
fit_value fit_depth(const fit_point &point, const fit_common &common);

/// Distance between two points.
fit_value fit_distance(const fit_point &a, const fit_point &b, const fit_common &common);

/// n p = distance, for points p on it. Points that lie far off it have no weight.
struct fit_plane_result {
    std::array<double, 3> normal;  // towards the camera, length 1
    std::array<double, 3> centre_mm;
    fit_value distance_mm;    // of the centre of the left camera from the plane
    fit_value tilt_deg;       // between the normal and the camera's axis
    double normal_sigma_deg;  // of the normal's direction, the larger of the two
    double rms_mm;            // of the points used, perpendicular to the plane
    std::size_t points, used;
};

struct fit_cylinder_result {
    std::array<double, 3> axis;       // length 1, y > 0
    std::array<double, 3> centre_mm;  // on the axis, in the middle of the points used
    fit_value radius_mm;
    double axis_sigma_deg;
    double length_mm;  // extent of the points used along the axis
    double rms_mm;
    std::size_t points, used;
};

/// False, with one sentence in `message`: too few points, or they do not determine the shape.
bool fit_plane(const std::vector<fit_point> &points, const fit_common &common,
               fit_plane_result *result, std::string *message);
bool fit_cylinder(const std::vector<fit_point> &points, const fit_common &common,
                  fit_cylinder_result *result, std::string *message);

#endif
