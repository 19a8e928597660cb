// SPDX-License-Identifier: Apache-2.0
// Where points of the world fall on the sensor, against OpenCV; and where rendered corners are.
#include <doctest/doctest.h>

#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>

#include "tests/simrig/world_harness.hpp"
#include "tools/simrig/world/random.hpp"

using namespace world_harness;

namespace {

cv::Matx33d turn(double x, double y, double z) {
    cv::Matx33d r;
    cv::Rodrigues(cv::Vec3d(x, y, z), r);
    return r;
}

cv::Vec3d of(const world::Vec3 &v) {
    return {v.x, v.y, v.z};
}

// The camera's place from the rig's numbers, in OpenCV's own terms.
struct Place {
    cv::Matx33d rotation;  // world to camera
    cv::Vec3d translation;
};

Place place_of(const world::RigCamera &camera, const world::Mechanics &m) {
    const cv::Vec3d t = of(camera.mount.turn_rad);
    const cv::Matx33d mounted = turn(0, 0, t[2]) * turn(0, t[1], 0) * turn(t[0], 0, 0);
    const cv::Vec3d axis = of(camera.mount.axis_direction) * m.pan_rad;
    const cv::Matx33d pan = turn(axis[0], axis[1], axis[2]);
    const double shift = camera.lens.pupil_travel_mm * (m.zoom - 300) / 550;
    const cv::Vec3d pupil = of(camera.mount.pupil_mm) + mounted * cv::Vec3d(0, 0, shift);
    const cv::Vec3d point = of(camera.mount.axis_point_mm);
    const cv::Vec3d centre = point + pan * (pupil - point);
    const cv::Matx33d back = (pan * mounted).t();
    return {back, -(back * centre)};
}

}  // namespace

TEST_CASE("points fall where OpenCV projects them, 1x to 10x, panned, both cameras") {
    const world::Rig rig = world::load_rig(file("rigs/default.yaml"));
    const std::uint64_t seed = 7;
    MESSAGE("seed " << seed);
    world::Random random(seed);
    double worst = 0;
    for (int n = 0; n < 400; n++) {
        const world::RigCamera &rig_camera = rig.camera[n % 2];
        world::Mechanics m;
        m.zoom = random.uniform(300, 850);
        m.focus = random.uniform(300, 850);
        m.iris = random.uniform(300, 850);
        m.pan_rad = random.uniform(-0.3, 0.3);
        const world::Camera camera = world::camera_at(rig_camera, m);
        const world::Optics &o = camera.optics;
        const cv::Matx33d k(o.focal_px, 0, o.centre_px.x, 0, o.focal_px, o.centre_px.y, 0, 0, 1);
        const std::vector<double> distortion = {o.radial[0], o.radial[1], o.decentring.x,
                                                o.decentring.y, o.radial[2]};
        const Place place = place_of(rig_camera, m);
        // A pixel of the frame at some depth, taken out into the world by the pinhole alone.
        const world::Vec2 pixel = {random.uniform(0, 2047), random.uniform(0, 1535)};
        const world::Vec2 s = camera.slopes_of(pixel);
        const double depth = random.uniform(500, 4000);
        const cv::Vec3d in_camera(s.x * depth, s.y * depth, depth);
        const cv::Vec3d in_world = place.rotation.t() * (in_camera - place.translation);
        cv::Vec3d vector;
        cv::Rodrigues(place.rotation, vector);
        std::vector<cv::Point2d> seen;
        cv::projectPoints(std::vector<cv::Point3d>{cv::Point3d(in_world)}, vector,
                          place.translation, k, distortion, seen);
        const world::Vec2 ours = camera.project_world({in_world[0], in_world[1], in_world[2]});
        worst = std::max({worst, std::hypot(ours.x - seen[0].x, ours.y - seen[0].y),
                          std::hypot(pixel.x - seen[0].x, pixel.y - seen[0].y)});
    }
    MESSAGE("worst difference to cv::projectPoints: " << worst << " px");
    CHECK(worst <= 0.005);
}

TEST_CASE("focal length is linear in the position when all deviations are 0") {
    const world::Rig rig = perfect_rig();
    for (int position = 300; position <= 850; position += 50) {
        world::Mechanics m;
        m.zoom = position;
        const world::Camera camera = world::camera_at(rig.camera[0], m);
        const double expected_mm = 8.5 + (85 - 8.5) * (position - 300) / 550.0;
        CHECK(camera.optics.focal_px == doctest::Approx(expected_mm / 0.0032).epsilon(1e-12));
    }
}

TEST_CASE("focus: an image distance by the thin lens changes what is seen") {
    const world::Rig rig = world::load_rig(file("rigs/default.yaml"));
    world::Mechanics m;
    m.zoom = 850;
    m.focus = 300 + 550 * 0.8 / 1.5;
    const double near_px = world::camera_at(rig.camera[1], m).optics.focal_px;
    m.focus = 300 + 550 * 0.8 / 2.2;
    const double far_px = world::camera_at(rig.camera[1], m).optics.focal_px;
    // 1.9 % at 85 mm between 1.5 and 2.2 m.
    CHECK(near_px / far_px - 1 == doctest::Approx(0.019).epsilon(0.05));
}

TEST_CASE("rendered corners of a chessboard lie where its points are projected") {
    const world::Scene scene = world::load_scene(file("scenes/chessboard.yaml"));
    const world::Rig rig = perfect_rig();
    world::Mechanics m = straight(rig, 330, 1800, 400);
    m.pan_rad = rig.camera[0].pan_rad;
    world::FrameRequest request = steady(m);
    request.threads = 2;
    request.exposure_us = 200000;
    request.window = {512, 384, 1024, 768, 1, 1, 1, 1};
    const world::Frame frame = world::render(scene, rig, world::Side::kLeft, request);
    const world::Camera camera = world::camera_at(rig.camera[0], m);
    const world::Object &board = *scene.objects[1];
    double square_sum = 0;
    int corners = 0;
    cv::Point2d mean;
    // Green pixels have no colour to interpolate away: a saddle fit on a blurred quincunx is
    // biased, so grey is what both greens and their neighbours average to.
    cv::Mat raw(frame.rows, frame.columns, CV_32F);
    for (int i = 0; i < frame.rows * frame.columns; i++) {
        const int x = i % frame.columns;
        const int y = i / frame.columns;
        const double gain = (x + y) % 2 == 0 ? 1 : y % 2 == 0 ? 1 / 0.62 : 1 / 0.55;
        raw.at<float>(y, x) =
            static_cast<float>(gain * (frame.pixels[static_cast<std::size_t>(i)] - 42.0));
    }
    std::vector<cv::Point2f> found;
    std::vector<cv::Point2d> expected;
    for (int row = 1; row < 9; row++) {
        for (int column = 1; column < 12; column++) {
            const world::Vec3 local = {40.0 * (column - 6), 40.0 * (row - 4.5), 0};
            const world::Vec2 p = camera.project_world(board.world_object * local);
            const double x = p.x - request.window.column;
            const double y = p.y - request.window.row;
            if (x > 20 && y > 20 && x < frame.columns - 20 && y < frame.rows - 20) {
                expected.emplace_back(x, y);
                found.emplace_back(static_cast<float>(x + 0.7), static_cast<float>(y - 0.6));
            }
        }
    }
    REQUIRE(found.size() > 40);
    cv::cornerSubPix(raw, found, {7, 7}, {-1, -1}, {cv::TermCriteria::EPS, 100, 1e-4});
    for (std::size_t i = 0; i < found.size(); i++) {
        const double dx = found[i].x - expected[i].x;
        const double dy = found[i].y - expected[i].y;
        square_sum += dx * dx + dy * dy;
        mean += cv::Point2d(dx, dy);
        corners++;
    }
    mean *= 1.0 / corners;
    const double rms = std::sqrt(square_sum / corners);
    MESSAGE("rms of " << corners << " rendered corners: " << rms << " px, mean " << mean.x << ", "
                      << mean.y);
    // The search on a mosaic makes errors of its own; a shift of the picture would be in the mean.
    CHECK(rms < 0.08);
    CHECK(std::hypot(mean.x, mean.y) < 0.02);
}
