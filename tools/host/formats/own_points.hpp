// SPDX-License-Identifier: Apache-2.0
/// The points.pcd of our own results.
#ifndef VERGENCE_TOOLS_HOST_FORMATS_OWN_POINTS_HPP
#define VERGENCE_TOOLS_HOST_FORMATS_OWN_POINTS_HPP

#include <cstddef>
#include <istream>

/// Reads the header: number of points, and mm for one unit. The points follow: x y z rgb sigma, a
/// float each. False: it is another file, or its lengths are of an assumed unit.
bool own_points_header(std::istream &stream, std::size_t *count, double *unit_mm);

#endif
