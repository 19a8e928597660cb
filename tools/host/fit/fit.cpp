// SPDX-License-Identifier: Apache-2.0
#include "tools/host/fit/fit.hpp"

#include <string>

#include "tools/host/fit/robust.hpp"

namespace {

using namespace fitting;

const std::size_t plane_points_min = 10, cylinder_points_min = 50;
const double degrees = 180 / M_PI;

fit_value value_of(double value, double own_sigma, double other, const fit_common &common) {
    if (common.sigma_mm < 0) {
        return {value, own_sigma, -1};
    }
    const double shared = std::abs(other - value);
    return {value, std::hypot(own_sigma, shared), shared};
}

/// Two unit vectors perpendicular to a unit vector and to each other.
void frame_of(const vector3 &axis, vector3 *u, vector3 *v) {
    const vector3 other = std::abs(axis.x()) < 0.6 ? vector3::UnitX() : vector3::UnitY();
    *u = axis.cross(other).normalized();
    *v = axis.cross(*u);
}

/// A plane n p = d, to be changed by (tilt about u, tilt about v, offset).
struct plane {
    static const int size = 3;
    using vector = Eigen::Matrix<double, size, 1>;
    vector3 normal, centre;
    vector3 u, v;

    void ready() { frame_of(normal, &u, &v); }
    /// Distance, its derivatives, and the direction in which it is measured.
    double residual(const vector3 &p, vector *slope, vector3 *along) const {
        const vector3 q = p - centre;
        *along = normal;
        *slope = vector(u.dot(q), v.dot(q), -1);
        return normal.dot(q);
    }
    void step(const vector &by) {
        centre += by[2] * normal;
        normal = (normal + by[0] * u + by[1] * v).normalized();
        ready();
    }
};

/// To be changed by (centre along u and v, tilt along u and v, radius).
struct cylinder {
    static const int size = 5;
    using vector = Eigen::Matrix<double, size, 1>;
    vector3 axis, centre;
    double radius_mm = 0;
    vector3 u, v;

    void ready() { frame_of(axis, &u, &v); }
    /// Where the ray of a point meets the cylinder; the point itself if it passes by.
    vector3 foot_of(const vector3 &p) const {
        const vector3 ray = p.normalized();
        const vector3 across = ray - ray.dot(axis) * axis;
        const vector3 to = centre - centre.dot(axis) * axis;
        const double a = across.squaredNorm(), b = across.dot(to);
        const double under = b * b - a * (to.squaredNorm() - radius_mm * radius_mm);
        if (!(under > 0 && a > 1e-12)) {
            return p;
        }
        const double near = (b - std::sqrt(under)) / a, far = (b + std::sqrt(under)) / a;
        const double at = p.norm();
        return (std::abs(near - at) < std::abs(far - at) ? near : far) * ray;
    }
    /// Points err along their rays: derivatives at the point itself would be correlated with the
    /// residual, and the radius too small.
    double residual(const vector3 &p, vector *slope, vector3 *along) const {
        const vector3 foot = foot_of(p);
        const vector3 q = foot - centre;
        const double t = q.dot(axis);
        const vector3 radial = q - t * axis;
        const double length = std::max(radial.norm(), 1e-9);
        const vector3 e = radial / length;
        *along = e;
        *slope << -e.dot(u), -e.dot(v), -t * e.dot(u), -t * e.dot(v), -1;
        return length - radius_mm + (p - foot).dot(e);
    }
    void step(const vector &by) {
        centre += by[0] * u + by[1] * v;
        axis = (axis + by[2] * u + by[3] * v).normalized();
        radius_mm = std::abs(radius_mm + by[4]);
        ready();
    }
};

std::array<double, 3> array_of(const vector3 &v) {
    return {v.x(), v.y(), v.z()};
}

/// Middle of the points used.
vector3 centre_of(const std::vector<vector3> &positions, const std::vector<bool> &used) {
    vector3 sum = vector3::Zero();
    double count = 0;
    for (std::size_t i = 0; i < positions.size(); i++) {
        if (used[i]) {
            sum += positions[i];
            count++;
        }
    }
    return sum / std::max(count, 1.0);
}

bool refuse_few(std::size_t points, std::size_t least, std::string *message) {
    *message = "too few measured points: " + std::to_string(points) + " (at least " +
               std::to_string(least) + " are required)";
    return points < least;
}

bool guess_plane(const std::vector<vector3> &positions, const std::vector<std::size_t> &sample,
                 std::mt19937 *random, plane *shape) {
    const auto draw = [&] { return positions[sample[(*random)() % sample.size()]]; };
    const vector3 a = draw(), b = draw(), c = draw();
    const vector3 normal = (b - a).cross(c - a);
    if (!(normal.norm() > 1e-9)) {
        return false;
    }
    shape->normal = normal.normalized();
    shape->centre = a;
    return true;
}

/// Two points and their normals: the axis is perpendicular to both normals, and meets both.
bool guess_cylinder(const std::vector<fit_point> &points, const std::vector<vector3> &positions,
                    const std::vector<std::size_t> &sample, std::mt19937 *random, cylinder *shape) {
    const std::size_t i = sample[(*random)() % sample.size()];
    const std::size_t k = sample[(*random)() % sample.size()];
    const vector3 n = vector3(points[i].normal), m = vector3(points[k].normal);
    const vector3 axis = n.cross(m);
    const double least_sine = 0.2;
    if (!(axis.norm() > least_sine)) {
        return false;
    }
    shape->axis = axis.normalized();
    // positions[i] + s n and positions[k] + t m differ only along the axis.
    vector3 between = positions[k] - positions[i];
    between -= between.dot(shape->axis) * shape->axis;
    Eigen::Matrix<double, 3, 2> A;
    A << n, -m;
    const Eigen::Vector2d st = A.colPivHouseholderQr().solve(between);
    shape->radius_mm = (std::abs(st[0]) + std::abs(st[1])) / 2;
    shape->centre = positions[i] + st[0] * n;
    return std::isfinite(shape->radius_mm) && shape->radius_mm > 0;
}

}  // namespace

fit_value fit_depth(const fit_point &point, const fit_common &common) {
    const vector3 at = position_of(point);
    return value_of(at.z(), point.sigma_mm * at.z() / at.norm(), moved(at, common).z(), common);
}

fit_value fit_distance(const fit_point &a, const fit_point &b, const fit_common &common) {
    const vector3 p = position_of(a), q = position_of(b);
    const double length = (q - p).norm();
    const vector3 along = length > 0 ? vector3((q - p) / length) : vector3::UnitZ();
    const double own =
        std::hypot(a.sigma_mm * p.normalized().dot(along), b.sigma_mm * q.normalized().dot(along));
    return value_of(length, own, (moved(q, common) - moved(p, common)).norm(), common);
}

bool fit_plane(const std::vector<fit_point> &points, const fit_common &common,
               fit_plane_result *result, std::string *message) {
    if (refuse_few(points.size(), plane_points_min, message)) {
        return false;
    }
    const std::vector<vector3> positions = positions_of(points);
    plane shape;
    fitted<plane> fit;
    if (best_guess(
            points, positions,
            [&](const auto &sample, std::mt19937 *random, plane *made) {
                return guess_plane(positions, sample, random, made);
            },
            &shape)) {
        fit = solver<plane>(points, positions).run(shape);
    }
    if (fit.solved) {
        // About the middle of the points, offset and tilt are independent.
        shape = fit.shape;
        const vector3 middle = centre_of(positions, fit.used);
        shape.centre = middle - (middle - shape.centre).dot(shape.normal) * shape.normal;
        shape.normal *= shape.normal.dot(shape.centre) > 0 ? -1 : 1;
        fit = solver<plane>(points, positions).run(shape);
    }
    if (!fit.solved) {
        *message = "the points do not determine a plane";
        return false;
    }
    const plane other = fit_moved(points, positions, common, fit.shape).shape;
    const vector3 &n = fit.shape.normal, &c = fit.shape.centre;
    const auto tilt = [](const plane &p) {
        return std::acos(std::clamp(-p.normal.z(), -1.0, 1.0));
    };
    // distance = -n c: its change by a tilt along u is -(u c), by the offset -1.
    const plane::vector slope(-fit.shape.u.dot(c), -fit.shape.v.dot(c), -1);
    const double own_mm = std::sqrt(slope.dot(fit.covariance * slope));
    const double turn = std::sqrt(
        Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d>(fit.covariance.topLeftCorner<2, 2>())
            .eigenvalues()
            .maxCoeff());
    const double turn_common =
        common.sigma_mm < 0 ? 0 : std::asin(std::min(1.0, n.cross(other.normal).norm()));
    result->normal = array_of(n);
    result->centre_mm = array_of(c);
    result->distance_mm = value_of(-n.dot(c), own_mm, -other.normal.dot(other.centre), common);
    result->tilt_deg =
        value_of(degrees * tilt(fit.shape), degrees * turn, degrees * tilt(other), common);
    result->normal_sigma_deg = degrees * std::hypot(turn, turn_common);
    result->rms_mm = fit.rms_mm;
    result->points = points.size();
    result->used = fit.count;
    return true;
}

bool fit_cylinder(const std::vector<fit_point> &points, const fit_common &common,
                  fit_cylinder_result *result, std::string *message) {
    if (refuse_few(points.size(), cylinder_points_min, message)) {
        return false;
    }
    const std::vector<vector3> positions = positions_of(points);
    cylinder shape;
    fitted<cylinder> fit;
    if (best_guess(
            points, positions,
            [&](const auto &sample, std::mt19937 *random, cylinder *made) {
                return guess_cylinder(points, positions, sample, random, made);
            },
            &shape)) {
        fit = solver<cylinder>(points, positions).run(shape);
    }
    if (fit.solved) {
        shape = fit.shape;
        shape.centre +=
            (centre_of(positions, fit.used) - shape.centre).dot(shape.axis) * shape.axis;
        shape.axis *= shape.axis.y() < 0 ? -1 : 1;
        fit = solver<cylinder>(points, positions).run(shape);
    }
    const double radius_sigma = fit.solved ? std::sqrt(fit.covariance(4, 4)) : INFINITY;
    if (!fit.solved || !(radius_sigma < fit.shape.radius_mm / 2)) {
        *message = "the points do not determine a cylinder";
        return false;
    }
    const cylinder other = fit_moved(points, positions, common, fit.shape).shape;
    double first = INFINITY, last = -INFINITY;
    for (std::size_t i = 0; i < positions.size(); i++) {
        if (fit.used[i]) {
            const double t = (positions[i] - fit.shape.centre).dot(fit.shape.axis);
            first = std::min(first, t);
            last = std::max(last, t);
        }
    }
    const double turn =
        std::sqrt(Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d>(fit.covariance.block<2, 2>(2, 2))
                      .eigenvalues()
                      .maxCoeff());
    const double turn_common =
        common.sigma_mm < 0 ? 0 : std::asin(std::min(1.0, fit.shape.axis.cross(other.axis).norm()));
    result->axis = array_of(fit.shape.axis);
    result->centre_mm = array_of(fit.shape.centre + (first + last) / 2 * fit.shape.axis);
    result->radius_mm = value_of(fit.shape.radius_mm, radius_sigma, other.radius_mm, common);
    result->axis_sigma_deg = degrees * std::hypot(turn, turn_common);
    result->length_mm = last - first;
    result->rms_mm = fit.rms_mm;
    result->points = points.size();
    result->used = fit.count;
    return true;
}
