// SPDX-License-Identifier: Apache-2.0
// The generator of synthetic pairs is itself tested: everything else trusts its truth.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "stereo/geometry/geometry.h"
#include "stereo/geometry/lens.h"
#include "synthetic/pair.hpp"
#include "synthetic/scenes.hpp"
#include "synthetic/seed.hpp"

using namespace synthetic;

namespace {

constexpr double kPi = 3.14159265358979323846;

// Row value between pixels by a Lanczos filter of 12 taps: better than 0.1 % for noise cells of
// 3 px and more, and no code of ours.
double interpolate(const uint16_t *row, int width, double x) {
    const int first = static_cast<int>(std::floor(x)) - 5;
    double sum = 0;
    double weights = 0;
    for (int i = first; i < first + 12; i++) {
        const double away = x - i;
        const double weight = away == 0 ? 1
                                        : std::sin(kPi * away) * std::sin(kPi * away / 6) * 6 /
                                              (kPi * kPi * away * away);
        sum += weight * row[std::clamp(i, 0, width - 1)];
        weights += weight;
    }
    return sum / weights;
}

struct Warp {
    int pixels;
    double rms;      // of left - warped right, share of the left image's own scatter
    double bias_px;  // disparity error that best explains the difference
};

Warp warp_right_to_left(const Pair &pair, double disparity_error_px) {
    const std::vector<bool> inner = inner_pixels(pair, pair.left_truth, 1);
    const std::vector<bool> inner_right = inner_pixels(pair, pair.right_truth, 7);
    Warp result{0, 0, 0};
    double squares = 0, own = 0, own_sum = 0, slope_error = 0, slope_slope = 0;
    for (int y = 0; y < pair.height; y++) {
        const uint16_t *right = &pair.right[pair.index(0, y)];
        for (int x = 0; x < pair.width; x++) {
            const size_t i = pair.index(x, y);
            const double there = x - pair.left_truth.disparity_px[i] + disparity_error_px;
            if (!inner[i] || pair.left_truth.visibility[i] != Visibility::Visible || there < 6 ||
                there > pair.width - 7 ||
                !inner_right[pair.index(static_cast<int>(std::lround(there)), y)]) {
                continue;
            }
            const double error = pair.left[i] - interpolate(right, pair.width, there);
            const double slope = interpolate(right, pair.width, there + 0.5) -
                                 interpolate(right, pair.width, there - 0.5);
            squares += error * error;
            own_sum += pair.left[i];
            own += static_cast<double>(pair.left[i]) * pair.left[i];
            slope_error += slope * error;
            slope_slope += slope * slope;
            result.pixels++;
        }
    }
    const double mean = own_sum / result.pixels;
    result.rms = std::sqrt(squares / (own - mean * own_sum));
    result.bias_px = slope_error / slope_slope;
    return result;
}

// Which of the left row's points the right camera sees, by a buffer of fractions of right pixels
// instead of rays: everything in the world's slice along the row, from both cameras' points of
// view, competes for its fraction, and the largest disparity wins.
std::vector<bool> seen_by_buffer(const Scene &scene, const Pair &pair, int y) {
    constexpr int kFractions = 16;
    const int margin = 64;
    const int bins = (pair.width + 2 * margin) * kFractions;
    std::vector<double> nearest(static_cast<size_t>(bins), -1e9);
    const auto enter = [&](const Camera &camera, double x) {
        const auto hit =
            scene.cast(camera.centre_mm, camera.direction({x, static_cast<double>(y)}));
        if (!hit) {
            return;
        }
        const double x_left = pair.rig.left.project(hit->point)->x;
        const double x_right = pair.rig.right.project(hit->point)->x;
        const auto bin = static_cast<int>(std::lround((x_right + margin) * kFractions));
        if (bin >= 0 && bin < bins) {
            double &there = nearest[static_cast<size_t>(bin)];
            there = std::max(there, x_left - x_right);
        }
    };
    for (int i = -margin * 40; i < (pair.width + margin) * 40; i++) {
        enter(pair.rig.left, i / 40.0);
        enter(pair.rig.right, i / 40.0);
    }
    std::vector<bool> seen;
    for (int x = 0; x < pair.width; x++) {
        const double disparity = pair.left_truth.disparity_px[pair.index(x, y)];
        const double x_right = x - disparity;
        const auto bin = static_cast<int>(std::lround((x_right + margin) * kFractions));
        // A bin is 1/16 px wide: a slope of the surface moves the largest in it by less than 0.3.
        seen.push_back(x_right >= 0 && x_right <= pair.width - 1 &&
                       nearest[static_cast<size_t>(bin)] < disparity + 0.3);
    }
    return seen;
}

Pair rendered(const Scene &scene, const Rig &rig, int bits, int samples, uint64_t seed) {
    RenderOptions options;
    options.left.bits = options.right.bits = bits;
    options.samples = samples;
    options.seed = seed;
    return render(scene, rig, options);
}

double scatter_of(const std::vector<uint16_t> &image, double &mean) {
    double sum = 0, squares = 0;
    for (const uint16_t value : image) {
        sum += value;
        squares += static_cast<double>(value) * value;
    }
    const auto count = static_cast<double>(image.size());
    mean = sum / count;
    return std::sqrt(squares / count - mean * mean);
}

// With distortion of every kind.
Camera bent_camera() {
    Camera camera;
    camera.width = 640;
    camera.height = 480;
    camera.fx = 700;
    camera.fy = 710;
    camera.cx = 325;
    camera.cy = 236;
    camera.k1 = -0.28;
    camera.k2 = 0.09;
    camera.p1 = 0.0012;
    camera.p2 = -0.0007;
    camera.k3 = -0.01;
    return camera;
}

}  // namespace

TEST_CASE("the truth warps the right image onto the left one") {
    const uint64_t seed = test_seed();
    INFO("VERGENCE_SEED=", seed);
    for (const double at_infinity : {0.0, -50.0}) {
        const Rig rig = rectified_rig(240, 160, 800, 100, at_infinity);
        const Scene scene = everything(rig, 40 + at_infinity, {3.5, 0.12}, seed);
        const Pair pair = rendered(scene, rig, 16, 1, seed);
        const Warp exact = warp_right_to_left(pair, 0);
        CAPTURE(at_infinity);
        CAPTURE(exact.rms);
        CAPTURE(exact.bias_px);
        CHECK(exact.pixels > 10000);
        CHECK(exact.rms < 0.01);
        CHECK(std::abs(exact.bias_px) < 0.001);
        // The check can fail: 0.05 px beside the truth is seen, and its size is read back.
        const Warp beside = warp_right_to_left(pair, 0.05);
        CHECK(beside.rms > 2 * exact.rms);
        CHECK(beside.bias_px == doctest::Approx(-0.05).epsilon(0.05));
    }
}

TEST_CASE("pixels that integrate over their area keep the truth") {
    const uint64_t seed = test_seed();
    INFO("VERGENCE_SEED=", seed);
    const Rig rig = rectified_rig(240, 160, 800, 100);
    const Pair pair = rendered(everything(rig, 40, {3.5, 0.12}, seed), rig, 16, 3, seed);
    const Warp warp = warp_right_to_left(pair, 0);
    CHECK(warp.rms < 0.01);
    CHECK(std::abs(warp.bias_px) < 0.001);
}

TEST_CASE("occlusion masks agree with a depth buffer") {
    const uint64_t seed = test_seed();
    INFO("VERGENCE_SEED=", seed);
    const Rig rig = rectified_rig(240, 160, 800, 100);
    const Scene scene = everything(rig, 40, {3.5, 0.12}, seed);
    const Pair pair = rendered(scene, rig, 8, 1, seed);
    int hidden = 0, outside = 0, differing = 0, pixels = 0;
    for (int y = 2; y < pair.height; y += 7) {
        const std::vector<bool> seen = seen_by_buffer(scene, pair, y);
        for (int x = 0; x < pair.width; x++, pixels++) {
            const Visibility visibility = pair.left_truth.visibility[pair.index(x, y)];
            hidden += visibility == Visibility::Occluded;
            outside += visibility == Visibility::Outside;
            differing += seen[static_cast<size_t>(x)] != (visibility == Visibility::Visible);
        }
    }
    CAPTURE(differing);
    CHECK(hidden > pixels / 50);
    CHECK(outside > pixels / 50);
    // Only at the very rims of the masks may a buffer of 1/16 px say otherwise.
    CHECK(differing < hidden / 20);
}

TEST_CASE("both views have the same ground truth") {
    const uint64_t seed = test_seed();
    INFO("VERGENCE_SEED=", seed);
    const Rig rig = rectified_rig(200, 120, 800, 100);
    const Pair pair = rendered(everything(rig, 40, {3.5, 0.12}, seed), rig, 8, 1, seed);
    const std::vector<bool> inner = inner_pixels(pair, pair.right_truth, 2);
    int compared = 0, hidden_right = 0;
    double worst = 0;
    for (int y = 0; y < pair.height; y++) {
        for (int x = 0; x < pair.width; x++) {
            const size_t left = pair.index(x, y);
            hidden_right += pair.right_truth.visibility[left] == Visibility::Occluded;
            if (pair.left_truth.visibility[left] != Visibility::Visible) {
                continue;
            }
            const double disparity = pair.left_truth.disparity_px[left];
            const size_t right = pair.index(static_cast<int>(std::lround(x - disparity)), y);
            if (inner[right] && pair.right_truth.surface[right] == pair.left_truth.surface[left]) {
                worst = std::max(worst, std::abs(pair.right_truth.disparity_px[right] - disparity));
                compared++;
            }
        }
    }
    CHECK(compared > 10000);
    CHECK(hidden_right > 200);
    // Half a pixel along the steepest surface, the rim of the sphere.
    CHECK(worst < 0.6);
}

TEST_CASE("a wall's disparity is the plane that was asked for") {
    const Rig rig = rectified_rig(100, 80, 500, 60, -7);
    const Pair pair = rendered(wall(rig, 12.5, 0.1, -0.05, {}, 1), rig, 8, 1, 1);
    for (const int x : {0, 31, 99}) {
        for (const int y : {0, 40, 79}) {
            const double expected = 12.5 + 0.1 * (x - 49.5) - 0.05 * (y - 39.5);
            CHECK(pair.left_truth.disparity_px[pair.index(x, y)] ==
                  doctest::Approx(expected).epsilon(1e-9));
        }
    }
}

TEST_CASE("a step and a bar stand where they were put") {
    const Rig rig = rectified_rig(100, 60, 500, 60);
    Builder builder(rig, 3);
    Scene scene = wall(rig, 10, 0, 0, {}, 3);
    scene.surfaces.push_back(builder.piece(16, 40, 20, 5, 30, Builder::constant(0.9)));
    const Pair pair = rendered(scene, rig, 8, 4, 1);
    const auto at = [&](int x, int y) { return pair.left_truth.surface[pair.index(x, y)]; };
    CHECK(at(39, 30) == 0);
    CHECK(at(40, 30) == 1);
    CHECK(at(44, 30) == 1);
    CHECK(at(45, 30) == 0);
    CHECK(at(42, 19) == 0);
    CHECK(at(42, 20) == 1);
    // The right camera sees the bar at columns 24..28, before what the left one sees at 34..38.
    for (int x = 30; x < 40; x++) {
        const bool hidden = x >= 34 && x < 39;
        CHECK((pair.left_truth.visibility[pair.index(x, 30)] == Visibility::Occluded) == hidden);
    }
    CHECK(pair.left_truth.visibility[pair.index(45, 30)] == Visibility::Visible);
    CHECK(pair.left_truth.visibility[pair.index(9, 5)] == Visibility::Outside);
    CHECK(pair.left_truth.visibility[pair.index(10, 5)] == Visibility::Visible);
    // And the left camera's bar hides what the right one sees at 30..34.
    for (int x = 29; x < 40; x++) {
        const bool hidden = x >= 30 && x < 35;
        CHECK((pair.right_truth.visibility[pair.index(x, 30)] == Visibility::Occluded) == hidden);
    }
    CHECK(pair.left[pair.index(42, 30)] == 230);  // round(0.9 * 255)
}

TEST_CASE("vertical misalignment is what it says") {
    const uint64_t seed = test_seed();
    INFO("VERGENCE_SEED=", seed);
    Rig rig = rectified_rig(200, 120, 800, 100);
    rig.right.vertical = {0.6, 0.004, -0.003};
    const Pair pair = rendered(wall(rig, 20, 0, 0, {3.5, 0.12}, seed), rig, 16, 1, seed);
    const Rig straight = rectified_rig(200, 120, 800, 100);
    const Pair aligned =
        rendered(wall(straight, 20, 0, 0, {3.5, 0.12}, seed), straight, 16, 1, seed);
    double worst = 0;
    for (int y = 20; y < 100; y += 3) {
        for (int x = 40; x < 190; x += 3) {
            const double expected = 0.6 + 0.004 * (x - 20 - 100) - 0.003 * (y - 60);
            CHECK(pair.left_truth.vertical_px[pair.index(x, y)] ==
                  doctest::Approx(expected).epsilon(1e-9));
            // Column x of the moved image at y + v shows what the straight one shows at y.
            std::vector<uint16_t> column;
            for (int v = 0; v < pair.height; v++) {
                column.push_back(pair.right[pair.index(x - 20, v)]);
            }
            const double moved = interpolate(column.data(), pair.height, y + expected);
            worst = std::max(worst, std::abs(moved - aligned.right[pair.index(x - 20, y)]));
        }
    }
    CHECK(worst < 0.01 * 65535);
}

TEST_CASE("the sensor's gain, offset, gamma, noise and saturation are what they say") {
    const uint64_t seed = test_seed();
    INFO("VERGENCE_SEED=", seed);
    const Rig rig = rectified_rig(200, 150, 800, 100);
    Builder builder(rig, seed);
    Scene flat;
    flat.surfaces.push_back(builder.plane(10, 0, 0, Builder::constant(0.5)));
    const auto measured = [&](const Sensor &sensor, double &mean) {
        return scatter_of(render_view(flat, rig.left, sensor, 1, seed), mean);
    };
    double mean = 0;
    CHECK(measured({8}, mean) == 0);
    CHECK(mean == 128);
    CHECK(measured({8, 1.2, 0.1}, mean) == 0);
    CHECK(mean == 179);  // round(0.7 * 255) = round(178.5)
    measured({8, 1, 0, 2.0}, mean);
    CHECK(mean == 64);
    measured({8, 3, 0, 1}, mean);
    CHECK(mean == 255);
    // 30,000 values: the scatter is known to 0.4 %; quantisation adds 1/12.
    CHECK(measured({8, 1, 0, 1, 3.0}, mean) ==
          doctest::Approx(std::sqrt(9 + 1 / 12.0)).epsilon(0.02));
    CHECK(mean == doctest::Approx(127.5).epsilon(0.001));
    const double electrons = 4000;
    CHECK(measured({16, 1, 0, 1, 0, electrons}, mean) ==
          doctest::Approx(65535 * std::sqrt(0.5 / electrons)).epsilon(0.02));
}

TEST_CASE("textures have the contrast that was asked for") {
    const uint64_t seed = test_seed();
    INFO("VERGENCE_SEED=", seed);
    const Rig rig = rectified_rig(256, 256, 800, 100);
    for (const double contrast : {0.02, 0.12}) {
        double mean = 0;
        const double scatter = scatter_of(
            render_view(wall(rig, 10, 0, 0, {3, contrast}, seed), rig.left, {16}, 1, seed), mean);
        CHECK(scatter / 65535 == doctest::Approx(contrast).epsilon(0.12));
        CHECK(mean / 65535 == doctest::Approx(0.45).epsilon(0.1));
    }
}

TEST_CASE("the same seed gives the same pixels, another one others") {
    const uint64_t seed = test_seed();
    INFO("VERGENCE_SEED=", seed);
    const Rig rig = rectified_rig(64, 48, 300, 50);
    RenderOptions options;
    options.left.noise_grey = options.right.noise_grey = 2;
    options.seed = seed;
    const Pair first = render(wall(rig, 9, 0, 0, {}, seed), rig, options);
    const Pair again = render(wall(rig, 9, 0, 0, {}, seed), rig, options);
    CHECK(first.left == again.left);
    CHECK(first.right == again.right);
    CHECK(first.left != first.right);
    CHECK(render(wall(rig, 9, 0, 0, {}, seed + 1), rig, options).left != first.left);
    options.seed = seed + 1;
    CHECK(render(wall(rig, 9, 0, 0, {}, seed), rig, options).left != first.left);
}

TEST_CASE("two lens models written apart agree") {
    // The generator's own equations and the product's: a mistake would have to be made twice.
    const Camera camera = bent_camera();
    const struct lens lens = {640,       480,       700,       710,       325,      236,
                              camera.k1, camera.k2, camera.p1, camera.p2, camera.k3};
    double worst_px = 0, worst_direction = 0;
    for (int y = 0; y < 480; y += 31) {
        for (int x = 0; x < 640; x += 31) {
            const Pixel pixel{static_cast<double>(x), static_cast<double>(y)};
            const Vector ours = camera.direction(pixel);
            const double at[2] = {pixel.x, pixel.y};
            double theirs[3];
            REQUIRE(lens_ray(&lens, at, theirs));
            worst_direction =
                std::max(worst_direction, norm(ours - Vector{theirs[0], theirs[1], theirs[2]}));
            const double point[3] = {300 * ours.x, 300 * ours.y, 300 * ours.z};
            double back[2];
            REQUIRE(lens_project(&lens, point, back));
            worst_px = std::max({worst_px, std::abs(back[0] - x), std::abs(back[1] - y)});
        }
    }
    CHECK(worst_direction < 1e-11);
    CHECK(worst_px < 1e-8);
    const Vector rotation{0.3, -0.5, 0.2};
    const double vector[3] = {rotation.x, rotation.y, rotation.z};
    double R[9];
    geometry_rotation_from_vector(vector, R);
    const Matrix ours = rotation_from_vector(rotation);
    for (size_t i = 0; i < 9; i++) {
        CHECK(std::abs(R[i] - ours[i]) < 1e-14);
    }
}

TEST_CASE("lens and pose go there and back") {
    const uint64_t seed = test_seed();
    INFO("VERGENCE_SEED=", seed);
    Camera camera = bent_camera();
    camera.R_camera_world = rotation_from_vector({0.02, -0.1, 0.03});
    camera.centre_mm = {120, 3, -4};
    double worst = 0;
    for (int y = 0; y < camera.height; y += 13) {
        for (int x = 0; x < camera.width; x += 13) {
            const Pixel pixel{static_cast<double>(x), static_cast<double>(y)};
            const auto back = camera.project(camera.centre_mm + 900.0 * camera.direction(pixel));
            REQUIRE(back);
            worst = std::max({worst, std::abs(back->x - x), std::abs(back->y - y)});
        }
    }
    CHECK(worst < 1e-9);
    // By hand: x = 0.5, y = 0: r2 = 1/4, 1 - 0.28/4 + 0.09/16 - 0.01/64 = 0.93546875.
    const Pixel there = distort(camera, {0.5, 0});
    CHECK(there.x == doctest::Approx(0.5 * 0.93546875 - 0.0007 * 0.75).epsilon(1e-14));
    CHECK(there.y == doctest::Approx(0.0012 * 0.25).epsilon(1e-14));
    // A quarter turn about z takes x to y.
    const Vector turned = rotation_from_vector({0, 0, kPi / 2}) * Vector{1, 0, 0};
    CHECK(turned.x == doctest::Approx(0));
    CHECK(turned.y == doctest::Approx(1));
}
