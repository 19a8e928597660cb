// SPDX-License-Identifier: Apache-2.0
#include "tools/host/calibrate/calibrate_touch_up.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <memory>
#include <nlohmann/json.hpp>

#include "core/error.h"
#include "daemon/session/calibration_at.h"
#include "daemon/surface/calibration_loader.h"
#include "stereo/geometry/geometry.h"
#include "stereo/zoom/self_calibration.h"
#include "tools/host/formats/report_text.hpp"

namespace {

const int min_corners = 12;
const double min_sigma_px = 0.03;
const double max_sigmas = 4;

class looker {
  public:
    looker(const zoom_calibration &zoom, const calibrate_shot &shot, const calib::board &board,
           const calib::capture &capture)
        : zoom_(zoom), shot_(shot), board_(board), capture_(capture) {}

    bool run(touch_up_look *look, std::string *error) {
        message last_error{};
        zoom_state state{};
        std::vector<unsigned char> memory(self_calibration_need_bytes(1));
        arena pool{};
        arena_init(&pool, memory.data(), memory.size());
        if (calibration_at_axes(shot_.state.get(), &state, &last_error) != ERROR_OK ||
            calibration_at_state(&zoom_, &state, "", &look->rig, &last_error) != ERROR_OK) {
            *error = last_error.text;
            return false;
        }
        collect();
        look->corners = int(pairs_.size());
        if (self_calibration_begin(&zoom_, &state, 1, &pool, &self_) != ERROR_OK ||
            look->corners < min_corners || !measure(&look->square_mm, &look->rows_px)) {
            *error = "too few corners of the board in both pictures";
            return false;
        }
        if (!correct(look) || !measure(&look->corrected_square_mm, &look->corrected_rows_px)) {
            *error = "the board does not fit the calibration";
            return false;
        }
        return finish(look);
    }

  private:
    struct both {
        int index;
        std::array<std::array<double, 2>, 2> px;
    };

    std::array<double, 2> on_sensor(size_t side, const calib::corner &corner) const {
        const calibration_window &window = shot_.state->origin.side[side].window;
        return {corner.x_px + window.column_px, corner.y_px + window.row_px};
    }

    void collect() {
        for (int i = 0; i < board_.corner_count(); i++) {
            points_.push_back({(i % board_.columns) * board_.square_mm,
                               (i / board_.columns) * board_.square_mm, 0});
        }
        std::vector<const calib::corner *> left(points_.size());
        for (const calib::corner &corner : capture_.view[0].corners) {
            left[size_t(corner.index)] = &corner;
        }
        double square = 0;
        for (const calib::corner &corner : capture_.view[1].corners) {
            const calib::corner *other = left[size_t(corner.index)];
            if (other != nullptr) {
                pairs_.push_back({corner.index, {on_sensor(0, *other), on_sensor(1, corner)}});
                square += other->sigma_px * other->sigma_px + corner.sigma_px * corner.sigma_px;
            }
        }
        for (const both &pair : pairs_) {
            for (size_t side = 0; side < 2; side++) {
                target_sight sight{int(side), pair.index, {pair.px[side][0], pair.px[side][1]}};
                sights_.push_back(sight);
            }
        }
        const double count = std::max(1.0, 2.0 * double(pairs_.size()));
        sigma_px_ = std::max(min_sigma_px, std::sqrt(square / count));
    }

    /// Mean side of the squares, and median distance of the corners from the epipolar lines.
    bool measure(double *square_mm, double *rows_px) const {
        std::vector<std::array<double, 3>> at(points_.size());
        std::vector<bool> known(points_.size());
        std::vector<double> rows;
        for (const both &pair : pairs_) {
            self_track track{};
            track.count = 2;
            track.view[1] = 1;
            for (size_t side = 0; side < 2; side++) {
                std::copy(pair.px[side].begin(), pair.px[side].end(), track.pixel_px[side]);
            }
            double residual = 0, unused[2 * VIEW_TERMS];
            if (!self_track_epipolar(&self_, &track, &residual, unused) || !(track.point.w > 0)) {
                return false;
            }
            rows.push_back(std::abs(residual) * std::sqrt(2.0));
            const far_point &point = track.point;
            at[size_t(pair.index)] = {point.origin_mm[0] + point.x / point.w,
                                      point.origin_mm[1] + point.y / point.w,
                                      point.origin_mm[2] + 1 / point.w};
            known[size_t(pair.index)] = true;
        }
        double sum = 0;
        int count = 0;
        for (size_t i = 0; i + 1 < points_.size(); i++) {
            if (known[i] && known[i + 1] && (i + 1) % size_t(board_.columns) != 0) {
                sum += std::hypot(at[i][0] - at[i + 1][0], at[i][1] - at[i + 1][1],
                                  at[i][2] - at[i + 1][2]);
                count++;
            }
        }
        std::nth_element(rows.begin(), rows.begin() + long(rows.size() / 2), rows.end());
        *rows_px = rows[rows.size() / 2];
        *square_mm = count > 0 ? sum / count : 0;
        return count > 0;
    }

    bool correct(touch_up_look *look) {
        target_ = {};
        target_.points = int(points_.size());
        target_.sights = int(sights_.size());
        target_.point_mm = reinterpret_cast<const double(*)[3]>(points_.data());
        target_.sight = sights_.data();
        // Robust weights must not take the calibration's own error for outliers: from far to near.
        self_.target = &target_;
        for (const double factor : {100.0, 10.0, 1.0}) {
            target_.sigma_px = factor * sigma_px_;
            if (!self_target_place(self_.view, &target_)) {
                return false;
            }
            (void)self_calibration_solve(&self_, nullptr, 0);
        }
        double seen[3], offset[3];
        for (int i = 0; i < 3; i++) {
            offset[i] = target_.position_mm[i] - self_.view[0].position_mm[i];
        }
        geometry_rotate_back(self_.view[0].R_instrument_camera, offset, seen);
        double gradient[SELF_TERMS_MAX];
        look->depth_mm = seen[2];
        if (!(seen[2] > 0) ||
            !self_depth_gradient(&self_, 0, pairs_[pairs_.size() / 2].px[0].data(), seen[2],
                                 gradient)) {
            return false;
        }
        look->depth_sigma_mm = self_prior_sigma(&self_, gradient);
        look->corrected_depth_sigma_mm = self_posterior_sigma(&self_, gradient);
        // A length across is as wrong as its depth.
        look->square_sigma_mm = board_.square_mm * look->depth_sigma_mm / look->depth_mm;
        look->holds =
            std::abs(look->square_mm - board_.square_mm) < max_sigmas * look->square_sigma_mm;
        return true;
    }

    bool finish(touch_up_look *look) {
        calibration &rig = look->rig;
        camera_view_pair(&self_.view[0], &self_.view[1], &rig);
        rig.scale_sigma = zoom_.scale_sigma;
        rig.yaw_sigma_rad = look->corrected_depth_sigma_mm * calibration_baseline_mm(&rig) /
                            (look->depth_mm * look->depth_mm);
        return calibration_round(&rig) == ERROR_OK &&
               calibration_validate(&rig, nullptr) == ERROR_OK;
    }

    const zoom_calibration &zoom_;
    const calibrate_shot &shot_;
    const calib::board &board_;
    const calib::capture &capture_;
    std::vector<std::array<double, 3>> points_;
    std::vector<both> pairs_;
    std::vector<target_sight> sights_;
    double sigma_px_ = min_sigma_px;
    self_calibration self_ = {};
    self_target target_ = {};
};

}  // namespace

bool calibrate_touch_up(const std::string &zoom_path, const std::vector<calibrate_shot> &shots,
                        const calibrate_views &views, std::vector<touch_up_look> *looks,
                        std::string *error) {
    message last_error{};
    zoom_calibration *read = nullptr;
    if (calibration_loader_zoom(zoom_path.c_str(), &read, &last_error) != ERROR_OK) {
        *error = last_error.text;
        return false;
    }
    const std::unique_ptr<zoom_calibration, void (*)(void *)> zoom(read, std::free);
    if (zoom == nullptr) {
        *error = zoom_path + ": not a calibration of all zooms";
        return false;
    }
    *error = "no pair shows the board in both pictures";
    for (size_t i = 0; i < shots.size(); i++) {
        const calib::capture &capture = views.seen.captures[i];
        if (shots[i].state == nullptr || capture.view[0].corners.empty() ||
            capture.view[1].corners.empty()) {
            continue;
        }
        touch_up_look look;
        look.shot = i;
        if (looker(*zoom, shots[i], views.seen.target, capture).run(&look, error)) {
            looks->push_back(look);
        }
    }
    return !looks->empty();
}

std::string touch_up_text(const std::vector<touch_up_look> &looks) {
    std::string text;
    for (const touch_up_look &look : looks) {
        text += report_text_format(
            "pair %zu: squares %.3f mm (predicted deviation %.3f), rows %.3f px; corrected: "
            "squares %.3f mm, rows %.3f px, depth %.1f mm with a deviation of %.2f mm (%.1f "
            "before)%s\n",
            look.shot + 1, look.square_mm, look.square_sigma_mm, look.rows_px,
            look.corrected_square_mm, look.corrected_rows_px, look.depth_mm,
            look.corrected_depth_sigma_mm, look.depth_sigma_mm,
            look.holds ? "" : "; more than predicted: calibrate");
    }
    return text;
}

std::string touch_up_json(const std::vector<touch_up_look> &looks) {
    nlohmann::ordered_json pairs = nlohmann::ordered_json::array();
    for (const touch_up_look &look : looks) {
        pairs.push_back({{"pair", look.shot + 1},
                         {"corners", look.corners},
                         {"square_mm", look.square_mm},
                         {"square_sigma_mm", look.square_sigma_mm},
                         {"rows_px", look.rows_px},
                         {"holds", look.holds},
                         {"corrected_square_mm", look.corrected_square_mm},
                         {"corrected_rows_px", look.corrected_rows_px},
                         {"depth_mm", look.depth_mm},
                         {"depth_sigma_mm", look.depth_sigma_mm},
                         {"corrected_depth_sigma_mm", look.corrected_depth_sigma_mm}});
    }
    return nlohmann::ordered_json{{"touch_up", pairs}}.dump(2) + "\n";
}
