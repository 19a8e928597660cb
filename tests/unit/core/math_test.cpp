// SPDX-License-Identifier: Apache-2.0
#include "core/math.h"

#include <doctest/doctest.h>

#include <cmath>
#include <limits>
#include <random>
#include <utility>

#include "synthetic/seed.hpp"

namespace {

const double infinity = std::numeric_limits<double>::infinity();
const double not_a_number = std::numeric_limits<double>::quiet_NaN();

// The largest error of `ours` compared with `truth` over `count` draws.
template <typename Draw, typename Error>
double worst(uint64_t seed, int count, Draw draw, Error error) {
    std::mt19937_64 random(seed);
    double max = 0;
    for (int i = 0; i < count; i++) {
        const double e = static_cast<double>(error(draw(random)));
        max = e > max || e != e ? e : max;
    }
    return max;
}

double between(std::mt19937_64 &random, double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
}

}  // namespace

// Ground truth: the C library's functions of long double, 11 bits finer than a double.
static_assert(std::numeric_limits<long double>::digits >= 64, "the oracle needs x87 long double");

TEST_CASE("sine and cosine are right to 4e-16 up to a million radians") {
    const uint64_t seed = synthetic::test_seed();
    for (double range : {1e-3, 4.0, 1e3, 1e6}) {
        const auto draw = [range](std::mt19937_64 &random) {
            return between(random, -range, range);
        };
        CHECK(worst(seed, 200000, draw, [](double a) {
                  return std::fabs(math_sin(a) - std::sin(static_cast<long double>(a)));
              }) <= 4e-16);
        CHECK(worst(seed, 200000, draw, [](double a) {
                  return std::fabs(math_cos(a) - std::cos(static_cast<long double>(a)));
              }) <= 4e-16);
    }
}

TEST_CASE("sine and cosine at the seams of the reduction") {
    for (int turn = -2000; turn <= 2000; turn++) {
        for (double nudge : {-1e-9, 0.0, 1e-9}) {
            const double a = turn * (MATH_PI / 4) + nudge;
            CHECK(std::fabs(math_sin(a) - std::sin(static_cast<long double>(a))) <= 4e-16L);
            CHECK(std::fabs(math_cos(a) - std::cos(static_cast<long double>(a))) <= 4e-16L);
        }
    }
    CHECK(math_sin(0) == 0);
    CHECK(math_cos(0) == 1);
    CHECK(std::isnan(math_sin(not_a_number)));
    CHECK(std::isnan(math_sin(infinity)));
    CHECK(std::isnan(math_cos(-infinity)));
    CHECK(std::isnan(math_cos(1.0000001e6)));
}

TEST_CASE("the arctangent is right to 4e-16 of itself in all quadrants") {
    std::mt19937_64 random(synthetic::test_seed());
    long double max = 0;
    for (int i = 0; i < 500000; i++) {
        const double y = between(random, -1, 1) * std::pow(10, between(random, -12, 12));
        const double x = between(random, -1, 1) * std::pow(10, between(random, -12, 12));
        const long double truth =
            std::atan2(static_cast<long double>(y), static_cast<long double>(x));
        max = std::max(max, std::fabs((math_atan2(y, x) - truth) / truth));
    }
    CHECK(max <= 4e-16L);
}

TEST_CASE("the arctangent on the axes and outside numbers") {
    CHECK(math_atan2(0, 0) == 0);
    CHECK(math_atan2(0, 1) == 0);
    CHECK(math_atan2(0, -1) == MATH_PI);
    CHECK(math_atan2(-0.0, -1) == MATH_PI);  // (-pi, pi]
    CHECK(math_atan2(1, 0) == MATH_PI / 2);
    CHECK(math_atan2(-1, 0) == -MATH_PI / 2);
    CHECK(math_atan2(1, 1) == MATH_PI / 4);
    CHECK(math_atan2(1e308, 1e308) == MATH_PI / 4);
    CHECK(math_atan2(5e-324, 5e-324) == MATH_PI / 4);
    CHECK(std::isnan(math_atan2(not_a_number, 1)));
    CHECK(std::isnan(math_atan2(1, not_a_number)));
}

TEST_CASE("exp and log are right to 1e-15") {
    const uint64_t seed = synthetic::test_seed();
    CHECK(worst(
              seed, 300000, [](std::mt19937_64 &random) { return between(random, -708, 709.7); },
              [](double x) {
                  return std::fabs(math_exp(x) / std::exp(static_cast<long double>(x)) - 1);
              }) <= 1e-15);
    CHECK(worst(
              seed, 300000,
              [](std::mt19937_64 &random) { return std::pow(10, between(random, -307, 308)); },
              [](double x) {
                  const long double truth = std::log(static_cast<long double>(x));
                  return std::fabs(math_log(x) - truth) / std::max(1.0L, std::fabs(truth));
              }) <= 1e-15);
    CHECK(worst(
              seed, 300000, [](std::mt19937_64 &random) { return between(random, 0.9, 1.1); },
              [](double x) {
                  return std::fabs(math_log(x) - std::log(static_cast<long double>(x)));
              }) <= 2e-16);
}

TEST_CASE("exp and log at the ends of their ranges") {
    CHECK(math_exp(0) == 1);
    CHECK(math_exp(-800) == 0);
    CHECK(math_exp(-infinity) == 0);
    CHECK(math_exp(710) == infinity);
    CHECK(math_exp(infinity) == infinity);
    CHECK(std::isnan(math_exp(not_a_number)));
    CHECK(math_exp(-740) == doctest::Approx(std::exp(-740.0)).epsilon(1e-2));  // not normalised
    CHECK(math_log(1) == 0);
    CHECK(math_log(0) == -infinity);
    CHECK(math_log(infinity) == infinity);
    CHECK(std::isnan(math_log(-1)));
    CHECK(std::isnan(math_log(not_a_number)));
    CHECK(math_log(5e-324) == doctest::Approx(-744.44007192138122).epsilon(1e-15));
}

TEST_CASE("hypot is right to 4e-16 of itself") {
    const uint64_t seed = synthetic::test_seed();
    CHECK(worst(
              seed, 200000,
              [](std::mt19937_64 &random) {
                  return std::pair(std::pow(10, between(random, -140, 150)),
                                   -std::pow(10, between(random, -140, 150)));
              },
              [](std::pair<double, double> p) {
                  const long double x = p.first, y = p.second;
                  return std::fabs(math_hypot(p.first, p.second) / std::sqrt(x * x + y * y) - 1);
              }) <= 4e-16);
    CHECK(math_hypot(3, -4) == 5);
    CHECK(math_hypot(0, 0) == 0);
}

TEST_CASE("floor, ceil and round are those of the C library") {
    std::mt19937_64 random(synthetic::test_seed());
    const auto check = [](double x) {
        CAPTURE(x);
        REQUIRE(math_floor(x) == std::floor(x));
        REQUIRE(math_ceil(x) == std::ceil(x));
        REQUIRE(math_round(x) == std::round(x));
    };
    for (int i = 0; i < 50000; i++) {
        const double x = between(random, -1, 1) * std::pow(10, between(random, -3, 20));
        const double half = std::floor(between(random, -1000, 1000)) + 0.5;
        for (double near : {x, half, std::floor(x)}) {
            check(near);
            check(std::nextafter(near, infinity));
            check(std::nextafter(near, -infinity));
        }
    }
    for (double x : {0.0, 0x1p52, -0x1p52, 0x1p63, 1e300, infinity, -infinity}) {
        check(x);
    }
    CHECK(std::isnan(math_floor(not_a_number)));
    CHECK(std::isnan(math_ceil(not_a_number)));
    CHECK(std::isnan(math_round(not_a_number)));
}

TEST_CASE("the larger and the smaller of two numbers, and of a number and none") {
    for (double a : {-infinity, -1.5, 0.0, 2.0, infinity, not_a_number}) {
        for (double b : {-infinity, -1.5, 0.0, 2.0, infinity}) {
            CHECK(math_max(a, b) == std::fmax(a, b));
            CHECK(math_max(b, a) == std::fmax(a, b));
            CHECK(math_min(a, b) == std::fmin(a, b));
            CHECK(math_min(b, a) == std::fmin(a, b));
        }
    }
    CHECK(std::isnan(math_max(not_a_number, not_a_number)));
    CHECK(std::isnan(math_min(not_a_number, not_a_number)));
}
