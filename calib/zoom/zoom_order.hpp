// SPDX-License-Identifier: Apache-2.0
/// How many terms each lens function has, by cross-validation: settings are left out one at a time,
/// and their corners predicted from the others'.
#ifndef VERGENCE_CALIB_ZOOM_ZOOM_ORDER_HPP
#define VERGENCE_CALIB_ZOOM_ZOOM_ORDER_HPP

#include <functional>

#include "calib/zoom/zoom_equations.hpp"

namespace calib {

/// The most terms that so many settings could determine.
zoom_orders richest_orders(const zoom_problem &problem);

/// The fewest terms that predict the left-out settings as well as any, within a standard error of
/// the difference. `estimate` is the solution with the layout's orders; the equations are linear
/// about it. The settings at the ends are not left out, as nothing is extrapolated.
zoom_orders choose_orders(const zoom_problem &problem, const zoom_layout &layout,
                          const zoom_prior &prior, const zoom_weights &weights,
                          const zoom_estimate &estimate, const std::function<void()> &between);

/// The same estimate with other orders; terms that it does not have are 0.
std::vector<double> with_orders(const zoom_layout &from, const std::vector<double> &values,
                                const zoom_layout &to, double otherwise);

}  // namespace calib

#endif
