// SPDX-License-Identifier: Apache-2.0
#include "tests/study/zoom/study_rig.hpp"

#include <algorithm>
#include <cmath>

namespace zoom_study {
namespace {

constexpr double kPi = 3.14159265358979323846;
constexpr double kPeriodUs = 20000;

std::string file_of(const std::string &name) {
    return name.find('/') != std::string::npos
               ? name
               : std::string(SIMRIG_FILES) + "/rigs/" + name + ".yaml";
}

}  // namespace

StudyRig::StudyRig(const std::string &name, uint64_t seed, double drift_sigma_counts)
    : world_(world::load_rig(file_of(name))), settings_(simrig::load_settings(file_of(name))) {
    simrig::Noise noise(seed ^ 0xD1B54A32D192ED03u);
    for (size_t side = 0; side < 2; side++) {
        servos_.emplace_back(settings_.servo[side], seed * 64 + side);
        for (size_t axis = 0; axis < 3; axis++) {
            simrig::LensMotorSettings motor = settings_.lens[side].motor[axis];
            // The file's drift is for captures; in use, hours later, it has this sigma.
            if (drift_sigma_counts > 0) {
                motor.drift_counts = drift_sigma_counts * noise.gauss();
                motor.drift_counts_per_h = 0;
            }
            motors_[side].emplace_back(motor, settings_.lens[side].position[axis],
                                       seed * 64 + 16 + side * 3 + axis);
        }
    }
}

void StudyRig::turn(double left_rad, double right_rad) {
    const double target_rad[2] = {left_rad, right_rad};
    // The last step comes from below, as firmware/rig/rig.h says: from three dead bands.
    constexpr double kBelowDeg = 0.87;
    for (const double before_deg : {kBelowDeg, 0.0}) {
        for (const double end_us = time_us_ + 1e6; time_us_ < end_us; time_us_ += kPeriodUs) {
            for (size_t side = 0; side < 2; side++) {
                const simrig::ServoSettings &servo = settings_.servo[side];
                const double deg = target_rad[side] * 180 / kPi - before_deg;
                servos_[side].edge(time_us_, true);
                servos_[side].edge(time_us_ + servo.centre_us + servo.us_per_degree * deg, false);
            }
        }
    }
    pan_rad_ = {left_rad, right_rad};
}

void StudyRig::set_lens(int side, double zoom, double focus) {
    // Approached from above, as firmware/rig/lens_move.h does.
    constexpr double kAbove = 10;
    for (const double above : {kAbove, 0.0}) {
        motor(side, 0).go(time_us_, zoom + above);
        motor(side, 1).go(time_us_, focus + above);
        while (motor(side, 0).moving(time_us_) || motor(side, 1).moving(time_us_)) {
            time_us_ += 10000;
        }
        time_us_ += 100000;
    }
}

// Without outliers: those farther than a few counts from the median.
double StudyRig::mean_of_readings(int side, int axis) {
    std::vector<int> readings;
    for (int i = 0; i < 16; i++) {
        time_us_ += 10000;
        readings.push_back(motor(side, axis).read(time_us_));
    }
    std::sort(readings.begin(), readings.end());
    double sum = 0;
    int count = 0;
    for (const int reading : readings) {
        if (std::abs(reading - readings[8]) <= 6) {
            sum += reading;
            count++;
        }
    }
    return sum / count;
}

zoom_state StudyRig::read() {
    zoom_state state{};
    for (int side = 0; side < 2; side++) {
        state.side[side].zoom_counts = mean_of_readings(side, 0);
        state.side[side].focus_counts = mean_of_readings(side, 1);
        state.side[side].pan_rad = pan_rad_[size_t(side)];
    }
    return state;
}

zoom_state StudyRig::exact() {
    zoom_state state = {};
    for (int side = 0; side < 2; side++) {
        const world::Mechanics at = mechanics(side);
        state.side[side].zoom_counts = at.zoom - 2;
        state.side[side].focus_counts = at.focus - 2;
        state.side[side].pan_rad = pan_rad_[size_t(side)];
    }
    return state;
}

world::Mechanics StudyRig::mechanics(int side) {
    world::Mechanics mechanics;
    mechanics.pan_rad = servos_[size_t(side)].angle_deg(time_us_) * kPi / 180;
    mechanics.zoom = std::clamp(motor(side, 0).ring(time_us_), 300.0, 850.0);
    mechanics.focus = std::clamp(motor(side, 1).ring(time_us_), 300.0, 850.0);
    mechanics.iris = 500;
    mechanics.warm =
        settings_.warm_up_h > 0 ? 1 - std::exp(-time_us_ / 3600e6 / settings_.warm_up_h) : 0;
    return mechanics;
}

world::Camera StudyRig::camera(int side) {
    return world::camera_at(world_.camera[side], mechanics(side));
}

double toe_in_rad(int side, double distance_mm) {
    return (side == 0 ? 1 : -1) * std::atan(kBaselineMm / 2 / distance_mm);
}

double zoom_of_focal(const world::RigCamera &camera, double focal_mm) {
    double low = 300, high = 850;
    for (int i = 0; i < 50; i++) {
        world::Mechanics m;
        m.zoom = 0.5 * (low + high);
        (world::optics_of(camera.lens, 3.2, m).focal_length_mm < focal_mm ? low : high) = m.zoom;
    }
    return std::round(low);
}

namespace {

using world::Mat3;
using world::Vec2;
using world::Vec3;

calib::board coded_board() {
    calib::board board;
    board.columns = 10;
    board.rows = 7;
    board.square_mm = 24;
    board.dictionary = "4x4_50";
    board.marker_mm = 17;
    return board;
}

struct Placed {
    Mat3 rotation;
    Vec3 middle_mm;
};

class Capture {
  public:
    Capture(StudyRig &rig, const CapturePlan &plan, uint64_t seed)
        : rig_(rig), plan_(plan), noise_(seed) {
        seen_.reading_noise = !plan.is_exact;
        // Logarithmic in f, within both lenses' ranges and with room for the approach.
        for (int i = 0; i < plan.zooms; i++) {
            const double focal = 8.62 * std::pow(84.0 / 8.62, double(i) / (plan.zooms - 1));
            focal_mm_.push_back(focal);
        }
    }

    calib::zoom_observations run() {
        for (int position = 0; position < plan_.positions; position++) {
            const int visit = position * plan_.visits / plan_.positions;
            if (position == 0 || visit != visit_) {
                visit_ = visit;
                // Far boards fill the tele field of both cameras only where their axes meet.
                constexpr double kMeetMm[] = {1800, 2600, 1300, 3200};
                meet_mm_ = kMeetMm[visit % 4];
                rig_.turn(toe_in_rad(0, meet_mm_), toe_in_rad(1, meet_mm_));
            }
            take_all(position);
            rig_.wait(30);  // someone moves the board
        }
        return seen_;
    }

  private:
    double uniform(double low, double high) { return low + (high - low) * noise_.uniform(); }

    void go_to(size_t zoom, double distance_mm) {
        for (int side = 0; side < 2; side++) {
            const world::RigCamera &camera = rig_.world().camera[side];
            const double counts = std::clamp(zoom_of_focal(camera, focal_mm_[zoom]), 300.0, 848.0);
            // As far as autofocus finds it.
            const double focus =
                world::focus_position_for(camera.lens, counts, distance_mm) + noise_.gauss();
            rig_.set_lens(side, counts, std::round(std::clamp(focus, 300.0, 840.0)));
        }
    }

    // Somewhere in the left camera's field, tilted.
    Placed random_board(double distance_mm) {
        const world::Camera left = rig_.camera(0);
        const double tilt = uniform(0.15, 0.65), towards = uniform(-kPi, kPi);
        const Vec2 slopes =
            left.slopes_of({uniform(0.15, 0.85) * 2048, uniform(0.15, 0.85) * 1536});
        const double z = distance_mm * uniform(0.9, 1.1);
        const Mat3 tilted = world::rotation_about({std::cos(towards), std::sin(towards), 0}, tilt) *
                            world::rotation_about({0, 0, 1}, uniform(-0.4, 0.4));
        return {left.world_camera.rotation * tilted,
                left.world_camera * Vec3{slopes.x * z, slopes.y * z, z}};
    }

    std::vector<calib::corner> look(const world::Camera &camera, const Placed &at) {
        std::vector<calib::corner> corners;
        const world::Pose camera_world = world::inverse(camera.world_camera);
        for (int index = 0; index < board_.corner_count(); index++) {
            const double x = (index % 10 - 4.5) * 24, y = (index / 10 - 3.0) * 24;
            const Vec3 point = camera_world * (at.middle_mm + at.rotation * Vec3{x, y, 0});
            if (point.z < 100) {
                continue;
            }
            const Vec2 px = camera.project(point);
            const double blur_px = 0.5 * camera.optics.pupil_diameter_mm * camera.optics.focal_px *
                                   std::fabs(1 / point.z - 1 / camera.optics.focus_distance_mm);
            // Beyond that a detector finds no corner.
            const bool inside = px.x > 6 && px.y > 6 && px.x < 2041 && px.y < 1529;
            if (inside && blur_px < 10 && camera.optics.focal_px * 24 / point.z > 12) {
                corners.push_back({index, px.x + plan_.noise_px * noise_.gauss(),
                                   px.y + plan_.noise_px * noise_.gauss(), plan_.noise_px});
            }
        }
        return corners;
    }

    bool take(size_t zoom, const Placed &at, int position, size_t min) {
        const world::Pose camera_world = world::inverse(rig_.camera(0).world_camera);
        go_to(zoom, (camera_world * at.middle_mm).z);
        rig_.wait(3);  // exposure and autofocus
        calib::capture capture;
        capture.board = 0;
        capture.position = position;
        capture.visit = visit_;
        const zoom_state state = plan_.is_exact ? rig_.exact() : rig_.read();
        for (int side = 0; side < 2; side++) {
            const auto &axes = state.side[side];
            capture.axes[size_t(side)] = {axes.zoom_counts, axes.focus_counts, axes.pan_rad};
            capture.view[size_t(side)].corners = look(rig_.camera(side), at);
            capture.name[size_t(side)] =
                (side == 0 ? "left" : "right") + std::to_string(1000 + seen_.captures.size());
        }
        if (capture.view[0].corners.size() < min || capture.view[1].corners.size() < min) {
            return false;
        }
        for (int side = 0; side < 2 && plan_.detect; side++) {
            std::vector<calib::corner> &corners = capture.view[size_t(side)].corners;
            corners = plan_.detect(board_, {at.rotation, at.middle_mm}, side, corners);
        }
        seen_.captures.push_back(capture);
        return true;
    }

    void take_all(int position) {
        const int kind = position % 3;
        const double distance_mm = kind == 0 ? 750 : meet_mm_;
        const size_t aim = kind == 0 ? 0 : kind == 1 ? focal_mm_.size() / 2 : focal_mm_.size() - 1;
        go_to(aim, distance_mm);
        for (int attempt = 0; attempt < 1000; attempt++) {
            const Placed at = random_board(distance_mm);
            if (!take(aim, at, position, 16)) {
                continue;
            }
            for (size_t zoom = 0; zoom < focal_mm_.size(); zoom++) {
                if (zoom != aim) {
                    take(zoom, at, position, 12);
                }
            }
            return;
        }
    }

    StudyRig &rig_;
    const CapturePlan plan_;
    simrig::Noise noise_;
    calib::zoom_observations seen_ = empty_observations();
    const calib::board board_ = seen_.boards[0];
    std::vector<double> focal_mm_;
    int visit_ = 0;
    double meet_mm_ = kToeInMm;
};

}  // namespace

calib::zoom_observations empty_observations() {
    calib::zoom_observations seen;
    seen.boards = {coded_board()};
    seen.width_px = {world::kArrayColumns, world::kArrayColumns};
    seen.height_px = {world::kArrayRows, world::kArrayRows};
    seen.pixel_mm = {0.0032, 0.0032};
    return seen;
}

calib::zoom_observations capture(StudyRig &rig, const CapturePlan &plan, uint64_t seed) {
    return Capture(rig, plan, seed).run();
}

}  // namespace zoom_study
