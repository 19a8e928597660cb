// SPDX-License-Identifier: Apache-2.0
/// Robust least squares of a shape and the points' errors along their rays: a first guess that half
/// of the points may contradict (least median of squares), then Tukey's biweight (P. J. Huber,
/// "Robust Statistics", 1981), and the covariance of the shape.
///
/// A Shape has `size`, `vector`, `ready()`, `step(vector)`, and `residual(point, &slope, &along)`:
/// the distance from the shape in the direction `along`, and its derivatives.
#ifndef VERGENCE_TOOLS_HOST_FIT_ROBUST_HPP
#define VERGENCE_TOOLS_HOST_FIT_ROBUST_HPP

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <map>
#include <random>
#include <vector>

#include "tools/host/fit/fit_types.hpp"

namespace fitting {

using vector3 = Eigen::Vector3d;

const std::size_t sample_points = 600;  // points that judge a first guess
const int guesses = 400;
const int blocks_min = 8;       // fewer do not show the spread of their residuals
const double cut_sigmas = 4.7;  // Tukey's biweight: no weight beyond, 95 % efficient

inline vector3 position_of(const fit_point &point) {
    return vector3(point.position_mm);
}

/// The point if all disparities are off by what moves `common.depth_mm` by one sigma.
inline vector3 moved(const vector3 &at, const fit_common &common) {
    return at * (1 + common.sigma_mm * at.z() / (common.depth_mm * common.depth_mm));
}

inline double median_of(std::vector<double> *values) {
    const auto middle = values->begin() + static_cast<std::ptrdiff_t>(values->size() / 2);
    std::nth_element(values->begin(), middle, values->end());
    return *middle;
}

/// Deviation of a residual, from the point's own along its ray.
inline double sigma_of(const fit_point &point, const vector3 &along) {
    const vector3 ray = position_of(point).normalized();
    const double grazing = 0.3;  // seen along the surface, the ray says little about it
    return std::max(point.sigma_mm > 0 ? point.sigma_mm : 1.0, 1e-6) *
           std::max(std::abs(ray.dot(along)), grazing);
}

template <class Shape>
struct fitted {
    Shape shape;
    Eigen::Matrix<double, Shape::size, Shape::size> covariance;
    std::vector<bool> used;
    std::size_t count = 0;
    double rms_mm = 0;
    bool solved = false;
};

/// Robust least squares from a first guess.
template <class Shape>
class solver {
    using vector = typename Shape::vector;
    using matrix = Eigen::Matrix<double, Shape::size, Shape::size>;

  public:
    solver(const std::vector<fit_point> &points, const std::vector<vector3> &positions)
        : points_(points),
          positions_(positions),
          residual_(points.size()),
          weight_(points.size()) {}

    fitted<Shape> run(Shape shape) {
        fitted<Shape> result;
        shape.ready();
        const int rounds = 40;
        for (int round = 0; round < rounds; round++) {
            weigh(shape);
            matrix H = matrix::Zero();
            vector g = vector::Zero();
            sum(shape, &H, &g);
            const Eigen::LDLT<matrix> solution(H);
            const vector by = -solution.solve(g);
            if (!by.allFinite() || !solution.isPositive() || H.diagonal().minCoeff() <= 0) {
                return result;
            }
            shape.step(by);
            // Against the deviation that the weights promise.
            if (by.dot(H * by) < 1e-8) {
                break;
            }
        }
        result.shape = shape;
        finish(&result);
        return result;
    }

  private:
    void weigh(const Shape &shape) {
        std::vector<double> off(points_.size());
        std::vector<double> sigma(points_.size());
        vector slope;
        vector3 along;
        for (std::size_t i = 0; i < points_.size(); i++) {
            residual_[i] = shape.residual(positions_[i], &slope, &along);
            sigma[i] = sigma_of(points_[i], along);
            off[i] = std::abs(residual_[i]) / sigma[i];
        }
        std::vector<double> sorted = off;
        const double scale = std::max(1.4826 * median_of(&sorted), 1e-3);
        for (std::size_t i = 0; i < points_.size(); i++) {
            const double share = off[i] / (cut_sigmas * scale);
            const double kept = share < 1 ? (1 - share * share) * (1 - share * share) : 0;
            weight_[i] = kept / (sigma[i] * sigma[i] * scale * scale);
        }
    }

    void sum(const Shape &shape, matrix *H, vector *g) const {
        vector slope;
        vector3 along;
        for (std::size_t i = 0; i < points_.size(); i++) {
            if (weight_[i] > 0) {
                const double residual = shape.residual(positions_[i], &slope, &along);
                H->noalias() += weight_[i] * slope * slope.transpose();
                g->noalias() += weight_[i] * residual * slope;
            }
        }
    }

    void finish(fitted<Shape> *result) {
        weigh(result->shape);
        matrix H = matrix::Zero();
        vector g = vector::Zero();
        sum(result->shape, &H, &g);
        std::map<std::pair<int, int>, vector> blocks;
        double squares = 0;
        vector slope;
        vector3 along;
        result->used.assign(points_.size(), false);
        for (std::size_t i = 0; i < points_.size(); i++) {
            if (!(weight_[i] > 0)) {
                continue;
            }
            result->used[i] = true;
            result->count++;
            squares += residual_[i] * residual_[i];
            result->shape.residual(positions_[i], &slope, &along);
            vector &block =
                blocks
                    .try_emplace({points_[i].x_px / fit_block_px, points_[i].y_px / fit_block_px},
                                 vector(vector::Zero()))
                    .first->second;
            block += weight_[i] * residual_[i] * slope;
        }
        const Eigen::LDLT<matrix> solution(H);
        const matrix inverse = solution.solve(matrix::Identity());
        const auto count = static_cast<int>(blocks.size());
        if (count >= blocks_min) {
            matrix spread = matrix::Zero();
            for (const auto &[place, block] : blocks) {
                spread += block * block.transpose();
            }
            result->covariance =
                inverse * spread * inverse * count / std::max(count - Shape::size, 1);
        } else {
            result->covariance = inverse * (static_cast<double>(result->count) / count);
        }
        result->rms_mm =
            std::sqrt(squares / static_cast<double>(std::max<std::size_t>(result->count, 1)));
        result->solved = result->count > 2 * Shape::size && result->covariance.allFinite();
    }

    const std::vector<fit_point> &points_;
    const std::vector<vector3> &positions_;
    std::vector<double> residual_, weight_;
};

inline std::vector<vector3> positions_of(const std::vector<fit_point> &points) {
    std::vector<vector3> positions;
    positions.reserve(points.size());
    for (const fit_point &point : points) {
        positions.push_back(position_of(point));
    }
    return positions;
}

/// Evenly spread, so that the same points give the same guess.
inline std::vector<std::size_t> sample_of(std::size_t count) {
    std::vector<std::size_t> sample;
    const std::size_t wanted = std::min(count, sample_points);
    for (std::size_t i = 0; i < wanted; i++) {
        sample.push_back(i * count / wanted);
    }
    return sample;
}

/// The guess with the least median residual, of those that `guess(random, &shape)` makes.
template <class Shape, class Guess>
bool best_guess(const std::vector<fit_point> &points, const std::vector<vector3> &positions,
                const Guess &guess, Shape *best) {
    const std::vector<std::size_t> sample = sample_of(points.size());
    std::mt19937 random(1);  // the same for the same points
    double least = INFINITY;
    std::vector<double> off(sample.size());
    for (int i = 0; i < guesses; i++) {
        Shape shape;
        if (!guess(sample, &random, &shape)) {
            continue;
        }
        shape.ready();
        typename Shape::vector slope;
        vector3 along;
        for (std::size_t k = 0; k < sample.size(); k++) {
            const double residual = shape.residual(positions[sample[k]], &slope, &along);
            off[k] = std::abs(residual) / sigma_of(points[sample[k]], along);
        }
        const double middle = median_of(&off);
        if (middle < least) {
            least = middle;
            *best = shape;
        }
    }
    return std::isfinite(least);
}

template <class Shape>
fitted<Shape> fit_moved(const std::vector<fit_point> &points, const std::vector<vector3> &positions,
                        const fit_common &common, const Shape &start) {
    if (common.sigma_mm < 0) {
        fitted<Shape> none;
        none.shape = start;
        return none;
    }
    std::vector<vector3> other;
    other.reserve(positions.size());
    for (const vector3 &at : positions) {
        other.push_back(moved(at, common));
    }
    return solver<Shape>(points, other).run(start);
}

}  // namespace fitting

#endif
