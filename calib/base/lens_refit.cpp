// SPDX-License-Identifier: Apache-2.0
#include "calib/base/lens_refit.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "calib/base/linear.hpp"

namespace calib {

namespace {

// Ideal and distorted coordinates of one ray.
struct ray_place {
    double ideal[2], distorted[2];
};

// Over the whole image, as far as the lens is one to one.
std::vector<ray_place> rays_of(const lens &exact) {
    const int across = 64, down = 48;
    const double seen = lens_view_radius(&exact);
    std::vector<ray_place> rays;
    for (int row = 0; row <= down; row++) {
        for (int column = 0; column <= across; column++) {
            const double pixel_px[2] = {double(exact.width_px - 1) * column / across,
                                        double(exact.height_px - 1) * row / down};
            double ray[3];
            if (lens_ray(&exact, pixel_px, ray) && std::hypot(ray[0], ray[1]) < seen) {
                rays.push_back({{ray[0], ray[1]},
                                {(pixel_px[0] - exact.cx_px) / exact.fx_px,
                                 (pixel_px[1] - exact.cy_px) / exact.fy_px}});
            }
        }
    }
    return rays;
}

// The model is linear in its coefficients. Unknowns are scaled to the farthest ray.
lens fit(const lens &exact, const std::vector<ray_place> &rays) {
    double radius = 0;
    for (const ray_place &one : rays) {
        radius = std::max(radius, std::hypot(one.ideal[0], one.ideal[1]));
    }
    matrix A = matrix::Zero(4, 4);
    vector b = vector::Zero(4);
    for (const ray_place &one : rays) {
        const double x = one.ideal[0] / radius, y = one.ideal[1] / radius, r2 = x * x + y * y;
        const double rows[2][4] = {{x * r2, x * r2 * r2, 2 * x * y, r2 + 2 * x * x},
                                   {y * r2, y * r2 * r2, r2 + 2 * y * y, 2 * x * y}};
        for (int axis = 0; axis < 2; axis++) {
            const vector row = Eigen::Map<const vector>(rows[axis], 4);
            A += row * row.transpose();
            b += (one.distorted[axis] - one.ideal[axis]) / radius * row;
        }
    }
    const vector k = solve_symmetric(A, b);
    lens result = exact;
    result.k1 = k[0] / std::pow(radius, 2);
    result.k2 = k[1] / std::pow(radius, 4);
    result.p1 = k[2] / radius;
    result.p2 = k[3] / radius;
    result.k3 = result.k4 = result.k5 = result.k6 = 0;
    result.kind = LENS_BROWN_CONRADY;
    return result;
}

}  // namespace

lens_refit refit_without_k3(const lens &exact) {
    const std::vector<ray_place> rays = rays_of(exact);
    lens_refit result = {fit(exact, rays), 0, 0};
    double squares = 0;
    for (const ray_place &one : rays) {
        double moved[2];
        lens_distort(&result.fitted, one.ideal, moved);
        const double off_px = std::hypot((moved[0] - one.distorted[0]) * exact.fx_px,
                                         (moved[1] - one.distorted[1]) * exact.fy_px);
        squares += off_px * off_px;
        result.max_px = std::max(result.max_px, off_px);
    }
    result.rms_px = std::sqrt(squares / double(rays.size()));
    return result;
}

}  // namespace calib
