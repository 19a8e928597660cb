// SPDX-License-Identifier: Apache-2.0
#include "tools/host/fit/fit.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <random>

namespace {

const double f_px = 500, centre_px = 64, baseline_mm = 100;

/// Where the ray of a pixel meets n p = d.
fit_point plane_point(int x, int y, const double n[3], double d) {
    const double ray[3] = {(x - centre_px) / f_px, (y - centre_px) / f_px, 1};
    const double z = d / (n[0] * ray[0] + n[1] * ray[1] + n[2] * ray[2]);
    return {{ray[0] * z, ray[1] * z, z}, 0, {n[0], n[1], n[2]}, x, y};
}

/// Moves a point along its ray by an error of the disparity.
void move(fit_point *point, double disparity_px, double sigma_px) {
    const double z = point->position_mm[2];
    const double by = disparity_px * z / (f_px * baseline_mm);
    double length = 0;
    for (double &value : point->position_mm) {
        length += value * value;
        value *= 1 + by;
    }
    point->sigma_mm = sigma_px * z / (f_px * baseline_mm) * std::sqrt(length);
}

/// Errors that neighbours share: independent for blocks of 4 x 4 pixels.
struct noise {
    std::mt19937 random;
    double sigma_px;
    std::vector<double> values;

    noise(unsigned seed, double sigma) : random(seed), sigma_px(sigma) {
        std::normal_distribution<double> normal(0, sigma);
        for (int i = 0; i < 32 * 32; i++) {
            values.push_back(normal(random));
        }
    }
    double at(int x, int y) const { return values[static_cast<size_t>(y / 4 * 32 + x / 4)]; }
};

std::vector<fit_point> plane_points(const double n[3], double d, const noise &errors) {
    std::vector<fit_point> points;
    for (int y = 0; y < 128; y++) {
        for (int x = 0; x < 128; x++) {
            points.push_back(plane_point(x, y, n, d));
            move(&points.back(), errors.at(x, y), errors.sigma_px);
        }
    }
    return points;
}

/// The front of a cylinder of radius 50 about the vertical axis at z = 600, behind it a wall.
std::vector<fit_point> cylinder_points(const noise &errors, double outliers) {
    std::vector<fit_point> points;
    std::mt19937 random(3);
    for (int y = 0; y < 128; y++) {
        for (int x = 0; x < 128; x++) {
            const double u = (x - centre_px) / f_px, v = (y - centre_px) / f_px;
            // (u z)^2 + (z - 600)^2 = 50^2
            const double a = u * u + 1, b = -1200, c = 600.0 * 600 - 50.0 * 50;
            const double under = b * b - 4 * a * c;
            if (under <= 0) {
                continue;
            }
            double z = (-b - std::sqrt(under)) / (2 * a);
            if (std::uniform_real_distribution<double>(0, 1)(random) < outliers) {
                z = 680;
            }
            fit_point point = {{u * z, v * z, z}, 0, {u * z / 50, 0, (z - 600) / 50}, x, y};
            move(&point, errors.at(x, y), errors.sigma_px);
            points.push_back(point);
        }
    }
    return points;
}

}  // namespace

TEST_CASE("a plane and its deviation, with errors that neighbours share") {
    const double n[3] = {0.2, -0.1, std::sqrt(1 - 0.05)};
    const double distance_mm = 1500;
    std::string message;
    double sum = 0;
    const int trials = 24;
    for (unsigned seed = 1; seed <= trials; seed++) {
        fit_plane_result found;
        INFO("seed ", seed);
        REQUIRE(
            fit_plane(plane_points(n, distance_mm, noise(seed, 0.1)), {-1, 1}, &found, &message));
        CHECK(found.normal[2] < 0);
        CHECK(found.distance_mm.sigma_common < 0);
        CHECK(found.tilt_deg.value == doctest::Approx(std::acos(n[2]) * 180 / M_PI).epsilon(0.05));
        const double off = (found.distance_mm.value - distance_mm) / found.distance_mm.sigma;
        CHECK(std::abs(off) < 5);
        sum += off * off;
    }
    // Chi-square of 24 degrees of freedom, over 24: 1 +- 0.29.
    MESSAGE("mean square of the error over its deviation: ", sum / trials);
    CHECK(sum / trials > 0.4);
    CHECK(sum / trials < 2.0);
}

TEST_CASE("what all depths share is not averaged out") {
    const double n[3] = {0, 0, 1};
    const std::vector<fit_point> points = plane_points(n, 1500, noise(1, 0.02));
    fit_plane_result alone, shared;
    std::string message;
    REQUIRE(fit_plane(points, {-1, 1}, &alone, &message));
    REQUIRE(fit_plane(points, {6, 1500}, &shared, &message));
    CHECK(shared.distance_mm.value == alone.distance_mm.value);
    CHECK(shared.distance_mm.sigma_common == doctest::Approx(6).epsilon(0.01));
    CHECK(shared.distance_mm.sigma ==
          doctest::Approx(std::hypot(6, alone.distance_mm.sigma)).epsilon(0.01));
}

TEST_CASE("half of the points may be of something else") {
    const double n[3] = {0, 0, 1}, other[3] = {0.6, 0, 0.8};
    std::vector<fit_point> points = plane_points(n, 1500, noise(1, 0.05));
    for (size_t i = 0; i < points.size(); i++) {
        if (i % 5 < 2) {
            points[i] = plane_point(points[i].x_px, points[i].y_px, other, 900);
            move(&points[i], 0, 0.05);
        }
    }
    fit_plane_result found;
    std::string message;
    REQUIRE(fit_plane(points, {-1, 1}, &found, &message));
    CHECK(found.distance_mm.value == doctest::Approx(1500).epsilon(0.001));
    CHECK(found.used < 0.65 * static_cast<double>(points.size()));
}

TEST_CASE("a cylinder seen from the front, with outliers") {
    double sum = 0;
    const int trials = 16;
    for (unsigned seed = 1; seed <= trials; seed++) {
        fit_cylinder_result found;
        std::string message;
        INFO("seed ", seed);
        REQUIRE(
            fit_cylinder(cylinder_points(noise(seed, 0.1), 0.15), {0.5, 550}, &found, &message));
        CHECK(found.axis[1] > 0.999);
        CHECK(found.centre_mm[2] == doctest::Approx(600).epsilon(0.01));
        const double own = std::sqrt(found.radius_mm.sigma * found.radius_mm.sigma -
                                     found.radius_mm.sigma_common * found.radius_mm.sigma_common);
        const double off = (found.radius_mm.value - 50) / own;
        CHECK(std::abs(off) < 5);
        sum += off * off;
    }
    MESSAGE("mean square of the error over its deviation: ", sum / trials);
    CHECK(sum / trials > 0.3);
    CHECK(sum / trials < 2.2);
}

TEST_CASE("a distance, and a depth, from two points") {
    const double n[3] = {0, 0, 1};
    fit_point a = plane_point(24, 64, n, 1000), b = plane_point(104, 64, n, 1000);
    move(&a, 0, 0.1);
    move(&b, 0, 0.1);
    const fit_value across = fit_distance(a, b, {5, 1000});
    CHECK(across.value == doctest::Approx(160));
    CHECK(across.sigma_common == doctest::Approx(0.8));  // 5 in 1000 of the length
    const fit_value depth = fit_depth(a, {5, 1000});
    CHECK(depth.value == doctest::Approx(1000));
    CHECK(depth.sigma_common == doctest::Approx(5));
    CHECK(depth.sigma == doctest::Approx(std::hypot(5, 2)));  // 0.1 px z^2 / (f b)
}

TEST_CASE("points that do not determine the shape are refused") {
    fit_plane_result plane;
    fit_cylinder_result cylinder;
    std::string message;
    CHECK_FALSE(fit_plane({}, {-1, 1}, &plane, &message));
    CHECK(message == "too few measured points: 0 (at least 10 are required)");
    std::vector<fit_point> line;
    for (int i = 0; i < 100; i++) {
        line.push_back({{double(i), 0, 1000}, 1, {0, 0, -1}, i, 0});
    }
    CHECK_FALSE(fit_plane(line, {-1, 1}, &plane, &message));
    const double n[3] = {0, 0, 1};
    CHECK_FALSE(fit_cylinder(plane_points(n, 1000, noise(1, 0.05)), {-1, 1}, &cylinder, &message));
    CHECK(message == "the points do not determine a cylinder");
}
