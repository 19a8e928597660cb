// SPDX-License-Identifier: Apache-2.0
#include "calib/detect/refine_corners.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "calib/detect/detect_rejection.hpp"
#include "calib/detect/detect_symmetry.hpp"

namespace calib::detect {

namespace {

constexpr double radius_share = 0.45;     // radius over the distance to the nearest neighbour
constexpr double max_sigma_share = 0.04;  // largest sigma over that distance
constexpr double doubtful_misfit = 0.12;  // a centre of symmetry is better above it
constexpr double coarse_radius_px = 10;
constexpr double fine_radius_px = 28;
constexpr double min_radius_px = 3.2;
// Beyond this blur the fit works on a smaller level: it loses nothing and is faster.
constexpr double max_blur_px = 2.6;

struct point {
    bool known = false;
    double x = 0, y = 0;
};

// The corners of a grid as far as they are known.
class points {
  public:
    points(const grid &shape, std::vector<point> values)
        : columns_(shape.columns), rows_(shape.rows), values_(std::move(values)) {}

    const point *at(int column, int row) const {
        if (column < 0 || row < 0 || column >= columns_ || row >= rows_) {
            return nullptr;
        }
        const point &value = values_[index(column, row)];
        return value.known ? &value : nullptr;
    }
    size_t index(int column, int row) const {
        return static_cast<size_t>(row) * static_cast<size_t>(columns_) +
               static_cast<size_t>(column);
    }

  private:
    int columns_, rows_;
    std::vector<point> values_;
};

// Curvature of the grid's line through (column, row), from three corners in line.
bool bend_at(const points &known, int column, int row, bool along_row, double *curvature_px) {
    const int u = along_row ? 1 : 0, v = 1 - u;
    const point *before = known.at(column - u, row - v), *here = known.at(column, row);
    const point *after = known.at(column + u, row + v);
    if (before == nullptr || here == nullptr || after == nullptr) {
        return false;
    }
    const double ux = after->x - before->x, uy = after->y - before->y;
    const double length = std::hypot(ux, uy);
    const double hx = here->x - before->x, hy = here->y - before->y;
    const double height = (ux * hy - uy * hx) / length;
    *curvature_px =
        -2 * height / (std::hypot(hx, hy) * std::hypot(after->x - here->x, after->y - here->y));
    return true;
}

// The edge through a corner along its row or column; false when it has no neighbour there.
bool edge_at(const points &known, int column, int row, bool along_row, edge *found) {
    const int u = along_row ? 1 : 0, v = 1 - u;
    const point *here = known.at(column, row);
    const point *from = known.at(column - u, row - v), *to = known.at(column + u, row + v);
    from = from == nullptr ? here : from;
    to = to == nullptr ? here : to;
    if (from == to) {
        return false;
    }
    found->angle_rad = std::atan2(to->y - from->y, to->x - from->x);
    found->curvature_px = 0;
    // At the border use the curvature at the neighbouring corner.
    for (const int shift : {0, 1, -1}) {
        if (bend_at(known, column + shift * u, row + shift * v, along_row, &found->curvature_px)) {
            break;
        }
    }
    return true;
}

double nearest_neighbour_px(const points &known, int column, int row) {
    const point *here = known.at(column, row);
    double nearest = std::numeric_limits<double>::infinity();
    for (const auto &[u, v] : {std::pair{1, 0}, {0, 1}, {-1, 0}, {0, -1}}) {
        const point *beside = known.at(column + u, row + v);
        if (beside != nullptr) {
            nearest = std::min(nearest, std::hypot(beside->x - here->x, beside->y - here->y));
        }
    }
    return nearest;
}

// A start with wide edges converges from farther away; narrow ones converge faster. What does not
// look like two blurred edges, as spread ink, may still have a centre of symmetry, unless the
// squares hold markers.
corner_fit fit_from(const plane &level, corner_guess guess, bool plain) {
    const double blur_px = guess.blur_px, spacing_px = guess.radius_px / radius_share;
    std::optional<corner_fit> fit;
    for (const double wider : {1.0, 2.5}) {
        guess.blur_px = wider * blur_px;
        fit = fit_corner(level, guess);
        if (fit) {
            break;
        }
    }
    if (plain && (!fit || too_blurred(fit->blur_px, spacing_px) || fit->misfit > doubtful_misfit)) {
        const std::optional<corner_fit> centre = fit_symmetry(level, guess);
        fit = centre ? centre : fit;
    }
    return fit && fit->sigma_px <= max_sigma_share * spacing_px ? *fit : corner_fit();
}

struct pass {
    double blur_px, widest_radius_px, clear_share;
};

// Fits all known corners on one level; input and output positions are in that level's pixels.
std::vector<corner_fit> fit_all(const plane &level, const grid &shape, const points &known,
                                const pass &how) {
    std::vector<corner_fit> fits(shape.nodes.size());
    for (int row = 0; row < shape.rows; row++) {
        for (int column = 0; column < shape.columns; column++) {
            const point *here = known.at(column, row);
            corner_guess guess;
            if (here == nullptr || !edge_at(known, column, row, true, &guess.a) ||
                !edge_at(known, column, row, false, &guess.b)) {
                continue;
            }
            const double spacing = nearest_neighbour_px(known, column, row);
            guess.x = here->x;
            guess.y = here->y;
            guess.light_between = shape.light_square(column, row);
            guess.blur_px = how.blur_px;
            guess.radius_px = std::clamp(radius_share * spacing, min_radius_px,
                                         how.widest_radius_px + 4 * how.blur_px);
            guess.band_px = 3 * how.blur_px + 2;
            if (how.clear_share < 0.5) {
                guess.band_px = std::min(guess.band_px, std::max(how.clear_share * spacing, 1.5));
            }
            fits[known.index(column, row)] = fit_from(level, guess, how.clear_share >= 0.5);
        }
    }
    return fits;
}

double median(std::vector<double> values) {
    if (values.empty()) {
        return 0;
    }
    const auto middle = values.begin() + static_cast<ptrdiff_t>(values.size() / 2);
    std::nth_element(values.begin(), middle, values.end());
    return *middle;
}

double median_blur(const std::vector<corner_fit> &fits) {
    std::vector<double> values;
    for (const corner_fit &fit : fits) {
        if (fit.contrast > 0) {
            values.push_back(fit.blur_px);
        }
    }
    return median(std::move(values));
}

// A blur measured on one level, converted to a larger one; both include the extent of a pixel.
double blur_on(double blur_px, int from_level, int to_level) {
    const double scale = static_cast<double>(1 << (from_level - to_level));
    const double square = (blur_px * blur_px - 1.0 / 12) * scale * scale + 1.0 / 12;
    return std::sqrt(std::max(square, 0.3));
}

// The corners on level `to`: as fitted on level `fitted`, else as found on level `level`.
points moved_to(const grid &shape, int level, const std::vector<corner_fit> &fits, int fitted,
                int to) {
    std::vector<point> values(fits.size());
    for (size_t i = 0; i < fits.size(); i++) {
        const bool fit = fits[i].contrast > 0;
        const saddle &found = shape.nodes[i].at;
        const int from = fit ? fitted : level;
        values[i] = {shape.nodes[i].found,
                     full_to_level(level_to_full(fit ? fits[i].x : found.x, from), to),
                     full_to_level(level_to_full(fit ? fits[i].y : found.y, from), to)};
    }
    return {shape, std::move(values)};
}

double median_spacing(const grid &shape, const points &known) {
    std::vector<double> spacings;
    for (int row = 0; row < shape.rows; row++) {
        for (int column = 0; column < shape.columns; column++) {
            if (known.at(column, row) != nullptr) {
                spacings.push_back(nearest_neighbour_px(known, column, row));
            }
        }
    }
    return median(std::move(spacings));
}

}  // namespace

refined_grid as_found(int level, const grid &found) {
    refined_grid result;
    for (const node &at : found.nodes) {
        refined_corner corner;
        corner.found = at.found;
        corner.x = level_to_full(at.at.x, level);
        corner.y = level_to_full(at.at.y, level);
        result.corners.push_back(corner);
    }
    return result;
}

refined_grid refine_corners(const std::vector<plane> &levels, int level, const grid &found,
                            double clear_share) {
    const auto plane_at = [&](int l) -> const plane & { return levels[static_cast<size_t>(l)]; };
    // Squares may be as small as eight pixels where they were found; one level finer is large
    // enough to fit them.
    const int coarse = std::max(0, level - 1);
    const std::vector<corner_fit> none(found.nodes.size());
    std::vector<corner_fit> fits =
        fit_all(plane_at(coarse), found, moved_to(found, level, none, coarse, coarse),
                {1.0, coarse_radius_px, clear_share});
    const double coarse_blur_px = median_blur(fits);
    int fine = 0;
    while (fine < coarse && blur_on(coarse_blur_px, coarse, fine) > max_blur_px) {
        fine++;
    }
    // Twice: the second pass knows the curvature of the edges exactly.
    const points fine_start = moved_to(found, level, fits, coarse, fine);
    fits = fit_all(plane_at(fine), found, fine_start,
                   {blur_on(coarse_blur_px, coarse, fine), fine_radius_px, clear_share});
    fits = fit_all(plane_at(fine), found, moved_to(found, level, fits, fine, fine),
                   {std::max(median_blur(fits), 0.3), fine_radius_px, clear_share});

    refined_grid result;
    const double scale = static_cast<double>(1 << fine);
    for (const corner_fit &fit : fits) {
        refined_corner corner;
        corner.found = fit.contrast > 0;
        corner.x = level_to_full(fit.x, fine);
        corner.y = level_to_full(fit.y, fine);
        corner.sigma_px = fit.sigma_px * scale;
        result.corners.push_back(corner);
    }
    result.blur_px = median_blur(fits) * scale;
    result.spacing_px = median_spacing(found, fine_start) * scale;
    return result;
}

}  // namespace calib::detect
