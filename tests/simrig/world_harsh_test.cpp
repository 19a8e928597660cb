// SPDX-License-Identifier: Apache-2.0
// What rigs/harsh.yaml adds to a lens, against the law that each number stands for; without it
// nothing changes.
#include <doctest/doctest.h>

#include <array>
#include <cmath>
#include <vector>

#include "tests/simrig/world_harness.hpp"

using namespace world_harness;

namespace {

world::Optics at_zoom(const world::Lens &lens, double position) {
    world::Mechanics m;
    m.zoom = position;
    return world::optics_of(lens, 3.2, m);
}

}  // namespace

TEST_CASE("an exponential lens multiplies f by the same factor with every count") {
    world::Lens lens = perfect_rig().camera[0].lens;
    lens.exponential = 1;
    for (double position = 300; position < 850; position += 11) {
        const double factor =
            at_zoom(lens, position + 11).focal_px / at_zoom(lens, position).focal_px;
        CHECK(factor == doctest::Approx(std::pow(10.0, 11 / 550.0)).epsilon(1e-12));
    }
    CHECK(at_zoom(lens, 300).focal_length_mm == doctest::Approx(8.5).epsilon(1e-12));
    CHECK(at_zoom(lens, 850).focal_length_mm == doctest::Approx(85).epsilon(1e-12));
    // A count is 0.42 % of f everywhere, where the straight line has 1.64 % at 1x and 0.16 % at
    // 10x.
    CHECK(at_zoom(lens, 301).focal_px / at_zoom(lens, 300).focal_px - 1 ==
          doctest::Approx(0.0042).epsilon(0.01));
    // Half of it lies in the middle.
    const double whole = at_zoom(lens, 500).focal_px;
    lens.exponential = 0;
    const double none = at_zoom(lens, 500).focal_px;
    lens.exponential = 0.5;
    CHECK(at_zoom(lens, 500).focal_px == doctest::Approx(0.5 * (whole + none)));
}

TEST_CASE("an irregular image centre stays within its limit and follows no low polynomial") {
    world::Lens lens = perfect_rig().camera[0].lens;
    const world::Vec2 still = at_zoom(lens, 500).centre_px;
    lens.centre_irregular_px = {90, 70};
    double low = 0, high = 0, worst_between = 0;
    for (double position = 300; position <= 850; position += 0.5) {
        const world::Vec2 off = at_zoom(lens, position).centre_px - still;
        CHECK(std::fabs(off.x) <= 90);
        CHECK(std::fabs(off.y) <= 70);
        low = std::min(low, off.x);
        high = std::max(high, off.x);
    }
    CHECK(high > 60);
    CHECK(low < -60);
    // Halfway between 13 zooms a straight line misses it by many pixels: a calibration cannot know
    // it to better than what it allows for an irregular lens.
    for (int i = 0; i < 12; i++) {
        const double a = 300 + 550 * i / 12.0, b = 300 + 550 * (i + 1) / 12.0;
        const world::Vec2 mean = 0.5 * (at_zoom(lens, a).centre_px + at_zoom(lens, b).centre_px);
        const world::Vec2 middle = at_zoom(lens, 0.5 * (a + b)).centre_px;
        worst_between = std::max(worst_between, length(mean - middle));
    }
    MESSAGE("worst of the straight lines: " << worst_between << " px");
    CHECK(worst_between > 10);
    // Yet a count moves it by little, so that a motor's last count is not what it shows.
    for (double position = 300; position < 850; position += 1) {
        CHECK(length(at_zoom(lens, position + 1).centre_px - at_zoom(lens, position).centre_px) <
              5);
    }
}

namespace {

// Exposure that puts a surface of this reflectance in even light to about 850 of 1023.
double exposure_for(const world::Camera &camera, double reflectance) {
    const double n = camera.optics.f_number;
    const double lux = world::kPi * 0.88 / (4 * n * n) * 300 * reflectance;
    return 8500 * 0.82 / (17000 * lux) * 1e6;
}

// An upright edge, as the means of columns show it in one colour of the mosaic.
struct EdgeSeen {
    double variance = 0;  ///< variance of the line spread, px^2
    double place = 0;     ///< position of the edge, array columns
};

// Columns of red and of blue are every second one.
EdgeSeen edge_of(const world::Frame &frame, int first_column, int channel) {
    std::vector<double> value, place;
    for (int x = 0; x < frame.columns; x++) {
        double sum = 0, count = 0;
        for (int y = 0; y < frame.rows; y++) {
            constexpr int kColours[] = {1, 0, 2, 1};
            if (kColours[(y & 1) * 2 + (x & 1)] == channel) {
                sum += frame.pixels[static_cast<std::size_t>(y * frame.columns + x)];
                count += 1;
            }
        }
        if (count > 0) {
            value.push_back(sum / count);
            place.push_back(first_column + x);
        }
    }
    double weight = 0, mean = 0, square = 0;
    for (std::size_t i = 1; i < value.size(); i++) {
        const double share = value[i] - value[i - 1];
        const double middle = 0.5 * (place[i] + place[i - 1]);
        weight += share;
        mean += share * middle;
        square += share * middle * middle;
    }
    mean /= weight;
    // The pixel's own width, and that of a difference of columns.
    const double step = place[1] - place[0];
    return {square / weight - mean * mean - 1.0 / 12 - step * step / 12, mean};
}

// Of an edge through this column.
std::array<EdgeSeen, 3> edges_at(const world::Rig &rig, double column) {
    constexpr double row = 767;
    const world::Mechanics m = straight(rig, 600, 1800, 700);
    const world::Camera camera = world::camera_at(rig.camera[0], m);
    const double x = camera.slopes_of({column, row}).x * 1800;
    const world::Scene scene = scene_of(
        even_light() +
        "materials:\n  - print: {kind: board, contrast: 0, colours: [[0.9, 0.9, 0.9], [0.1, 0.1, "
        "0.1]],\n      board: {columns: 2, rows: 2, square_mm: 3000}}\n"
        "objects:\n  - sheet: {name: board, material: print, position_mm: [" +
        std::to_string(x) + ", -1000, 0], turn_deg: [0, 0, 0], size_mm: [6000, 6000]}\n");
    world::FrameRequest request = steady(m);
    constexpr int kHalf = 20;
    const int first = static_cast<int>(column) / 2 * 2 - kHalf;
    const int first_row = static_cast<int>(row) / 2 * 2 - 32;
    request.window = {first, first_row, 2 * kHalf, 64, 1, 1, 1, 1};
    request.exposure_us = exposure_for(camera, 0.9);
    const world::Frame frame = world::render(scene, rig, world::Side::kLeft, request);
    return {edge_of(frame, first, 0), edge_of(frame, first, 1), edge_of(frame, first, 2)};
}

}  // namespace

TEST_CASE("the spot grows over the field with the square of the radius, in squares") {
    world::Rig rig = perfect_rig();
    rig.camera[0].lens.spot_rms_um = 2;
    rig.camera[0].lens.spot_corner_um = 6;
    const world::Optics optics =
        world::camera_at(rig.camera[0], straight(rig, 600, 1800, 700)).optics;
    for (const double column : {1024.0, 1424.0, 1724.0, 1924.0}) {
        const double part2 = optics.corner_part2({column, 767});
        const double expected = std::hypot(2 / 3.2, 6 / 3.2 * part2);
        const EdgeSeen edge = edges_at(rig, column)[1];
        MESSAGE("column " << column << ": " << std::sqrt(edge.variance) << " px, expected "
                          << expected);
        CHECK(std::fabs(std::sqrt(edge.variance) / expected - 1) < 0.03);
    }
    CHECK(optics.corner_part2({0, 0}) == doctest::Approx(1).epsilon(0.002));
}

TEST_CASE("lateral colour: red and blue are larger images, in proportion to the radius") {
    world::Rig rig = perfect_rig();
    rig.camera[0].lens.lateral_colour_px = {3, -1.5};
    rig.camera[0].lens.spot_rms_um = 4;  // every second column shows where such an edge is
    const world::Optics optics =
        world::camera_at(rig.camera[0], straight(rig, 600, 1800, 700)).optics;
    for (const double column : {1023.5, 224.0, 1624.0, 1924.0}) {
        const double radius = column - optics.centre_px.x;
        const std::array<EdgeSeen, 3> edges = edges_at(rig, column);
        const double green = edges[1].place;
        const double red = edges[0].place - green, blue = edges[2].place - green;
        MESSAGE("column " << column << ": red " << red << ", blue " << blue << " px");
        CHECK(green == doctest::Approx(column).epsilon(5e-5));
        CHECK(std::fabs(red - 3 * radius / 1280) < 0.04);
        CHECK(std::fabs(blue + 1.5 * radius / 1280) < 0.04);
    }
}

namespace {

// Deviation of the green pixels of a part of a scene from their own means over 32 x 32 pixels.
double texture_of(const world::Scene &scene, double share) {
    world::Rig rig = perfect_rig();
    rig.texture = share;
    world::Mechanics m = straight(rig, 500, 1800, 700);
    m.pan_rad = rig.camera[0].pan_rad;
    world::FrameRequest request = steady(m);
    request.window = {864, 608, 320, 320, 1, 1, 1, 1};
    request.exposure_us = exposure_for(world::camera_at(rig.camera[0], m), 0.9);
    const world::Frame frame = world::render(scene, rig, world::Side::kLeft, request);
    double square = 0, level = 0;
    int blocks = 0;
    for (int top = 0; top < frame.rows; top += 32) {
        for (int left = 0; left < frame.columns; left += 32) {
            double sum = 0, sum2 = 0;
            for (int i = 0; i < 256; i++) {
                const int at = (top + i / 16 * 2) * frame.columns + left + i % 16 * 2;
                const double value = frame.pixels[static_cast<std::size_t>(at)] - 42.0;
                sum += value / 256;
                sum2 += value * value / 256;
            }
            square += sum2 - sum * sum;
            level += sum;
            blocks++;
        }
    }
    return std::sqrt(square / blocks) / (level / blocks);
}

}  // namespace

TEST_CASE("textures keep their share of contrast: plaster, wood and print alike") {
    for (const char *material : {"kind: plaster, colours: [[0.5, 0.5, 0.5]], contrast: 1.4",
                                 "kind: wood, colours: [[0.5, 0.4, 0.3]], plank_mm: 5000",
                                 "kind: painted, colours: [[0.5, 0.5, 0.5]], image: garden.png, "
                                 "image_size_mm: [600, 400]"}) {
        CAPTURE(std::string(material));
        const std::string text = even_light() + "materials:\n  - m: {" + material +
                                 "}\nobjects:\n  - sheet: {name: s, material: m, position_mm: "
                                 "[125, 100, 0], turn_deg: [0, 0, 0], size_mm: [600, 400]}\n";
        const world::Scene scene = world::load_scene(file("scenes/try.yaml"), text);
        const double whole = texture_of(scene, 1), quarter = texture_of(scene, 0.25);
        // What remains without any texture is rounding to whole numbers and the fall of light.
        const double none = texture_of(scene, 0);
        MESSAGE(std::string(material)
                << ": " << whole << ", a quarter " << quarter << ", none " << none);
        CHECK(whole > 8 * none);
        const double expected = whole / 4;
        CHECK(std::sqrt(quarter * quarter - none * none) / expected ==
              doctest::Approx(1).epsilon(0.12));
    }
}

TEST_CASE("drift: a warm rig has another f, image centre and turn, in proportion") {
    world::Rig rig = perfect_rig();
    world::RigCamera &camera = rig.camera[0];
    camera.drift.focal_part = 3e-4;
    camera.drift.centre_px = {4, -3};
    camera.drift.turn_rad = {1e-4, -2e-4, 3e-4};
    world::Mechanics m = straight(rig, 600, 1800, 700);
    const world::Camera cold = world::camera_at(camera, m);
    for (const double share : {0.25, 1.0}) {
        m.warm = share;
        const world::Camera warm = world::camera_at(camera, m);
        CHECK(warm.optics.focal_px / cold.optics.focal_px - 1 == doctest::Approx(3e-4 * share));
        const world::Vec2 moved = warm.optics.centre_px - cold.optics.centre_px;
        CHECK(moved.x == doctest::Approx(4 * share));
        CHECK(moved.y == doctest::Approx(-3 * share));
        const world::Vec3 axis = warm.world_camera.rotation * world::Vec3{0, 0, 1};
        const world::Vec3 before = cold.world_camera.rotation * world::Vec3{0, 0, 1};
        // Turned about x the axis goes down, about y to the right.
        CHECK(axis.x - before.x == doctest::Approx(-2e-4 * share).epsilon(1e-3));
        CHECK(axis.y - before.y == doctest::Approx(-1e-4 * share).epsilon(1e-3));
    }
}
