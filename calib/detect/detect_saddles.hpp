// SPDX-License-Identifier: Apache-2.0
/// Candidate points where four squares of a board meet: saddle points of the grey levels around
/// which light and dark alternate twice.
#ifndef VERGENCE_CALIB_DETECT_DETECT_SADDLES_HPP
#define VERGENCE_CALIB_DETECT_DETECT_SADDLES_HPP

#include <array>
#include <optional>
#include <vector>

#include "calib/detect/detect_pyramid.hpp"

namespace calib::detect {

struct direction {
    double x = 0, y = 0;  // unit vector
};

/// Four rays leave a saddle along the edges of its squares: ray 0 and, clockwise on the screen,
/// rays 1 to 3. Crossing rays 0 and 2 clockwise leads from dark to light, rays 1 and 3 back.
struct saddle {
    double x = 0, y = 0;  // position in pixels of the level
    double contrast = 0;  // light minus dark, grey levels times pixel_scale
    std::array<direction, 4> rays;
};

/// The saddle at (x, y), tested on a circle of `radius`. Empty when the circle leaves the image or
/// does not show two light and two dark arcs that mirror each other through the centre.
std::optional<saddle> saddle_at(const plane &level, double x, double y, double radius);

/// All saddles of a level, highest contrast first, at most `max`.
std::vector<saddle> saddles_of(const plane &level, size_t max);

}  // namespace calib::detect

#endif
