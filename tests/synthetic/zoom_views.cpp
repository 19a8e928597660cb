// SPDX-License-Identifier: Apache-2.0
#include "synthetic/zoom_views.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace synthetic {

namespace {

const int kWidth = 2048, kHeight = 1536;
const double kLow = 300, kHigh = 850, kPi = 3.14159265358979323846;

double share(double zoom) {
    return (zoom - kLow) / (kHigh - kLow);
}

Vector cross(const Vector &a, const Vector &b) {
    return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

// a after the rotation by `turn`, both about the origin.
Matrix columns_of(const Vector &x, const Vector &y, const Vector &z) {
    return {x.x, y.x, z.x, x.y, y.y, z.y, x.z, y.z, z.z};
}

Vector turned(const Vector &axis, double angle_rad, const Vector &a) {
    const Vector k = (1 / norm(axis)) * axis;  // Rodrigues
    return std::cos(angle_rad) * a + std::sin(angle_rad) * cross(k, a) +
           ((1 - std::cos(angle_rad)) * dot(k, a)) * k;
}

}  // namespace

double focal_mm(const ZoomLens &lens, double zoom) {
    const double s = share(zoom);
    return lens.wide_mm + (lens.tele_mm - lens.wide_mm) * s + lens.bow_mm * 4 * s * (1 - s) +
           lens.ripple_mm * std::sin(2 * kPi * lens.ripple_periods * s + lens.ripple_phase_rad);
}

double zoom_of_focal(const ZoomLens &lens, double focal) {
    double low = kLow, high = kHigh;
    for (int i = 0; i < 60; i++) {
        const double middle = (low + high) / 2;
        (focal_mm(lens, middle) < focal ? low : high) = middle;
    }
    return low;
}

double focus_of(const ZoomLens &lens, double zoom, double distance_mm) {
    const double closeness = 1 / distance_mm - lens.focus_drift_per_m * 1e-3 * share(zoom);
    return kLow + (kHigh - kLow) * closeness * lens.nearest_focus_mm;
}

double toe_in_rad(const ZoomPlan &plan, int side) {
    return (side == 0 ? 1 : -1) * std::atan(125 / plan.toe_in_mm);
}

Camera camera_at(const ZoomCamera &of, const ZoomMoment &moment) {
    const ZoomLens &lens = of.lens;
    const double s = share(moment.zoom), focal = focal_mm(lens, moment.zoom);
    const double closeness = share(moment.focus) / lens.nearest_focus_mm +
                             lens.focus_drift_per_m * 1e-3 * s;  // 1 / distance in focus
    Camera camera;
    camera.width = kWidth;
    camera.height = kHeight;
    camera.fx = camera.fy = focal / (1 - focal * closeness) / lens.pixel_mm;
    // Along an arc.
    const double wave = std::sin(2 * kPi * 5.3 * s + 1);
    camera.cx = (kWidth - 1) / 2.0 + lens.centre_px.x + lens.centre_drift_px.x * s +
                lens.centre_ripple_px * wave;
    camera.cy = (kHeight - 1) / 2.0 + lens.centre_px.y +
                lens.centre_drift_px.y * std::sin(1.5 * s) - lens.centre_ripple_px * wave;
    // In units of the sensor: a share of the radius at its corner.
    const double corner = std::hypot(kWidth, kHeight) / 2 / camera.fx, r2 = corner * corner;
    const double mix = std::log(focal / lens.wide_mm) / std::log(lens.tele_mm / lens.wide_mm);
    camera.k1 = (lens.barrel_wide + (lens.barrel_tele - lens.barrel_wide) * mix) / r2;
    camera.k2 = lens.fourth * (1 - mix) / (r2 * r2);
    camera.p1 = lens.decentring_px / camera.fx / r2;
    camera.p2 = -0.7 * lens.decentring_px / camera.fx / r2;
    // The camera's axes in the world: turned with its mount, then by the servo.
    const Matrix still = rotation_from_vector(of.turn_rad);
    Vector axes[3];
    for (int i = 0; i < 3; i++) {
        const Vector own{double(i == 0), double(i == 1), double(i == 2)};
        axes[i] = turned(of.axis, moment.pan_rad, still * own);
    }
    camera.R_camera_world = transpose(columns_of(axes[0], axes[1], axes[2]));
    camera.centre_mm = of.axis_point_mm +
                       turned(of.axis, moment.pan_rad, of.pupil_mm - of.axis_point_mm) +
                       (lens.pupil_travel_mm * s) * axes[2];
    return camera;
}

ZoomRig make_zoom_rig(const ZoomPlan &plan, uint64_t seed) {
    Random random(seed);
    ZoomRig rig;
    for (int side = 0; side < 2; side++) {
        ZoomCamera &camera = rig.camera[side];
        ZoomLens &lens = camera.lens;
        const auto vary = [&random](double value, double by) {
            return value * (1 + random.uniform(-by, by));
        };
        lens.wide_mm = vary(lens.wide_mm, 0.01);
        lens.tele_mm = vary(lens.tele_mm, 0.01);
        lens.bow_mm = vary(plan.bow_mm, 0.1);
        lens.ripple_mm = plan.ripple_mm;
        lens.ripple_phase_rad = random.uniform(0, 6);
        lens.centre_px = {random.uniform(-10, 10), random.uniform(-10, 10)};
        lens.centre_drift_px = {random.uniform(-15, 15), random.uniform(-15, 15)};
        lens.centre_ripple_px = plan.centre_ripple_px;
        lens.barrel_wide = vary(lens.barrel_wide, 0.1);
        lens.barrel_tele = vary(lens.barrel_tele, 0.1);
        lens.pupil_travel_mm = vary(lens.pupil_travel_mm, 0.05);
        lens.decentring_px = random.uniform(-1, 1);
        lens.focus_drift_per_m = random.uniform(-0.004, 0.004);
        camera.axis = {random.uniform(-0.005, 0.005), 1, random.uniform(-0.005, 0.005)};
        camera.axis_point_mm = {250.0 * side + random.uniform(-4, 4), 0, random.uniform(-42, -35)};
    }
    ZoomCamera &right = rig.camera[1];
    right.pupil_mm = {250, random.uniform(-1, 1), random.uniform(-1, 1)};
    right.turn_rad = {random.uniform(-0.004, 0.004), random.uniform(-0.004, 0.004),
                      random.uniform(-0.004, 0.004)};
    return rig;
}

namespace {

struct Board {
    Matrix R;
    Vector middle_mm;
};

class ViewMaker {
  public:
    ViewMaker(const ZoomPlan &plan, uint64_t scene_seed, uint64_t noise_seed)
        : plan_(plan), random_(scene_seed ^ 0x9e3779b97f4a7c15), noise_(noise_seed) {
        views_.rig = make_zoom_rig(plan, scene_seed);
        calib::zoom_observations &seen = views_.seen;
        seen.width_px = {kWidth, kWidth};
        seen.height_px = {kHeight, kHeight};
        for (size_t side = 0; side < 2; side++) {
            seen.pixel_mm[side] = views_.rig.camera[side].lens.pixel_mm;
        }
        seen.pan_sigma_rad = std::fmax(plan.pan_sigma_rad, 1e-6);
        seen.reading_noise = plan.reading_counts > 0;
        for (int i = 0; i < plan.zooms; i++) {
            const double part = plan.zooms > 1 ? double(i) / (plan.zooms - 1) : 0;
            counts_.push_back(plan.log_spaced
                                  ? std::round(zoom_of_focal(views_.rig.camera[0].lens,
                                                             8.6 * std::pow(84.0 / 8.6, part)))
                                  : std::round(kLow + (kHigh - kLow) * part));
        }
        turn_pans();
    }

    ZoomViews run() {
        if (plan_.same_boards) {
            sweep_all();
        } else {
            for (int zoom = 0; zoom < plan_.zooms; zoom++) {
                add_own_boards(zoom);
            }
        }
        return views_;
    }

  private:
    void turn_pans() {
        for (int side = 0; side < 2; side++) {
            views_.pan_off_rad[side] = plan_.pan_sigma_rad * noise_.normal();
        }
    }

    Board random_board(const Camera &left, double distance_mm, double depth_range) {
        const double tilt = random_.uniform(0.15, 0.65), towards = random_.uniform(-kPi, kPi);
        const Matrix tilted =
            rotation_from_vector({tilt * std::cos(towards), tilt * std::sin(towards), 0});
        const Matrix rolled = rotation_from_vector({0, 0, random_.uniform(-0.4, 0.4)});
        const double depth = distance_mm * random_.uniform(1 - depth_range, 1 + depth_range);
        const Vector ray = left.direction(
            {random_.uniform(0.15, 0.85) * kWidth, random_.uniform(0.15, 0.85) * kHeight});
        const Matrix to_world = transpose(left.R_camera_world);
        const Vector at = left.centre_mm + (depth / (left.R_camera_world * ray).z) * ray;
        return {to_world * (tilted * rolled), at};
    }

    std::vector<calib::corner> look(const Camera &camera, const calib::board &board,
                                    const Board &at) {
        std::vector<calib::corner> corners;
        for (int index = 0; index < board.corner_count(); index++) {
            const double x = index % board.columns - (board.columns - 1) / 2.0;
            const double y = index / board.columns - (board.rows - 1) / 2.0;
            const Vector point = at.R * Vector{x * board.square_mm, y * board.square_mm, 0};
            const auto pixel = camera.project(point + at.middle_mm);
            if (pixel && pixel->x > 4 && pixel->y > 4 && pixel->x < kWidth - 5 &&
                pixel->y < kHeight - 5) {
                corners.push_back({index, pixel->x + plan_.noise_px * noise_.normal(),
                                   pixel->y + plan_.noise_px * noise_.normal(),
                                   std::fmax(plan_.noise_px, 1e-3)});
            }
        }
        return corners;
    }

    // Both cameras at one zoom, focused on the board. Adds nothing where one sees too little.
    bool take(int zoom, size_t board, const Board &at, int position, size_t min) {
        calib::capture capture;
        capture.board = board;
        capture.position = position;
        capture.visit = visit_;
        capture.focused = plan_.scale_error > 0 && zoom % 2 == 0;
        for (int side = 0; side < 2; side++) {
            const ZoomCamera &of = views_.rig.camera[side];
            const double pan = toe_in_rad(plan_, side) + pan_more_rad_;
            ZoomMoment moment{counts_[size_t(zoom)] + plan_.settle_counts * noise_.normal(), 0,
                              pan + views_.pan_off_rad[side]};
            const Camera rough = camera_at(of, moment);
            const double distance = (rough.R_camera_world * (at.middle_mm - rough.centre_mm)).z *
                                    (capture.focused ? 1 : 1 - plan_.scale_error);
            moment.focus =
                std::round(std::clamp(focus_of(of.lens, moment.zoom, distance), kLow, kHigh));
            capture.axes[size_t(side)] = {moment.zoom + plan_.reading_counts * noise_.normal(),
                                          moment.focus, pan};
            capture.view[size_t(side)].corners =
                look(camera_at(of, moment), views_.seen.boards[board], at);
            capture.name[size_t(side)] =
                (side == 0 ? "left" : "right") + std::to_string(1000 + views_.seen.captures.size());
        }
        if (capture.view[0].corners.size() < min || capture.view[1].corners.size() < min) {
            return false;
        }
        for (size_t side = 0; side < 2; side++) {
            spoil(capture.name[side], &capture.view[side].corners);
        }
        views_.seen.captures.push_back(capture);
        return true;
    }

    // A picture of a board that had moved, or single corners that belong to something else.
    void spoil(const std::string &name, std::vector<calib::corner> *corners) {
        if (noise_.uniform(0, 1) < plan_.wrong_views) {
            const double x = noise_.uniform(3, 30), y = noise_.uniform(3, 30);
            for (calib::corner &corner : *corners) {
                corner.x_px += x;
                corner.y_px -= y;
            }
            views_.wrong_views.push_back(name);
            return;
        }
        for (calib::corner &corner : *corners) {
            if (noise_.uniform(0, 1) < plan_.wrong_corners) {
                corner.x_px += noise_.uniform(0, 1) < 0.5 ? 2.5 : -7;
                corner.y_px += noise_.uniform(-4, 4);
                views_.wrong_corners.emplace_back(name, corner.index);
            }
        }
    }

    Camera left_at(int zoom) const {
        return camera_at(views_.rig.camera[0], {counts_[size_t(zoom)], 600,
                                                toe_in_rad(plan_, 0) + views_.pan_off_rad[0]});
    }

    void add_own_boards(int zoom) {
        const Camera left = left_at(zoom);
        calib::board board;
        board.columns = 12;
        board.rows = 9;
        board.square_mm = 0.6 * kWidth / left.fx * 1800 / 11;
        views_.seen.boards.push_back(board);
        // As far as the field is in focus.
        const double depth_range = std::clamp(0.25 * 2656 / left.fx, 0.025, 0.2);
        int attempts = 0;
        for (int taken = 0; taken < plan_.boards; attempts++) {
            if (attempts > 1000 * plan_.boards) {
                throw std::runtime_error("no board of the plan is in view");
            }
            taken += take(zoom, size_t(zoom), random_board(left, 1800, depth_range),
                          next_position_++, 36);
        }
    }

    void sweep_all() {
        calib::board board;
        board.columns = 10;
        board.rows = 7;
        board.square_mm = 24;
        board.dictionary = "4x4_50";
        board.marker_mm = 17;
        views_.seen.boards.push_back(board);
        for (int i = 0; i < plan_.boards; i++) {
            visit_ = i * plan_.pans / plan_.boards;
            pan_more_rad_ = visit_ == 0 ? 0 : (visit_ % 2 == 0 ? -1 : 1) * 0.05 * visit_;
            if (i > 0 && visit_ != (i - 1) * plan_.pans / plan_.boards) {
                turn_pans();
            }
            // Near boards fill the wide end, far ones are seen by all.
            const double distance = i % 3 == 0 ? 750 : i % 3 == 1 ? 1500 : 2000;
            const int aim = i % 3 == 0 ? 0 : plan_.zooms - 1;
            int best = 0;
            for (int attempt = 0; attempt < 1000 && best == 0; attempt++) {
                const Board at = random_board(left_at(aim), distance, 0.1);
                best += take(aim, 0, at, i, 16);
                for (int zoom = 0; best > 0 && zoom < plan_.zooms; zoom++) {
                    if (zoom != aim) {
                        take(zoom, 0, at, i, 12);
                    }
                }
            }
        }
    }

    const ZoomPlan &plan_;
    Random random_, noise_;
    std::vector<double> counts_;
    ZoomViews views_;
    int next_position_ = 0, visit_ = 0;
    double pan_more_rad_ = 0;
};

}  // namespace

ZoomViews make_zoom_views(const ZoomPlan &plan, uint64_t scene_seed, uint64_t noise_seed) {
    return ViewMaker(plan, scene_seed, noise_seed).run();
}

}  // namespace synthetic
