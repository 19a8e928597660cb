// SPDX-License-Identifier: Apache-2.0
#include "stereo/geometry/lens.h"

#include <doctest/doctest.h>

#include <cmath>
#include <limits>

#include "core/error.h"
#include "random_rig.hpp"
#include "synthetic/camera.hpp"
#include "synthetic/seed.hpp"

namespace {

using random_rig::Random;
using random_rig::uniform;

lens plain_lens() {
    lens made = {};
    made.width_px = 640;
    made.height_px = 480;
    made.fx_px = 500;
    made.fy_px = 510;
    made.cx_px = 320;
    made.cy_px = 240;
    return made;
}

}  // namespace

TEST_CASE("each coefficient moves a point as the published equations say") {
    // x = 0.3, y = -0.4: r^2 = 0.25. The numbers were calculated by hand.
    const double ideal[2] = {0.3, -0.4};
    struct {
        double lens::*coefficient;
        double value, dx, dy;
    } const cases[] = {
        {&lens::k1, 0.1, 0.3 * 0.025, -0.4 * 0.025},
        {&lens::k2, 0.1, 0.3 * 0.00625, -0.4 * 0.00625},
        {&lens::k3, 0.1, 0.3 * 0.0015625, -0.4 * 0.0015625},
        {&lens::p1, 0.1, 0.1 * 2 * 0.3 * -0.4, 0.1 * (0.25 + 2 * 0.16)},
        {&lens::p2, 0.1, 0.1 * (0.25 + 2 * 0.09), 0.1 * 2 * 0.3 * -0.4},
    };
    for (const auto &one : cases) {
        lens bent = plain_lens();
        CHECK(lens_is_ideal(&bent));
        bent.*one.coefficient = one.value;
        CHECK_FALSE(lens_is_ideal(&bent));
        double distorted[2];
        lens_distort(&bent, ideal, distorted);
        CHECK(distorted[0] - ideal[0] == doctest::Approx(one.dx));
        CHECK(distorted[1] - ideal[1] == doctest::Approx(one.dy));
    }
}

TEST_CASE("pixels come back through ray and projection") {
    Random random(synthetic::test_seed());
    for (int i = 0; i < 300; i++) {
        const double f_px = 500 * std::pow(54.0, uniform(random, 0, 1));
        const lens bent = random_rig::make_lens(random, 2048, 1536, f_px);
        for (int k = 0; k < 50; k++) {
            const double pixel_px[2] = {uniform(random, 0, 2047), uniform(random, 0, 1535)};
            double ray[3], again_px[2];
            REQUIRE(lens_ray(&bent, pixel_px, ray));
            REQUIRE(ray[2] == 1.0);
            const double depth_mm = uniform(random, 1, 1e5);
            const double point_mm[3] = {depth_mm * ray[0], depth_mm * ray[1], depth_mm};
            REQUIRE(lens_project(&bent, point_mm, again_px));
            REQUIRE(std::hypot(again_px[0] - pixel_px[0], again_px[1] - pixel_px[1]) < 1e-8);
        }
    }
}

TEST_CASE("nothing behind the camera is projected") {
    const lens plain = plain_lens();
    double pixel_px[2] = {1, 2};
    for (double z_mm : {0.0, -1.0, std::numeric_limits<double>::quiet_NaN()}) {
        const double point_mm[3] = {0, 0, z_mm};
        CHECK_FALSE(lens_project(&plain, point_mm, pixel_px));
    }
    CHECK(pixel_px[0] == 1);
}

TEST_CASE("the fold is where the radial mapping stops growing") {
    Random random(synthetic::test_seed());
    int folding = 0;
    for (int i = 0; i < 2000; i++) {
        lens bent = plain_lens();
        bent.k1 = uniform(random, -0.5, 0.5);
        bent.k2 = i % 3 == 0 ? 0 : uniform(random, -0.5, 0.5);
        bent.k3 = i % 2 == 0 ? 0 : uniform(random, -0.5, 0.5);
        const double fold = lens_fold_radius(&bent);
        const auto grown = [&bent](double r) {
            const double ideal[2] = {r, 0};
            double distorted[2];
            lens_distort(&bent, ideal, distorted);
            return distorted[0];
        };
        double last = 0;
        const double end = std::fmin(fold, 30);
        for (int k = 1; k <= 1000; k++) {
            const double now = grown(end * k / 1000);
            REQUIRE(now >= last);
            last = now;
        }
        if (fold < 30) {
            folding++;
            REQUIRE(grown(fold * 1.001) <= grown(fold));
        }
    }
    CHECK(folding > 500);
    const lens plain = plain_lens();
    CHECK(std::isinf(lens_fold_radius(&plain)));
}

TEST_CASE("behind the fold there is no inverse") {
    lens barrel = plain_lens();
    barrel.k1 = -0.3;
    const double fold = lens_fold_radius(&barrel);  // 1 / sqrt(0.9)
    CHECK(fold == doctest::Approx(1.0540925533894598));
    const double max = fold * (1 - 0.3 * fold * fold);
    const double below[2] = {max * 0.999, 0}, above[2] = {max * 1.001, 0};
    double ideal[2] = {9, 9};
    CHECK_FALSE(lens_undistort(&barrel, above, ideal));
    CHECK(ideal[0] == 9);
    REQUIRE(lens_undistort(&barrel, below, ideal));
    CHECK(ideal[0] < fold);
    const double not_a_number[2] = {std::numeric_limits<double>::quiet_NaN(), 0};
    CHECK_FALSE(lens_undistort(&barrel, not_a_number, ideal));
}

TEST_CASE("within the view the model is one to one, and nothing is given away") {
    Random random(synthetic::test_seed());
    const auto definite = [](const lens &bent, double x, double y) {
        const double h = 1e-5;
        double left[2], right[2], above[2], below[2];
        const double at[4][2] = {{x - h, y}, {x + h, y}, {x, y - h}, {x, y + h}};
        lens_distort(&bent, at[0], left);
        lens_distort(&bent, at[1], right);
        lens_distort(&bent, at[2], above);
        lens_distort(&bent, at[3], below);
        const double xx = (right[0] - left[0]) / (2 * h), yy = (below[1] - above[1]) / (2 * h);
        const double xy = (below[0] - above[0]) / (2 * h);
        return xx > 0 && xx * yy > xy * xy;
    };
    int bounded = 0;
    for (int i = 0; i < 500; i++) {
        lens bent = plain_lens();
        const double tangential = i % 4 == 0 ? 0 : i % 4 == 1 ? 0.3 : 0.01;
        bent.k1 = uniform(random, -0.5, 0.5);
        bent.k2 = uniform(random, -0.5, 0.5);
        bent.k3 = uniform(random, -0.5, 0.5);
        bent.p1 = uniform(random, -tangential, tangential);
        bent.p2 = uniform(random, -tangential, tangential);
        const double radius = lens_view_radius(&bent);
        if (std::isinf(radius)) {
            CHECK(std::isinf(lens_fold_radius(&bent)));
            continue;
        }
        bounded++;
        CAPTURE(i);
        REQUIRE(radius <= 0.98 * lens_fold_radius(&bent));
        bool all = true, all_beyond = true;
        for (int k = 0; k < 400; k++) {
            const double angle_rad = 2 * 3.14159265358979 * k / 400;
            const double c = std::cos(angle_rad), s = std::sin(angle_rad);
            all = all && definite(bent, radius * c, radius * s) &&
                  definite(bent, 0.5 * radius * c, 0.5 * radius * s);
            const double beyond = radius / 0.98 * 1.001;
            all_beyond = all_beyond && definite(bent, beyond * c, beyond * s);
        }
        REQUIRE(all);
        REQUIRE_FALSE(all_beyond);
    }
    CHECK(bounded > 200);
}

TEST_CASE("validation names what is wrong") {
    const double bad = std::numeric_limits<double>::quiet_NaN();
    lens good = plain_lens();
    CHECK(lens_validate(&good) == ERROR_OK);
    good.width_px = good.height_px = LENS_SIDE_MAX_PX;
    CHECK(lens_validate(&good) == ERROR_OK);
    good.width_px = LENS_SIDE_MAX_PX + 1;
    CHECK(lens_validate(&good) == ERROR_TOO_LARGE);
    good.width_px = 0;
    CHECK(lens_validate(&good) == ERROR_RANGE);
    for (double lens::*field : {&lens::fx_px, &lens::fy_px, &lens::cx_px, &lens::cy_px, &lens::k1,
                                &lens::k2, &lens::p1, &lens::p2, &lens::k3}) {
        for (double value : {bad, std::numeric_limits<double>::infinity(), -1e300}) {
            lens broken = plain_lens();
            broken.*field = value;
            CHECK(lens_validate(&broken) == ERROR_RANGE);
        }
    }
    for (double f_px : {0.0, -500.0, 2e6}) {
        lens broken = plain_lens();
        broken.fx_px = f_px;
        CHECK(lens_validate(&broken) == ERROR_RANGE);
    }
    lens folded = plain_lens();
    folded.k1 = -1.2;  // seen up to 0.52, which is 175 px; the central half reaches 200 px
    CHECK(lens_validate(&folded) == ERROR_DISTORTION);
    folded.k1 = -0.8;  // 215 px: the corners, 400 px away, are lost
    CHECK(lens_validate(&folded) == ERROR_OK);
    folded.p1 = 0.2;  // folds over sideways
    CHECK(lens_validate(&folded) == ERROR_DISTORTION);
}

namespace {

// A lens of 160 degrees over the width of its image.
synthetic::Camera wide_camera(bool equidistant) {
    synthetic::Camera made;
    made.width = 640;
    made.height = 480;
    made.fx = 229;
    made.fy = 230;
    made.cx = 322;
    made.cy = 238;
    made.equidistant = equidistant;
    if (equidistant) {
        made.k1 = -0.02, made.k2 = 0.004, made.k3 = -0.002, made.k4 = 0.0003;
    } else {
        made.k1 = 0.6, made.k2 = 0.02, made.k3 = 0.0002;
        made.k4 = 0.95, made.k5 = 0.1, made.k6 = 0.001;
        made.p1 = 3e-4, made.p2 = -2e-4;
    }
    return made;
}

lens lens_of(const synthetic::Camera &camera) {
    return synthetic::calibration_of({camera, camera}, {}, {-100, 0, 0}).left;
}

}  // namespace

TEST_CASE("wide lenses project as the published equations say, and back over the whole field") {
    Random random(synthetic::test_seed());
    for (const bool equidistant : {true, false}) {
        const synthetic::Camera camera = wide_camera(equidistant);
        const lens wide = lens_of(camera);
        CHECK(wide.kind == (equidistant ? LENS_EQUIDISTANT : LENS_RATIONAL));
        CHECK(lens_validate(&wide) == ERROR_OK);
        CHECK_FALSE(lens_is_ideal(&wide));
        double largest_deg = 0;
        for (int i = 0; i < 3000; i++) {
            const double pixel_px[2] = {uniform(random, 0, 639), uniform(random, 0, 479)};
            double ray[3], again_px[2];
            REQUIRE(lens_ray(&wide, pixel_px, ray));
            const auto truth = camera.project({7 * ray[0], 7 * ray[1], 7 * ray[2]});
            REQUIRE(truth.has_value());
            REQUIRE(std::hypot(truth->x - pixel_px[0], truth->y - pixel_px[1]) < 1e-9);
            REQUIRE(lens_project(&wide, ray, again_px));
            REQUIRE(std::hypot(again_px[0] - truth->x, again_px[1] - truth->y) < 1e-9);
            largest_deg = std::fmax(
                largest_deg, std::atan2(std::hypot(ray[0], ray[1]), ray[2]) * 180 / std::acos(-1));
        }
        CHECK(largest_deg > (equidistant ? 95 : 70));
    }
}

TEST_CASE("the slope of every model is that of its mapping") {
    Random random(synthetic::test_seed());
    for (const bool equidistant : {true, false}) {
        const lens wide = lens_of(wide_camera(equidistant));
        for (int i = 0; i < 500; i++) {
            const double spread = i % 2 == 0 ? 3 : 1e-3;
            const double at[2] = {uniform(random, -spread, spread),
                                  uniform(random, -spread, spread)};
            double slope[4];
            lens_distort_slope(&wide, at, slope);
            for (int axis = 0; axis < 2; axis++) {
                const double h = 1e-6;
                double low[2] = {at[0], at[1]}, high[2] = {at[0], at[1]}, from[2], to[2];
                low[axis] -= h;
                high[axis] += h;
                lens_distort(&wide, low, from);
                lens_distort(&wide, high, to);
                REQUIRE(std::fabs((to[0] - from[0]) / (2 * h) - slope[axis]) < 1e-8);
                REQUIRE(std::fabs((to[1] - from[1]) / (2 * h) - slope[2 + axis]) < 1e-8);
            }
        }
        const double middle[2] = {0, 0};
        double slope[4];
        lens_distort_slope(&wide, middle, slope);
        CHECK(slope[0] == 1);
        CHECK(slope[1] == 0);
    }
}

TEST_CASE("an equidistant lens sees behind itself, and ends where it folds") {
    lens wide = lens_of(wide_camera(true));
    CHECK(std::isinf(lens_view_radius(&wide)));
    wide.k1 = wide.k2 = wide.k3 = wide.k4 = 0;
    const double behind_mm[3] = {10, 0, -10}, on_axis_mm[3] = {0, 0, -10};
    double pixel_px[2], ray[3];
    REQUIRE(lens_project(&wide, behind_mm, pixel_px));
    CHECK(pixel_px[0] == doctest::Approx(322 + 229 * 0.75 * std::acos(-1)));
    CHECK_FALSE(lens_project(&wide, on_axis_mm, pixel_px));
    REQUIRE(lens_ray(&wide, pixel_px, ray));
    CHECK(ray[0] == doctest::Approx(std::sqrt(0.5)));
    CHECK(ray[2] == doctest::Approx(-std::sqrt(0.5)));
    CHECK(lens_sees(lens_view_radius(&wide), ray));
    CHECK_FALSE(lens_sees(5, ray));
    const double outside_px[2] = {322 + 229 * 3.2, 238};
    CHECK_FALSE(lens_ray(&wide, outside_px, ray));

    wide.k1 = -0.2;  // folds over at 1 / sqrt(0.6)
    const double fold = 1 / std::sqrt(0.6);
    CHECK(lens_fold_angle(&wide) == doctest::Approx(fold).epsilon(1e-12));
    CHECK(lens_fold_radius(&wide) == doctest::Approx(std::tan(fold)).epsilon(1e-10));
    CHECK(lens_view_radius(&wide) == doctest::Approx(std::tan(0.98 * fold)).epsilon(1e-10));
    const double end = fold * (1 - 0.2 * fold * fold);
    const double below_px[2] = {322 + 229 * end * 0.9999, 238},
                 above_px[2] = {322 + 229 * end * 1.0001, 238};
    REQUIRE(lens_ray(&wide, below_px, ray));
    CHECK(std::atan2(ray[0], ray[2]) < fold);
    CHECK_FALSE(lens_ray(&wide, above_px, ray));
}

TEST_CASE("a rational lens ends at its fold or pole, whichever comes first") {
    Random random(synthetic::test_seed());
    int bounded = 0;
    for (int i = 0; i < 1000; i++) {
        lens bent = plain_lens();
        bent.kind = LENS_RATIONAL;
        for (double lens::*k : {&lens::k1, &lens::k2, &lens::k3, &lens::k4, &lens::k5, &lens::k6}) {
            bent.*k = uniform(random, -0.5, 0.5);
        }
        const double fold = lens_fold_radius(&bent), end = std::fmin(fold, 30);
        const auto grown = [&bent](double r) {
            const double ideal[2] = {r, 0};
            double distorted[2];
            lens_distort(&bent, ideal, distorted);
            return distorted[0];
        };
        const auto below = [&bent](double u) {
            return 1 + u * (bent.k4 + u * (bent.k5 + u * bent.k6));
        };
        double last = 0;
        for (int k = 1; k <= 1000; k++) {
            const double r = end * (k - 1e-6) / 1000, now = grown(r);
            REQUIRE(now >= last);
            REQUIRE(below(r * r) > 0);
            last = now;
        }
        if (fold < 30) {
            bounded++;
            REQUIRE((grown(fold * 1.001) <= grown(fold * 0.9999999) ||
                     below(fold * fold * 1.001) <= 0));
            const double inside = grown(0.97 * fold);
            const double distorted[2] = {0.6 * inside, 0.8 * inside};
            double ideal[2];
            REQUIRE(lens_undistort(&bent, distorted, ideal) == (inside < 1000));
            REQUIRE((inside >= 1000 ||
                     std::fabs(std::hypot(ideal[0], ideal[1]) - 0.97 * fold) < 1e-6 * fold));
        }
    }
    CHECK(bounded > 200);
}

TEST_CASE("coefficients that a model does not have are refused") {
    const struct {
        lens_kind kind;
        double lens::*coefficient;
        bool has;
    } cases[] = {
        {LENS_BROWN_CONRADY, &lens::k4, false}, {LENS_BROWN_CONRADY, &lens::k6, false},
        {LENS_RATIONAL, &lens::k4, true},       {LENS_RATIONAL, &lens::k6, true},
        {LENS_RATIONAL, &lens::p1, true},       {LENS_EQUIDISTANT, &lens::k4, true},
        {LENS_EQUIDISTANT, &lens::k5, false},   {LENS_EQUIDISTANT, &lens::p1, false},
        {LENS_EQUIDISTANT, &lens::p2, false},   {lens_kind(LENS_KINDS), &lens::k1, false},
    };
    for (const auto &one : cases) {
        lens bent = plain_lens();
        bent.kind = one.kind;
        bent.*one.coefficient = 1e-3;
        CHECK((lens_validate(&bent) == ERROR_OK) == one.has);
    }
}
