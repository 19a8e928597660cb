// SPDX-License-Identifier: Apache-2.0
/// Which saddles are neighbours on a board: connected by an edge with light on one side and dark on
/// the other along its whole length.
#ifndef VERGENCE_CALIB_DETECT_DETECT_LINKS_HPP
#define VERGENCE_CALIB_DETECT_DETECT_LINKS_HPP

#include <array>
#include <vector>

#include "calib/detect/detect_saddles.hpp"

namespace calib::detect {

/// The other end of a ray: ray `ray` of saddle `to` comes back along the same edge; `to` < 0: no
/// neighbour.
struct link {
    int to = -1, ray = -1;
};

using saddle_links = std::array<link, 4>;

/// Whether ray `ray` of `from`, followed to `to`, is on one edge from end to end.
bool edge_between(const plane &level, const saddle &from, size_t ray, const saddle &to);

/// The ray of `to` that comes back along ray `ray` of `from`; -1 if not found.
int returning_ray(const saddle &from, size_t ray, const saddle &to);

/// For each ray of each saddle its nearest neighbour at a distance of at least `nearest_px`; only
/// links on which both ends agree.
std::vector<saddle_links> links_of(const plane &level, const std::vector<saddle> &saddles,
                                   double nearest_px);

}  // namespace calib::detect

#endif
