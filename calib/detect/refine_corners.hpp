// SPDX-License-Identifier: Apache-2.0
/// Refines a grid found on a pyramid level to corners of the image, accurate to hundredths of a
/// pixel.
#ifndef VERGENCE_CALIB_DETECT_REFINE_CORNERS_HPP
#define VERGENCE_CALIB_DETECT_REFINE_CORNERS_HPP

#include <vector>

#include "calib/detect/detect_fit.hpp"
#include "calib/detect/detect_grid.hpp"

namespace calib::detect {

struct refined_corner {
    bool found = false;
    double x = 0, y = 0;  // pixels of the full-size image
    double sigma_px = 0;
};

struct refined_grid {
    std::vector<refined_corner> corners;  // same order as the nodes of the grid
    double blur_px = 0;                   // median
    double spacing_px = 0;                // median distance between neighbours
};

/// The corners as the search found them, accurate to about half a pixel of the level; not measured.
refined_grid as_found(int level, const grid &found);

/// `clear_share`: width of the area free of print along the edges of a square, as a share of its
/// side (a coded board's markers begin there).
refined_grid refine_corners(const std::vector<plane> &levels, int level, const grid &found,
                            double clear_share);

}  // namespace calib::detect

#endif
