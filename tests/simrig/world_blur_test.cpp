// SPDX-License-Identifier: Apache-2.0
// Edges out of focus and in focus, against the thin lens and the pixel's aperture.
#include <doctest/doctest.h>

#include <cmath>
#include <complex>
#include <cstdio>

#include "tests/simrig/world_harness.hpp"

using namespace world_harness;

namespace {

// A board of two by two squares, much larger than what is seen: its middle is a cross of edges;
// a window above the middle sees one upright edge, turned by `slant_deg`.
world::Scene edge_scene(double distance_mm, double slant_deg) {
    // The middle of the picture lies 900 mm from the cross, on the upright edge.
    const double x = 900 * std::sin(world::radians(slant_deg));
    const double y = -900 * std::cos(world::radians(slant_deg));
    return scene_of(
        even_light() +
        "materials:\n  - print: {kind: board, contrast: 0, colours: [[0.9, 0.9, 0.9], [0.1, 0.1, "
        "0.1]],\n      board: {columns: 2, rows: 2, square_mm: 3000}}\n"
        "objects:\n  - sheet: {name: board, material: print, position_mm: [" +
        std::to_string(x) + ", " + std::to_string(y) + ", " + std::to_string(distance_mm - 1800) +
        "], turn_deg: [0, 0, " + std::to_string(slant_deg) + "], size_mm: [6000, 6000]}\n");
}

// Samples of the edge: distance across it in pixels, and signal, from green pixels.
struct Edge {
    std::vector<double> place, signal;
};

Edge seen_edge(const world::Frame &frame, const world::Window &w, const world::Sensor &sensor,
               double slant_rad) {
    Edge edge;
    for (int y = 0; y < frame.rows; y++) {
        for (int x = y % 2; x < frame.columns; x += 2) {
            const world::Vec2 p = w.centre(x, y);
            const double dx = p.x - 1023.5;
            const double dy = p.y - 767.5;
            edge.place.push_back(dx * std::cos(slant_rad) + dy * std::sin(slant_rad));
            edge.signal.push_back(frame.pixels[static_cast<std::size_t>(y * frame.columns + x)] -
                                  sensor.black_level_dn);
        }
    }
    return edge;
}

// Means of the edge in bins of `step` px over -reach..reach.
std::vector<double> profile(const Edge &edge, double reach, double step) {
    const auto bins = static_cast<std::size_t>(2 * reach / step);
    std::vector<double> sum(bins, 0.0);
    std::vector<double> count(bins, 0.0);
    for (std::size_t i = 0; i < edge.place.size(); i++) {
        const double at = (edge.place[i] + reach) / step;
        if (at >= 0 && at < static_cast<double>(bins)) {
            sum[static_cast<std::size_t>(at)] += edge.signal[i];
            count[static_cast<std::size_t>(at)] += 1;
        }
    }
    for (std::size_t i = 0; i < bins; i++) {
        REQUIRE(count[i] > 0);
        sum[i] /= count[i];
    }
    return sum;
}

// Variance of the line spread that made this edge: differences of the profile are its density.
double spread_variance(const std::vector<double> &p, double step) {
    double weight = 0;
    double mean = 0;
    double square = 0;
    for (std::size_t i = 0; i + 1 < p.size(); i++) {
        const double x = static_cast<double>(i) * step;
        const double d = p[i + 1] - p[i];
        weight += d;
        mean += d * x;
        square += d * x * x;
    }
    mean /= weight;
    return square / weight - mean * mean;
}

world::Frame edge_frame(const world::Rig &rig, const world::Mechanics &m, double distance_mm,
                        double slant_deg, const world::Window &window, double exposure_us) {
    const world::Scene scene = edge_scene(distance_mm, slant_deg);
    world::FrameRequest request = steady(m);
    request.window = window;
    request.exposure_us = exposure_us;
    request.threads = 2;
    return world::render(scene, rig, world::Side::kLeft, request);
}

// Exposure that puts white to about 850 of 1023.
double exposure_for(const world::Camera &camera) {
    const double n = camera.optics.f_number;
    const double lux = world::kPi * 0.88 / (4 * n * n) * 300 * 0.9;
    return 8500 * 0.82 / (17000 * lux) * 1e6;
}

}  // namespace

TEST_CASE("blur radius is that of the thin lens") {
    const world::Rig rig = perfect_rig();
    struct Case {
        double zoom, focus_mm, board_mm, iris;
    };
    const Case cases[] = {{850, 1800, 1950, 850}, {850, 1800, 1700, 850}, {850, 1800, 2400, 700},
                          {850, 1800, 1600, 550}, {600, 1800, 2600, 850}, {600, 1500, 1300, 800},
                          {480, 1500, 3000, 850}, {300, 900, 3500, 850}};
    double worst = 0;
    for (const Case &c : cases) {
        const world::Mechanics m = straight(rig, c.zoom, c.focus_mm, c.iris);
        const world::Camera camera = world::camera_at(rig.camera[0], m);
        const double pupil_mm = camera.optics.focal_length_mm / camera.optics.f_number;
        const double radius_px =
            0.5 * pupil_mm * camera.optics.focal_px * std::fabs(1 / c.focus_mm - 1 / c.board_mm);
        const double reach = 1.15 * radius_px + 4;
        const int half = (static_cast<int>(reach + 8) + 1) / 2 * 2;
        // A slant of 3 degrees over many rows fills all bins of the profile.
        const double slant_deg = 3;
        world::Window window = {1024 - half - 6, 768 - 60, 2 * half + 12, 120, 1, 1, 1, 1};
        const world::Frame frame =
            edge_frame(rig, m, c.board_mm, slant_deg, window, exposure_for(camera));
        const double step = radius_px > 10 ? 0.5 : 0.25;
        const Edge edge = seen_edge(frame, window, rig.camera[0].sensor, world::radians(slant_deg));
        const double variance = spread_variance(profile(edge, reach, step), step);
        // A uniform disk of radius R has variance R^2 / 4 along one direction, a pixel 1 / 12,
        // the profile's bins step^2 / 12.
        const double measured = 2 * std::sqrt(variance - 1.0 / 12 - step * step / 12);
        worst = std::max(worst, std::fabs(measured / radius_px - 1));
        MESSAGE("zoom " << c.zoom << " iris " << c.iris << " focus " << c.focus_mm << " board "
                        << c.board_mm << ": radius " << radius_px << " px, measured " << measured);
        CHECK(measured == doctest::Approx(radius_px).epsilon(0.03));
    }
    MESSAGE("worst " << 100 * worst << " %");
}

TEST_CASE("the outline of an object out of focus is as blurred as its texture") {
    const world::Rig rig = perfect_rig();
    for (const double front_mm : {1600.0, 2100.0}) {
        const double slant_rad = world::radians(3);
        // A bright sheet whose right edge passes through the picture's middle, far before a dark
        // one.
        const world::Scene scene = scene_of(
            even_light() +
            "materials:\n  - b: {kind: paper, contrast: 0, colours: [[0.9, 0.9, 0.9]]}\n"
            "  - d: {kind: paper, contrast: 0, colours: [[0.1, 0.1, 0.1]]}\nobjects:\n"
            "  - sheet: {name: f, material: b, turn_deg: [0, 0, 3], size_mm: [400, 400], "
            "position_mm: [" +
            std::to_string(-200 * std::cos(slant_rad)) + ", " +
            std::to_string(-200 * std::sin(slant_rad)) + ", " + std::to_string(front_mm - 1800) +
            "]}\n  - sheet: {name: g, material: d, position_mm: [0, 0, 1500], size_mm: [4000, "
            "4000]}\n");
        const world::Mechanics m = straight(rig, 850, 1800, 850);
        const world::Camera camera = world::camera_at(rig.camera[0], m);
        const double radius_px = 0.5 * camera.optics.pupil_diameter_mm * camera.optics.focal_px *
                                 std::fabs(1 / 1800.0 - 1 / front_mm);
        const double reach = 1.15 * radius_px + 4;
        const int half = (static_cast<int>(reach + 8) + 1) / 2 * 2;
        world::FrameRequest request = steady(m);
        request.window = {1024 - half - 6, 768 - 60, 2 * half + 12, 120, 1, 1, 1, 1};
        request.exposure_us = exposure_for(camera);
        request.threads = 2;
        const world::Frame frame = world::render(scene, rig, world::Side::kLeft, request);
        const Edge edge = seen_edge(frame, request.window, rig.camera[0].sensor, slant_rad);
        const double variance = spread_variance(profile(edge, reach, 0.5), 0.5);
        const double measured = 2 * std::sqrt(variance - 1.0 / 12 - 0.25 / 12);
        MESSAGE("object at " << front_mm << ": radius " << radius_px << " px, measured "
                             << measured);
        CHECK(measured == doctest::Approx(radius_px).epsilon(0.03));
    }
}

namespace {

// The iris position for an f-number at zoom 600.
double iris_for(double f_number) {
    const double open = 1.6 + 0.4 * 300 / 550;
    return 850 - 550 * std::log(f_number / open) / std::log(16 / open);
}

// Contrast of a perfect round pupil at this f-number for green light.
double airy_contrast(double cycles_per_px, double f_number) {
    const double v = cycles_per_px / 3.2 * 0.55 * f_number;
    return v >= 1 ? 0 : 2 / world::kPi * (std::acos(v) - v * std::sqrt(1 - v * v));
}

}  // namespace

TEST_CASE("diffraction is a spot that has the peak and the light of Airy's disk") {
    world::Rig rig = perfect_rig();
    for (const double f_number : {2.0, 4.0, 8.0, 16.0}) {
        const world::Mechanics m = straight(rig, 600, 1800, iris_for(f_number));
        rig.camera[0].lens.diffraction = 0;
        CHECK(world::camera_at(rig.camera[0], m).optics.spot_rms_px == 0);
        rig.camera[0].lens.diffraction = 1;
        const world::Optics optics = world::camera_at(rig.camera[0], m).optics;
        CHECK(optics.f_number == doctest::Approx(f_number));
        const double rms_um = 3.2 * optics.spot_rms_px;
        // Airy's disk of peak 1, (2 J1(x) / x)^2, summed over rings as far as its light converges.
        double light = 0;
        const double per_um = world::kPi / (0.55 * f_number);
        constexpr double kStep = 0.01, kEnd = 2000;
        for (double x = 0.5 * kStep; x < kEnd; x += kStep) {
            const double amplitude = 2 * std::cyl_bessel_j(1.0, x) / x;
            light += amplitude * amplitude * 2 * world::kPi * x * kStep;
        }
        light /= per_um * per_um;
        CHECK(2 * world::kPi * rms_um * rms_um == doctest::Approx(light).epsilon(0.002));
        MESSAGE("f/" << f_number << ": " << optics.spot_rms_px << " px rms");
        // The lens's own spot adds to it.
        rig.camera[0].lens.spot_rms_um = 1;
        CHECK(world::camera_at(rig.camera[0], m).optics.spot_rms_px ==
              doctest::Approx(std::hypot(optics.spot_rms_px, 1 / 3.2)));
        rig.camera[0].lens.spot_rms_um = 0;
    }
}

TEST_CASE("in focus the slanted edge has the contrast of pixel and lens, and no more beyond") {
    struct Case {
        double spot_um, diffraction, f_number;
    };
    for (const auto &[spot_um, diffraction, f_number] :
         {Case{0, 0, 3.3}, Case{1, 0, 3.3}, Case{0, 1, 8}, Case{1, 1, 16}}) {
        world::Rig rig = perfect_rig();
        rig.camera[0].lens.spot_rms_um = spot_um;
        rig.camera[0].lens.diffraction = diffraction;
        const world::Mechanics m = straight(rig, 600, 1800, iris_for(f_number));
        const world::Camera camera = world::camera_at(rig.camera[0], m);
        const double slant_deg = 5;
        const world::Window window = {1024 - 40, 768 - 200, 80, 400, 1, 1, 1, 1};
        const world::Frame frame =
            edge_frame(rig, m, 1800, slant_deg, window, exposure_for(camera));
        const double step = 0.125;
        const std::vector<double> p = profile(
            seen_edge(frame, window, rig.camera[0].sensor, world::radians(slant_deg)), 12, step);
        std::printf("spot %.1f um, f/%.1f, diffraction %.0f: cycles a pixel, measured, expected\n",
                    spot_um, f_number, diffraction);
        const double spot_px = camera.optics.spot_rms_px;
        for (const double f : {0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0, 1.2}) {
            std::complex<double> sum = 0;
            for (std::size_t i = 0; i + 1 < p.size(); i++) {
                sum += (p[i + 1] - p[i]) *
                       std::polar(1.0, -2 * world::kPi * f * static_cast<double>(i) * step);
            }
            const auto sinc = [](double x) { return std::sin(world::kPi * x) / (world::kPi * x); };
            // Across a slanted edge the pixel's square is two boxes; so are bins and differences.
            const double a = world::radians(slant_deg);
            const double pixel = sinc(f * std::cos(a)) * sinc(f * std::sin(a));
            const double lens = std::exp(-2 * world::kPi * world::kPi * f * f * spot_px * spot_px);
            const double measured =
                std::abs(sum) / std::fabs(p.back() - p.front()) / sinc(f * step) / sinc(f * step);
            const double expected = std::fabs(pixel * lens);
            std::printf("  %.1f  %.3f  %.3f\n", f, measured, expected);
            if (f <= 1) {
                CHECK(measured == doctest::Approx(expected).epsilon(0.015));
            }
            if (diffraction == 1 && spot_um == 0) {
                CHECK(std::fabs(measured - std::fabs(pixel) * airy_contrast(f, f_number)) < 0.11);
            }
            // Beyond that nothing may be there that the pixel itself does not let through.
            CHECK(measured < std::fabs(pixel) + 0.015);
        }
    }
}

namespace {

// Mean of a colour's numbers, and how much they differ from those of the same colour around them.
struct Grain {
    double mean_e = 0;
    double square_e2 = 0;
};

Grain grain(const world::Frame &frame, const world::Sensor &sensor, int first_x, int first_y) {
    const double e_per_dn = sensor.full_well_e / (1023 - sensor.black_level_dn);
    const auto at = [&](int x, int y) {
        return e_per_dn * (frame.pixels[static_cast<std::size_t>(y * frame.columns + x)] -
                           sensor.black_level_dn);
    };
    Grain grain;
    int count = 0;
    for (int y = first_y + 2; y + 2 < frame.rows; y += 2) {
        for (int x = first_x + 2; x + 2 < frame.columns; x += 2) {
            const double around =
                0.25 * (at(x - 2, y) + at(x + 2, y) + at(x, y - 2) + at(x, y + 2));
            grain.mean_e += at(x, y);
            grain.square_e2 += (at(x, y) - around) * (at(x, y) - around) / 1.25;
            count++;
        }
    }
    return {grain.mean_e / count, grain.square_e2 / count};
}

}  // namespace

TEST_CASE("ornaments out of focus keep their colours, and have no grain but the sensor's") {
    const world::Scene scene = world::load_scene(file("scenes/cylinder.yaml"));
    const world::Rig rig = perfect_rig();
    struct Case {
        double aside_deg, sharp_mm;
    };
    // The middle of its front, where it turns away, next to its outline.
    for (const Case &c : {Case{0, 1820}, Case{2, 1860}, Case{2.5, 1890}}) {
        Grain seen[2][2];
        for (const int out_of_focus : {0, 1}) {
            world::Mechanics m = straight(rig, 850, c.sharp_mm + 350 * out_of_focus, 850);
            m.pan_rad = rig.camera[0].pan_rad + world::radians(c.aside_deg);
            world::FrameRequest request = steady(m);
            request.window = {884, 628, 280, 280, 1, 1, 1, 1};
            request.exposure_us = 12000;
            request.threads = 2;
            const world::Frame frame = world::render(scene, rig, world::Side::kLeft, request);
            seen[out_of_focus][0] = grain(frame, rig.camera[0].sensor, 0, 0);
            seen[out_of_focus][1] = grain(frame, rig.camera[0].sensor, 1, 0);
        }
        for (const int colour : {0, 1}) {
            const Grain &soft = seen[1][colour];
            // Half of the pixel's own noise, and the rounding to numbers.
            const double e_per_dn = 8500.0 / 981;
            const double allowed_e2 = 0.25 * (soft.mean_e + 64) + e_per_dn * e_per_dn / 12;
            MESSAGE("aside " << c.aside_deg << ": sharp " << seen[0][colour].mean_e << " e, soft "
                             << soft.mean_e << " e, grain " << std::sqrt(soft.square_e2)
                             << " e, allowed " << std::sqrt(allowed_e2));
            CHECK(soft.mean_e == doctest::Approx(seen[0][colour].mean_e).epsilon(0.05));
            CHECK(soft.square_e2 < allowed_e2);
        }
    }
}
