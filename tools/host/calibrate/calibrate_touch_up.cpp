// SPDX-License-Identifier: Apache-2.0
#include "tools/host/calibrate/calibrate_touch_up.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <memory>
#include <numeric>

#include "console/pair/calibration_at.h"
#include "core/error.h"
#include "daemon/surface/calibration_loader.h"
#include "stereo/geometry/geometry.h"
#include "stereo/zoom/adjust_pair.h"
#include "stereo/zoom/adjustment.h"
#include "tools/host/formats/report_text.hpp"

namespace {

const int min_corners = 12;
const double min_sigma_px = 0.03;
const double max_sigmas = 4;
const double picked_sigma_px = 0.5;  // sigma of marks that a person picks
const double far_depth_mm = 2000;    // depth at which the effect of a thing at infinity is stated
const double nearest_mm = 300;       // smallest depth that both cameras see
// Rows of the pair's own matches may come apart by this much when the size is added.
const double rows_factor = 2, rows_more_px = 0.05;
// Of standard deviations of what is added: robust weights must not take the calibration's own error
// for outliers.
const double from_far_to_near[] = {100, 50, 25, 12, 6, 3, 1.5, 1};

using places = std::array<std::array<double, 2>, 2>;

/// On the sensors, of pixels of the left and of the right picture.
places places_of(const calibrate_shot &shot, const touch_up_marks::place &px) {
    places at = {{{px[0], px[1]}, {px[2], px[3]}}};
    for (size_t side = 0; side < 2; side++) {
        adjust_to_sensor(&shot.state->origin.side[side].window, at[side].data());
    }
    return at;
}

class looker {
  public:
    looker(const zoom_calibration &zoom, const calibrate_shot &shot, const calib::board &board,
           const calib::capture &capture, const touch_up_marks &marks, bool corrects)
        : zoom_(zoom), shot_(shot), board_(board), capture_(capture), corrects_(corrects) {
        if (marks.far) {
            far_ = track_of({0, on_sensor(marks.infinity)});
            far_.sigma_px = picked_sigma_px;
            far_.at_infinity = true;
        }
        has_far_ = marks.far;
    }

    bool run(touch_up_look *look, std::string *error) {
        message last_error{};
        zoom_state state{};
        std::vector<unsigned char> memory(adjustment_need_bytes(1));
        arena pool{};
        arena_init(&pool, memory.data(), memory.size());
        if (calibration_at_axes(shot_.state.get(), &state, &last_error) != ERROR_OK ||
            calibration_at_state(&zoom_, &state, "", &look->rig, &last_error) != ERROR_OK ||
            calibration_match(&look->rig, shot_.state.get(), nullptr, &last_error) != ERROR_OK) {
            *error = last_error.text;
            return false;
        }
        collect();
        look->corners = int(pairs_.size());
        look->marks = board_.corner_count() == 2;
        if (adjustment_begin(&zoom_, &state, 1, &pool, &adjustment_) != ERROR_OK) {
            *error = "out of memory";
            return false;
        }
        *error = look->marks ? "the marks do not fit the calibration"
                             : "the board does not fit the calibration";
        state_ = state;
        return pairs_.empty() ? fit_far(look) && finish(look) : look_at_board(look, error);
    }

  private:
    struct both {
        int index;
        std::array<std::array<double, 2>, 2> px;
    };

    bool look_at_board(touch_up_look *look, std::string *error) {
        if (!known_.is_enough()) {
            *error = "too few corners of the board in both pictures";
            return false;
        }
        if (!measure(adjust_prior_sigma, &look->read) || !fit_rows(look) ||
            (corrects_ && !fit_board(look))) {
            return false;
        }
        look->holds = (!corrects_ || agrees_with_own(look)) &&
                      std::max({look->read.square_z(board_.square_mm), look->read.rows_z(),
                                look->fitted.square_z(board_.square_mm)}) < max_sigmas &&
                      (!has_far_ || far_holds(*look));
        return !corrects_ || finish(look);
    }

    using sigma_function = double (*)(const adjustment *, const double *);

    places on_sensor(const touch_up_marks::place &px) const { return places_of(shot_, px); }

    /// With the pair's own matches, and a thing at infinity whose sigma is taken `factor` times.
    int solve(double factor) {
        std::vector<adjust_track> tracks = own_;
        if (has_far_) {
            tracks.push_back(far_);
            tracks.back().sigma_px *= factor;
        }
        return adjustment_solve(&adjustment_, tracks.data(), int(tracks.size()));
    }

    /// Matches the two pictures, as any pair is adjusted, and corrects the views by them and by
    /// `more`. Without pictures there are no matches.
    void match_own(const std::vector<adjust_track> &more, touch_up_look *look) {
        std::array<calibrate_image, 2> image;
        adjust_picture picture{};
        picture.axes = state_;
        picture.depth_near_mm = nearest_mm;
        picture.depth_far_mm = INFINITY;
        bool whole = true;
        for (size_t side = 0; side < 2; side++) {
            std::string ignored;  // the corners' own reading said it
            whole = whole &&
                    calibrate_image_read(shot_.path[side], shot_.mosaic, &image[side], &ignored);
            calibrate_image &one = image[side];
            whole = whole && one.shrink == 1 && one.width_px == shot_.state->width_px[side] &&
                    one.height_px == shot_.state->height_px[side];
            picture.grey[side] = {one.grey.data(), one.width_px, one.height_px, one.width_px};
            picture.window[side] = shot_.state->origin.side[side].window;
        }
        std::vector<adjust_track> tracks(SPARSE_LEFT_MAX);
        adjust_tracks kept = {tracks.data(), 0, SPARSE_LEFT_MAX};
        adjust_report report{};
        if (whole) {
            const size_t bytes =
                std::max(adjust_pair_match_need_bytes(image[0].width_px, image[0].height_px),
                         adjust_pair_match_need_bytes(image[1].width_px, image[1].height_px));
            std::vector<unsigned char> memory(bytes);
            arena pool{};
            arena_init(&pool, memory.data(), memory.size());
            if (adjust_pair_match(&picture, &pool, &adjustment_, &kept, &report) == ERROR_OK) {
                own_.assign(tracks.begin(), tracks.begin() + kept.count);
            }
        }
        look->matches = int(own_.size());
        std::vector<adjust_track> all = own_;
        all.insert(all.end(), more.begin(), more.end());
        (void)adjustment_solve(&adjustment_, all.data(), int(all.size()));
        look->own_rows_px = own_rows_px();
    }

    /// Median distance of the pair's own matches from the epipolar lines.
    double own_rows_px() const {
        std::vector<double> rows;
        for (adjust_track track : own_) {
            double residual = 0, gradient[ADJUST_TERMS_MAX];
            if (adjustment_track_epipolar(&adjustment_, &track, &residual, gradient)) {
                rows.push_back(std::abs(residual) * std::sqrt(2.0));
            }
        }
        return rows.empty() ? 0 : median(rows);
    }

    /// The pair's own matches still fit; and the correction is one that the calibration allows, as
    /// far as marks show that: the corners of a board show deviations that are small beside its
    /// size.
    bool agrees_with_own(touch_up_look *look) const {
        look->own_rows_after_px = own_rows_px();
        look->own_apart = look->own_rows_after_px > rows_factor * look->own_rows_px + rows_more_px;
        return !look->own_apart &&
               (look->corners > 2 || adjust_chi_square_score(&adjustment_) < max_sigmas);
    }

    /// The direction of a thing at infinity, without a length.
    bool fit_far(touch_up_look *look) {
        look->depth_mm = far_depth_mm;
        if (!measure_far_only(adjust_prior_sigma, &look->read, &look->depth_sigma_mm)) {
            return false;
        }
        match_own({}, look);
        if (!measure_far_only(adjust_posterior_sigma, &look->fitted,
                              &look->fitted_depth_sigma_mm)) {
            return false;
        }
        for (const double factor : from_far_to_near) {
            (void)solve(factor);
        }
        if (!measure_far_only(adjust_posterior_sigma, &look->corrected,
                              &look->corrected_depth_sigma_mm) ||
            !(std::max(look->corrected.rows_z(), look->corrected.far_z()) < max_sigmas)) {
            return false;
        }
        look->holds = agrees_with_own(look) && far_holds(*look);
        return true;
    }

    static bool far_holds(const touch_up_look &look) {
        return std::max({look.read.rows_z(), look.read.far_z(), look.fitted.rows_z(),
                         look.fitted.far_z()}) < max_sigmas;
    }

    /// By how much the two directions of the thing at infinity differ, along the rows: px of the
    /// left camera.
    bool far_apart(const adjustment &adjustment, double *apart_px) const {
        double left[3], right[3];
        if (!camera_view_ray(&adjustment.view[0], far_.pixel_px[0], left) ||
            !camera_view_ray(&adjustment.view[1], far_.pixel_px[1], right) || !(left[2] > 0) ||
            !(right[2] > 0)) {
            return false;
        }
        *apart_px = (right[0] / right[2] - left[0] / left[2]) * adjustment.view[0].lens.fx_px;
        return true;
    }

    bool measure_far(sigma_function sigma_of, board_fit *fit) const {
        double gradient[ADJUST_TERMS_MAX] = {}, apart = 0, after = 0;
        if (!far_apart(adjustment_, &apart)) {
            return false;
        }
        for (int i = 0; i < adjustment_.terms; i++) {
            adjustment moved;
            const double step = moved_view(i, &moved);
            gradient[i] = step > 0 && far_apart(moved, &after) ? (after - apart) / step : 0;
        }
        fit->far_px = std::abs(apart);
        fit->far_sigma_px =
            std::hypot(sigma_of(&adjustment_, gradient), far_.sigma_px * std::sqrt(2.0));
        return true;
    }

    /// How far the thing at infinity is from its epipolar line and from infinity, and how well the
    /// depth at `far_depth_mm` is known.
    bool measure_far_only(sigma_function sigma_of, board_fit *fit, double *sigma_mm) const {
        const double middle[2] = {0.5 * adjustment_.view[0].lens.width_px,
                                  0.5 * adjustment_.view[0].lens.height_px};
        double residual = 0, along[ADJUST_TERMS_MAX] = {}, gradient[ADJUST_TERMS_MAX];
        adjust_track track = far_;
        track.at_infinity = false;
        if (!adjustment_track_epipolar(&adjustment_, &track, &residual, along) ||
            !measure_far(sigma_of, fit) ||
            !adjustment_depth_gradient(&adjustment_, 0, middle, far_depth_mm, gradient)) {
            return false;
        }
        fit->rows_px = std::abs(residual) * std::sqrt(2.0);
        fit->rows_sigma_px =
            std::hypot(sigma_of(&adjustment_, along), far_.sigma_px) * std::sqrt(2.0);
        *sigma_mm = sigma_of(&adjustment_, gradient);
        return true;
    }

    /// The views with one correction changed by a part of its uncertainty, which is returned.
    double moved_view(int term, adjustment *moved) const {
        double one[ADJUST_TERMS_MAX] = {};
        std::array<double, VIEW_TERMS> correction{};
        one[term] = 1;
        const double step = 0.1 * adjust_prior_sigma(&adjustment_, one);
        correction[size_t(term % VIEW_TERMS)] = step;
        *moved = adjustment_;
        camera_view_correct(&adjustment_.view[term / VIEW_TERMS], correction.data(),
                            &moved->view[term / VIEW_TERMS]);
        return step;
    }

    void collect() {
        known_ = known_size_find(shot_, board_, capture_);
        for (size_t i = 0; i + 1 < known_.seen.size(); i += 2) {
            const target_observation &left = known_.seen[i], &right = known_.seen[i + 1];
            pairs_.push_back(
                {left.point,
                 {{{left.pixel_px[0], left.pixel_px[1]}, {right.pixel_px[0], right.pixel_px[1]}}}});
        }
    }

    adjust_track track_of(const both &pair) const {
        adjust_track track{};
        track.count = 2;
        track.view[1] = 1;
        track.sigma_px = known_.sigma_px;
        for (size_t side = 0; side < 2; side++) {
            std::copy(pair.px[side].begin(), pair.px[side].end(), track.pixel_px[side]);
        }
        return track;
    }

    /// Sides of the squares along the board's rows; none if a corner cannot be placed.
    std::vector<double> sides(const adjustment &adjustment) const {
        std::vector<std::array<double, 3>> at(known_.points_mm.size());
        std::vector<bool> known(known_.points_mm.size());
        std::vector<double> found;
        for (const both &pair : pairs_) {
            adjust_track track = track_of(pair);
            if (!adjustment_track_place(&adjustment, &track) || !(track.point.w > 0)) {
                return {};
            }
            const far_point &point = track.point;
            at[size_t(pair.index)] = {point.origin_mm[0] + point.x / point.w,
                                      point.origin_mm[1] + point.y / point.w,
                                      point.origin_mm[2] + 1 / point.w};
            known[size_t(pair.index)] = true;
        }
        for (size_t i = 0; i + 1 < known_.points_mm.size(); i++) {
            if (known[i] && known[i + 1] && (i + 1) % size_t(board_.columns) != 0) {
                found.push_back(std::hypot(at[i][0] - at[i + 1][0], at[i][1] - at[i + 1][1],
                                           at[i][2] - at[i + 1][2]));
            }
        }
        return found;
    }

    /// Their mean, which is predicted as well as the views are known and the corners found.
    bool measure_squares(sigma_function sigma_of, board_fit *fit) const {
        const std::vector<double> found = sides(adjustment_);
        const double count = double(found.size());
        double square = 0, gradient[ADJUST_TERMS_MAX] = {};
        fit->square_mm = mean(found);
        for (const double side : found) {
            square += (side - fit->square_mm) * (side - fit->square_mm);
        }
        for (int i = 0; i < adjustment_.terms; i++) {
            adjustment moved;
            const double step = moved_view(i, &moved);
            gradient[i] = step > 0 ? (mean(sides(moved)) - fit->square_mm) / step : 0;
        }
        fit->square_sigma_mm =
            std::hypot(sigma_of(&adjustment_, gradient), zoom_.scale_sigma * fit->square_mm,
                       std::sqrt(square) / std::max(1.0, count));
        return count > 0;
    }

    static double mean(const std::vector<double> &values) {
        return values.empty()
                   ? 0
                   : std::accumulate(values.begin(), values.end(), 0.0) / double(values.size());
    }

    static double median(std::vector<double> values) {
        const auto middle = values.begin() + long(values.size() / 2);
        std::nth_element(values.begin(), middle, values.end());
        return *middle;
    }

    /// How far the corners are from the epipolar lines, and squares.
    bool measure(sigma_function sigma_of, board_fit *fit) const {
        std::vector<double> rows, sigmas;
        for (const both &pair : pairs_) {
            adjust_track track = track_of(pair);
            double residual = 0, gradient[ADJUST_TERMS_MAX] = {};
            if (!adjustment_track_epipolar(&adjustment_, &track, &residual, gradient)) {
                return false;
            }
            rows.push_back(std::abs(residual) * std::sqrt(2.0));
            sigmas.push_back(std::hypot(sigma_of(&adjustment_, gradient), known_.sigma_px) *
                             std::sqrt(2.0));
        }
        fit->rows_px = median(rows);
        fit->rows_sigma_px = median(sigmas);
        return measure_squares(sigma_of, fit) && (!has_far_ || measure_far(sigma_of, fit));
    }

    /// Distance of the board's middle, and how well it is known.
    bool measure_depth(sigma_function sigma_of, double *depth_mm, double *sigma_mm) const {
        double gradient[ADJUST_TERMS_MAX], seen[3], offset[3];
        adjust_track track = track_of(pairs_[pairs_.size() / 2]);
        if (!adjustment_track_place(&adjustment_, &track) || !(track.point.w > 0)) {
            return false;
        }
        const far_point &point = track.point;
        const double from[3] = {point.x / point.w, point.y / point.w, 1 / point.w};
        for (int i = 0; i < 3; i++) {
            offset[i] = point.origin_mm[i] + from[i] - adjustment_.view[0].position_mm[i];
        }
        geometry_rotate_back(adjustment_.view[0].R_instrument_camera, offset, seen);
        *depth_mm = seen[2];
        if (!(seen[2] > 0) ||
            !adjustment_depth_gradient(&adjustment_, 0, track.pixel_px[0], seen[2], gradient)) {
            return false;
        }
        *sigma_mm = sigma_of(&adjustment_, gradient);
        return true;
    }

    /// As a pair is adjusted whose scene is not known.
    bool fit_rows(touch_up_look *look) {
        if (!measure_depth(adjust_prior_sigma, &look->depth_mm, &look->depth_sigma_mm)) {
            return false;
        }
        std::vector<adjust_track> tracks;
        for (const both &pair : pairs_) {
            tracks.push_back(track_of(pair));
        }
        match_own(tracks, look);
        double depth_mm = 0;
        return measure(adjust_posterior_sigma, &look->fitted) &&
               measure_depth(adjust_posterior_sigma, &depth_mm, &look->fitted_depth_sigma_mm);
    }

    bool fit_board(touch_up_look *look) {
        target_ = known_.target();
        (void)solve(from_far_to_near[0]);
        adjustment_.target = &target_;
        for (const double factor : from_far_to_near) {
            target_.sigma_px = factor * known_.sigma_px;
            if (!adjust_target_place(adjustment_.view, &target_)) {
                return false;
            }
            (void)solve(factor);
        }
        return measure(adjust_posterior_sigma, &look->corrected) &&
               look->corrected.far_z() < max_sigmas &&
               std::max(look->corrected.rows_z(), look->corrected.square_z(board_.square_mm)) <
                   max_sigmas &&
               measure_depth(adjust_posterior_sigma, &look->depth_mm,
                             &look->corrected_depth_sigma_mm);
    }

    bool finish(touch_up_look *look) {
        calibration &rig = look->rig;
        camera_view_pair(&adjustment_.view[0], &adjustment_.view[1], &rig);
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
    bool corrects_;
    known_size known_;
    std::vector<both> pairs_;
    zoom_state state_ = {};
    std::vector<adjust_track> own_;  // matches of the two pictures
    adjustment adjustment_ = {};
    adjust_target target_ = {};
    adjust_track far_ = {};
    bool has_far_ = false;
};

/// SESSION:N, of the last part of the session's path.
std::string name_of(const calibrate_shot &shot) {
    const std::string folder = shot.path[0].substr(0, shot.path[0].rfind('/'));
    return report_text_file_name(folder) + ":" + std::to_string(shot.number);
}

}  // namespace

double board_fit::square_z(double true_mm) const {
    return square_mm > 0 && square_sigma_mm > 0 ? std::abs(square_mm - true_mm) / square_sigma_mm
                                                : 0;
}

double board_fit::far_z() const {
    return far_sigma_px > 0 ? far_px / far_sigma_px : 0;
}

double board_fit::rows_z() const {
    return rows_sigma_px > 0 ? rows_px / rows_sigma_px : 0;
}

known_size known_size_find(const calibrate_shot &shot, const calib::board &board,
                           const calib::capture &capture) {
    known_size known;
    for (int i = 0; i < board.corner_count(); i++) {
        known.points_mm.push_back(
            {(i % board.columns) * board.square_mm, (i / board.columns) * board.square_mm, 0});
    }
    std::vector<const calib::corner *> left(known.points_mm.size());
    for (const calib::corner &corner : capture.view[0].corners) {
        left[size_t(corner.index)] = &corner;
    }
    double square = 0;
    for (const calib::corner &corner : capture.view[1].corners) {
        const calib::corner *other = left[size_t(corner.index)];
        if (other == nullptr) {
            continue;
        }
        const places at = places_of(shot, {other->x_px, other->y_px, corner.x_px, corner.y_px});
        for (size_t side = 0; side < 2; side++) {
            known.seen.push_back({int(side), corner.index, {at[side][0], at[side][1]}});
        }
        square += other->sigma_px * other->sigma_px + corner.sigma_px * corner.sigma_px;
    }
    const double count = std::max<double>(1, double(known.seen.size()));
    known.sigma_px = std::max(min_sigma_px, std::sqrt(square / count));
    return known;
}

bool known_size::is_enough() const {
    return seen.size() / 2 >= std::min(size_t(min_corners), points_mm.size());
}

adjust_target known_size::target() const {
    adjust_target target{};
    target.points = int(points_mm.size());
    target.observations = int(seen.size());
    target.point_mm = reinterpret_cast<const double(*)[3]>(points_mm.data());
    target.observation = seen.data();
    target.sigma_px = sigma_px;
    return target;
}

calibrate_views touch_up_views(const touch_up_marks &marks,
                               const std::vector<calibrate_shot> &shots) {
    calibrate_views views;
    views.seen.target.columns = 2;
    views.seen.target.rows = 1;
    views.seen.target.square_mm = marks.length_mm;
    views.seen.captures.resize(shots.size());
    for (calib::capture &capture : views.seen.captures) {
        for (size_t i = 0; i < 4 && marks.length_mm > 0; i++) {
            const touch_up_marks::place &at = marks.mark[i % 2];
            capture.view[i / 2].corners.push_back(
                {int(i % 2), at[i / 2 * 2], at[i / 2 * 2 + 1], picked_sigma_px});
        }
    }
    return views;
}

bool calibrate_touch_up(const std::string &zoom_path, const std::vector<calibrate_shot> &shots,
                        const calibrate_views &views, const touch_up_marks &marks, bool corrects,
                        std::vector<touch_up_look> *looks, std::vector<std::string> *notes,
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
        const bool sized = !capture.view[0].corners.empty() && !capture.view[1].corners.empty();
        if (shots[i].state == nullptr || !(sized || marks.far)) {
            continue;
        }
        touch_up_look look;
        look.order = {shots[i].session, shots[i].number};
        look.name = name_of(shots[i]);
        if (looker(*zoom, shots[i], views.seen.target, capture, marks, corrects)
                .run(&look, error)) {
            looks->push_back(look);
        } else {
            *error = look.name + ": " + *error;
            notes->push_back(*error);
        }
    }
    if (looks->empty()) {
        notes->clear();  // the error names the last
    }
    std::stable_sort(looks->begin(), looks->end(),
                     [](const auto &a, const auto &b) { return a.order < b.order; });
    return !looks->empty();
}
