// SPDX-License-Identifier: Apache-2.0
/// Views and corners that contradict the others, each with a reason for the user.
#ifndef VERGENCE_CALIB_ZOOM_ZOOM_ROBUST_HPP
#define VERGENCE_CALIB_ZOOM_ZOOM_ROBUST_HPP

#include <string>
#include <vector>

#include "calib/zoom/zoom_view.hpp"

namespace calib {

struct zoom_rejection {
    size_t capture;
    int camera;
    int index;  // number of the corner; -1: the whole view
    double off_px;
    std::string reason;
};

/// Standard deviation of the used corners' residuals over their sigmas, from the median of their
/// lengths.
double zoom_robust_scale(const zoom_problem &problem, const zoom_layout &layout,
                         const zoom_estimate &estimate);

/// Judges every view and corner again, used or not, and sets their `used`. A view is wrong when
/// more than a quarter of its corners are, and more than four. Returns whether any `used` has
/// changed.
bool assess_zoom(zoom_problem *problem, const zoom_layout &layout, const zoom_estimate &estimate,
                 double scale, std::vector<zoom_rejection> *rejections);

}  // namespace calib

#endif
