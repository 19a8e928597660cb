// SPDX-License-Identifier: Apache-2.0
#include "stereo/geometry/geometry.h"

#include <doctest/doctest.h>

#include <cmath>
#include <limits>

#include "core/error.h"
#include "core/math.h"
#include "random_rig.hpp"
#include "synthetic/seed.hpp"

namespace {

using random_rig::Random;
using random_rig::uniform;

const double UNIT[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};

void random_vector(Random &random, double length, double v[3]) {
    double norm = 0;
    do {
        for (int i = 0; i < 3; i++) {
            v[i] = uniform(random, -1, 1);
        }
        norm = geometry_norm(v);
    } while (norm < 0.1);
    for (int i = 0; i < 3; i++) {
        v[i] *= length / norm;
    }
}

double distance(const double a[3], const double b[3]) {
    const double difference[3] = {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
    return geometry_norm(difference);
}

double max_difference(const double a[9], const double b[9]) {
    double max = 0;
    for (int i = 0; i < 9; i++) {
        max = std::fmax(max, std::fabs(a[i] - b[i]));
    }
    return max;
}

}  // namespace

TEST_CASE("a quarter turn about z takes x to y") {
    const double r_rad[3] = {0, 0, MATH_PI / 2}, x[3] = {1, 0, 0}, y[3] = {0, 1, 0};
    double R[9], turned[3], back[3];
    geometry_rotation_from_vector(r_rad, R);
    geometry_rotate(R, x, turned);
    CHECK(distance(turned, y) < 1e-15);
    geometry_rotate_back(R, turned, back);
    CHECK(distance(back, x) < 1e-15);
}

TEST_CASE("rotation matrices are orthonormal and chain") {
    Random random(synthetic::test_seed());
    for (int i = 0; i < 2000; i++) {
        double axis[3], R[9], R_transposed[9], product[9];
        random_vector(random, uniform(random, 0, 10), axis);
        geometry_rotation_from_vector(axis, R);
        for (int k = 0; k < 9; k++) {
            R_transposed[k] = R[3 * (k % 3) + k / 3];
        }
        geometry_multiply(R, R_transposed, product);
        REQUIRE(max_difference(product, UNIT) < 1e-14);
        // Half the turn twice is the whole turn.
        double half[3] = {axis[0] / 2, axis[1] / 2, axis[2] / 2}, R_half[9];
        geometry_rotation_from_vector(half, R_half);
        geometry_multiply(R_half, R_half, product);
        REQUIRE(max_difference(product, R) < 1e-14);
    }
}

TEST_CASE("rotation vectors come back, also near 0 and near pi") {
    Random random(synthetic::test_seed());
    for (int i = 0; i < 5000; i++) {
        double angle_rad = uniform(random, 0, MATH_PI);
        if (i % 5 == 0) {
            angle_rad = std::pow(10, uniform(random, -18, -1));
        } else if (i % 5 == 1) {
            angle_rad = MATH_PI - std::pow(10, uniform(random, -6, -1));
        }
        double r_rad[3], R[9], again_rad[3];
        random_vector(random, angle_rad, r_rad);
        geometry_rotation_from_vector(r_rad, R);
        REQUIRE(geometry_vector_from_rotation(R, again_rad) == ERROR_OK);
        CAPTURE(angle_rad);
        REQUIRE(distance(r_rad, again_rad) < 1e-14 + 1e-15 * angle_rad);
    }
}

TEST_CASE("half turns keep their axis up to its sign") {
    for (int axis = 0; axis < 3; axis++) {
        double R[9] = {-1, 0, 0, 0, -1, 0, 0, 0, -1}, r_rad[3];
        R[4 * axis] = 1;
        REQUIRE(geometry_vector_from_rotation(R, r_rad) == ERROR_OK);
        CHECK(std::fabs(r_rad[axis]) == doctest::Approx(MATH_PI));
        CHECK(geometry_norm(r_rad) == doctest::Approx(MATH_PI));
    }
}

TEST_CASE("what is not a rotation is refused and leaves the output alone") {
    const double mirror[9] = {1, 0, 0, 0, 1, 0, 0, 0, -1};
    const double scaled[9] = {1.001, 0, 0, 0, 1, 0, 0, 0, 1};
    const double skewed[9] = {1, 2e-4, 0, 0, 1, 0, 0, 0, 1};
    const double zero[9] = {};
    double broken[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};
    broken[5] = std::numeric_limits<double>::quiet_NaN();
    for (const double *R : {mirror, scaled, skewed, zero, static_cast<const double *>(broken)}) {
        double r_rad[3] = {7, 7, 7};
        CHECK(geometry_vector_from_rotation(R, r_rad) == ERROR_ROTATION);
        CHECK(r_rad[0] == 7);
    }
}

TEST_CASE("a nearly orthonormal matrix is projected first") {
    const double r_rad[3] = {0.3, -0.2, 0.5};
    double R[9], again_rad[3];
    geometry_rotation_from_vector(r_rad, R);
    for (int i = 0; i < 9; i++) {
        R[i] = std::round(R[i] * 1e5) / 1e5;  // precision of a text file with five decimals
    }
    REQUIRE(geometry_vector_from_rotation(R, again_rad) == ERROR_OK);
    CHECK(distance(r_rad, again_rad) < 1e-5);
}

TEST_CASE("the mid-point of two crossing rays is where they cross") {
    Random random(synthetic::test_seed());
    for (int i = 0; i < 2000; i++) {
        double a[3], b[3], point[3], to_a[3], to_b[3];
        random_vector(random, 100, a);
        random_vector(random, 200, b);
        random_vector(random, uniform(random, 500, 5000), point);
        for (int k = 0; k < 3; k++) {
            to_a[k] = 0.01 * (point[k] - a[k]);
            to_b[k] = 3.0 * (point[k] - b[k]);
        }
        geometry_midpoint result;
        REQUIRE(geometry_rays_midpoint(a, to_a, b, to_b, &result));
        REQUIRE(distance(result.point_mm, point) < 1e-6);
        REQUIRE(result.miss_mm < 1e-9);
        REQUIRE(result.s == doctest::Approx(100));
        REQUIRE(result.t == doctest::Approx(1.0 / 3));
    }
}

TEST_CASE("skew rays: half way, and the distance between them") {
    const double a[3] = {0, 0, 0}, along_z[3] = {0, 0, 2};
    const double b[3] = {5, 3, 10}, along_x[3] = {-1, 0, 0};
    geometry_midpoint result;
    REQUIRE(geometry_rays_midpoint(a, along_z, b, along_x, &result));
    const double expected[3] = {0, 1.5, 10};
    CHECK(distance(result.point_mm, expected) < 1e-12);
    CHECK(result.miss_mm == doctest::Approx(3));
    CHECK(result.s == doctest::Approx(5));
    CHECK(result.t == doctest::Approx(5));
}

TEST_CASE("parallel rays and null directions have no mid-point") {
    const double a[3] = {0, 0, 0}, b[3] = {1, 0, 0}, z[3] = {0, 0, 1};
    const double nearly[3] = {1e-13, 0, 1}, enough[3] = {1e-11, 0, 1}, zero[3] = {0, 0, 0};
    geometry_midpoint result = {};
    result.s = 42;
    CHECK_FALSE(geometry_rays_midpoint(a, z, b, z, &result));
    CHECK_FALSE(geometry_rays_midpoint(a, z, b, nearly, &result));
    CHECK_FALSE(geometry_rays_midpoint(a, z, b, zero, &result));
    CHECK(result.s == 42);
    CHECK(geometry_rays_midpoint(a, z, b, enough, &result));
}
