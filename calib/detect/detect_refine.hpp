// SPDX-License-Identifier: Apache-2.0
/// From a grid found on a level of the pyramid to corners of the image, to hundredths of a pixel.
#ifndef VERGENCE_CALIB_DETECT_DETECT_REFINE_HPP
#define VERGENCE_CALIB_DETECT_DETECT_REFINE_HPP

#include <vector>

#include "calib/detect/detect_fit.hpp"
#include "calib/detect/detect_grid.hpp"

namespace calib::detect {

struct refined_corner {
    bool found = false;
    double x = 0, y = 0;  // in the image's pixels
    double sigma_px = 0;
};

struct refined_grid {
    std::vector<refined_corner> corners;  // in the order of the grid's nodes
    double blur_px = 0;                   // median
    double spacing_px = 0;                // median distance of neighbours
};

/// The corners where the search saw them, good to about half a pixel of the level; not measured.
refined_grid as_found(int level, const grid &found);

/// `clear_share`: how far the squares are free of print beside their edges, as a share of their
/// side (a coded board's markers begin there).
refined_grid refine(const std::vector<plane> &levels, int level, const grid &found,
                    double clear_share);

}  // namespace calib::detect

#endif
