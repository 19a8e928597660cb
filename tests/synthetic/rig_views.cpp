// SPDX-License-Identifier: Apache-2.0
#include "synthetic/rig_views.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <stdexcept>

namespace synthetic {

namespace {

Camera make_lens(const RigViewsPlan &plan, double focal_px, double strength, Random &random) {
    Camera camera;
    camera.width = plan.width;
    camera.height = plan.height;
    camera.fx = focal_px;
    camera.fy = focal_px * plan.aspect;
    camera.cx = (plan.width - 1) / 2.0 + random.uniform(-plan.centre_px, plan.centre_px);
    camera.cy = (plan.height - 1) / 2.0 + random.uniform(-plan.centre_px, plan.centre_px);
    const double half_diagonal_px = std::hypot(plan.width, plan.height) / 2;
    const double radius = half_diagonal_px / focal_px;
    camera.k1 = strength * plan.k1_px / half_diagonal_px / std::pow(radius, 2);
    camera.k2 = strength * plan.k2_px / half_diagonal_px / std::pow(radius, 4);
    camera.p1 = strength * plan.p1_px / half_diagonal_px / radius;
    camera.p2 = strength * plan.p2_px / half_diagonal_px / radius;
    const double share = strength < 1 ? 0.5 : 1;
    camera.equidistant = plan.equidistant;
    if (plan.equidistant || plan.wide[5] != 0) {
        camera.k1 = share * plan.wide[0], camera.k2 = share * plan.wide[1];
        camera.p1 = share * plan.wide[2], camera.p2 = share * plan.wide[3];
        camera.k3 = share * plan.wide[4], camera.k4 = share * plan.wide[5];
        camera.k5 = share * plan.wide[6], camera.k6 = share * plan.wide[7];
    }
    return camera;
}

struct Board {
    Matrix R;
    Vector middle_mm;
};

Board random_board(const RigViewsPlan &plan, const Camera &left, Random &random) {
    const double pi = std::acos(-1.0);
    const double tilt = random.uniform(plan.tilt_min_rad, plan.tilt_max_rad);
    const double towards = random.uniform(-pi, pi);
    const Matrix tilted =
        rotation_from_vector({tilt * std::cos(towards), tilt * std::sin(towards), 0});
    const Matrix rolled =
        rotation_from_vector({0, 0, random.uniform(-plan.roll_max_rad, plan.roll_max_rad)});
    const double depth =
        plan.distance_mm * random.uniform(1 - plan.depth_range, 1 + plan.depth_range);
    const Vector ray = left.direction(
        {random.uniform(0.1, 0.9) * plan.width, random.uniform(0.1, 0.9) * plan.height});
    if (!plan.equidistant && plan.wide[5] == 0) {
        return {tilted * rolled, (depth / ray.z) * ray};
    }
    // Wide lenses see boards all around: held towards the camera, at about the same range.
    const double across = std::hypot(ray.x, ray.y), off_axis = std::atan2(across, ray.z);
    const Matrix facing =
        rotation_from_vector({-ray.y / across * off_axis, ray.x / across * off_axis, 0});
    return {facing * (tilted * rolled), (depth / norm(ray)) * ray};
}

Vector corner_of(const RigViewsPlan &plan, double square_mm, const Board &board, int index) {
    const double half_x = (plan.columns - 1) / 2.0, half_y = (plan.rows - 1) / 2.0;
    const double x = index % plan.columns - half_x, y = index / plan.columns - half_y;
    const double a = x / half_x, b = y / half_y;
    const double z = plan.warp_mm[0] * a * a + plan.warp_mm[1] * b * b + plan.twist_mm * a * b;
    return board.R * Vector{x * square_mm * (1 + plan.stretch), y * square_mm, z} + board.middle_mm;
}

// Noise-free pixels of the corners inside the image.
std::vector<calib::corner> look(const RigViewsPlan &plan, const Camera &camera, double square_mm,
                                const Board &board) {
    std::vector<calib::corner> corners;
    for (int index = 0; index < plan.columns * plan.rows; index++) {
        const auto pixel = camera.project(corner_of(plan, square_mm, board, index));
        if (!pixel) {
            continue;
        }
        const double from_x = pixel->x - camera.cx, from_y = pixel->y - camera.cy;
        const double radius = std::fmax(1, std::hypot(from_x, from_y));
        const double ripple = plan.ripple_px * std::sin(radius * 25 / plan.width) / radius;
        const double x =
            pixel->x + ripple * from_x + plan.waves_px * std::sin(pixel->y * 9 / plan.height);
        const double y =
            pixel->y + ripple * from_y + plan.waves_px * std::sin(pixel->x * 11 / plan.width);
        if (x > 4 && y > 4 && x < plan.width - 5 && y < plan.height - 5) {
            corners.push_back({index, x, y, std::fmax(plan.noise_px, 1e-3)});
        }
    }
    return corners;
}

void add_noise(std::vector<calib::corner> *corners, double noise_px, Random &random) {
    for (calib::corner &corner : *corners) {
        corner.x_px += noise_px * random.normal();
        corner.y_px += noise_px * random.normal();
    }
}

RigViews empty_views(const RigViewsPlan &plan, Random &random) {
    RigViews views;
    const Camera left = make_lens(plan, plan.focal_px, 1, random);
    const Camera right = make_lens(plan, plan.focal_px * plan.focal_right_ratio, 0.8, random);
    // Both cameras turn inwards until their axes meet; the world is the left one's frame.
    const double toe_in = 2 * std::atan(plan.baseline_mm / 2 / plan.distance_mm);
    views.rotation_rad = {random.uniform(-0.01, 0.01), toe_in, random.uniform(-0.01, 0.01)};
    const Vector centre_mm{plan.baseline_mm * std::cos(toe_in / 2), random.uniform(-2, 2),
                           plan.baseline_mm * std::sin(toe_in / 2)};
    views.translation_mm = -1.0 * (rotation_from_vector(views.rotation_rad) * centre_mm);
    views.rig = posed_rig(left, right, views.rotation_rad, views.translation_mm);
    views.seen.cameras = plan.cameras;
    views.seen.width_px = {plan.width, plan.width};
    views.seen.height_px = {plan.height, plan.height};
    views.seen.target.columns = plan.columns;
    views.seen.target.rows = plan.rows;
    views.seen.target.square_mm =
        plan.fill * plan.width / plan.focal_px * plan.distance_mm / (plan.columns - 1);
    return views;
}

}  // namespace

RigViewsPlan handheld_plan() {
    RigViewsPlan plan;
    plan.width = 1280;
    plan.height = 960;
    plan.focal_px = 1000;
    plan.columns = 9;
    plan.rows = 6;
    plan.boards = 15;
    plan.distance_mm = 900;
    plan.baseline_mm = 120;
    plan.depth_range = 0.35;
    plan.fill = 0.45;
    return plan;
}

int draws(int default_value) {
    const char *text = std::getenv("VERGENCE_DRAWS");
    return text != nullptr ? std::max(1, std::atoi(text)) : default_value;
}

RigViews make_rig_views(const RigViewsPlan &plan, uint64_t scene_seed, uint64_t noise_seed) {
    Random random(scene_seed), noise(noise_seed);
    RigViews views = empty_views(plan, random);
    const double square_mm = views.seen.target.square_mm;
    const size_t all = size_t(plan.columns * plan.rows);
    const Rig after_displacement =
        posed_rig(views.rig.left, views.rig.right,
                  views.rotation_rad + Vector{0, plan.displacement_rad, 0}, views.translation_mm);
    const Camera &displaced_right = after_displacement.right;
    int attempts = 0;
    while (int(views.seen.captures.size()) < plan.boards) {
        if (++attempts > 1000 * plan.boards) {
            throw std::runtime_error("no board of the plan is in view");
        }
        const Board board = random_board(plan, views.rig.left, random);
        calib::capture capture;
        const std::string number = std::to_string(1000 + views.seen.captures.size()).substr(1);
        capture.name = {"left" + number, "right" + number};
        capture.view[0].corners = look(plan, views.rig.left, square_mm, board);
        const size_t place = views.seen.captures.size();
        const double moved_mm = place % 2 == 0 ? 0 : plan.moved_mm;
        const Board later = {board.R, board.middle_mm + moved_mm * Vector{1, -0.7, 0.5}};
        const bool displaced = 2 * place >= size_t(plan.boards);
        capture.view[1].corners =
            look(plan, displaced ? displaced_right : views.rig.right, square_mm, later);
        const size_t min = plan.all_in_view ? all : all / 3;
        if (capture.view[0].corners.size() < min ||
            (plan.cameras == 2 && capture.view[1].corners.size() < min)) {
            continue;
        }
        for (calib::board_view &view : capture.view) {
            add_noise(&view.corners, plan.noise_px, noise);
        }
        views.seen.captures.push_back(capture);
        views.R_left_board.push_back(board.R);
        const Vector to_corner{-square_mm * (plan.columns - 1) / 2,
                               -square_mm * (plan.rows - 1) / 2, 0};
        views.t_left_board_mm.push_back(board.R * to_corner + board.middle_mm);
    }
    return views;
}

}  // namespace synthetic
