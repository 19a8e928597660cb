// SPDX-License-Identifier: Apache-2.0
#include "calib/zoom/zoom_check.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include "calib/base/sentence.hpp"
#include "calib/zoom/zoom_expected.hpp"
#include "core/invariant.h"
#include "core/math.h"
#include "stereo/geometry/geometry.h"

namespace calib {

namespace {

const int CELLS_X = 4, CELLS_Y = 3;
// Limits of a pattern: standard score, RMS over corner noise.
const double ALARM_Z = 6, ALARM_SHARE = 0.3;
const double ALARM_NOISE = 2;    // residuals over what the corners' noise explains
const int REFIT_ITERATIONS = 2;  // the equations are nearly linear there
// Of zooms left out: rows as a share of half of the diagonal, f as a share of itself.
const double HELD_OUT_ROWS = 1.0 / 400, HELD_OUT_FOCAL = 0.01;
const double BASELINE_SHARE = 0.05;        // largest acceptable sigma of the baseline
const double BASELINE_DEPTHS = 2;          // the longest baseline, in distances of the boards
const double LARGEST_BASELINE_MM = 10000;  // a longer baseline suggests that --square is not in mm
const double TURNED_RAD = MATH_PI / 3;     // largest rotation between the two cameras
const double PAN_SCALE = 0.2;              // a servo's angle differs from the commanded one
const int ZOOM_SAMPLES = 32;
const char *const side_names[CAMERAS] = {"left", "right"};

// Sums over left-out settings.
struct left_out {
    double focal = 0, epipolar_px = 0;
    int settings = 0, corners = 0;
};

// The ray of a corner in the instrument's frame; false where the pixel has none.
bool ray_of(const zoom_problem &problem, const posed_camera &posed, int camera,
            const bundle_corner &corner, double direction[3]) {
    const lens lens = lens_from_state(problem.side[size_t(camera)].frame, posed.lens);
    const double pixel[2] = {corner.x_px, corner.y_px};
    double ray[3];
    if (!lens_ray(&lens, pixel, ray)) {
        return false;
    }
    geometry_rotate_back(posed.T_camera_instrument.R, ray, direction);
    return true;
}

// How far the rays of corners that both cameras see miss each other, as the right one sees it.
void add_epipolar(const zoom_problem &problem, const zoom_layout &layout,
                  const zoom_estimate &estimate, size_t capture,
                  const std::array<bundle_view, CAMERAS> &views, left_out *sum) {
    const posed_camera posed[CAMERAS] = {fitted_camera(problem, layout, estimate, capture, LEFT),
                                         fitted_camera(problem, layout, estimate, capture, RIGHT)};
    const rigid back[CAMERAS] = {inverse(posed[LEFT].T_camera_instrument),
                                 inverse(posed[RIGHT].T_camera_instrument)};
    std::map<int, const bundle_corner *> left;
    for (const bundle_corner &corner : views[LEFT].corners) {
        if (views[LEFT].used && corner.used) {
            left[corner.index] = &corner;
        }
    }
    for (const bundle_corner &corner : views[RIGHT].corners) {
        const auto other = left.find(corner.index);
        double a[3], b[3];
        geometry_midpoint met;
        if (!views[RIGHT].used || !corner.used || other == left.end() ||
            !ray_of(problem, posed[LEFT], LEFT, *other->second, a) ||
            !ray_of(problem, posed[RIGHT], RIGHT, corner, b) ||
            !geometry_rays_midpoint(back[LEFT].t_mm, a, back[RIGHT].t_mm, b, &met)) {
            continue;
        }
        const double off_px =
            met.miss_mm / (met.t * geometry_norm(b)) * std::exp(posed[RIGHT].lens.value[LOG_FOCAL]);
        sum->epipolar_px += off_px * off_px;
        sum->corners++;
    }
}

void forget_setting(const zoom_layout &layout, int setting, zoom_estimate *estimate) {
    for (int function = 0; function < ZOOM_FUNCTIONS; function++) {
        const int at = layout.effect_at(LEFT, function, setting);
        if (at >= 0) {
            estimate->shared[size_t(at)] = 0;
        }
    }
}

void leave_out(const zoom_solution &solution, int setting, int threads,
               const std::function<void()> &between, left_out *sum) {
    zoom_problem problem = solution.problem;
    zoom_estimate estimate = solution.estimate;
    forget_setting(solution.layout, setting, &estimate);
    std::vector<size_t> captures;
    for (size_t i = 0; i < problem.captures.size(); i++) {
        if (problem.captures[i].setting[LEFT] == setting) {
            captures.push_back(i);
            problem.captures[i].view[LEFT].used = problem.captures[i].view[RIGHT].used = false;
            estimate.latent[i] = {};
        }
    }
    fit_zoom(problem, solution.layout, solution.prior, {0, threads}, REFIT_ITERATIONS, between,
             &estimate);
    for (int camera = 0; camera < CAMERAS && !captures.empty(); camera++) {
        const int own = problem.captures[captures[0]].setting[size_t(camera)];
        const double counts = problem.side[size_t(camera)].settings[size_t(own)];
        const double all = focal_at(problem, solution.layout, solution.estimate.shared.data(),
                                    camera, own, counts);
        const double predicted =
            focal_at(problem, solution.layout, estimate.shared.data(), camera, own, counts);
        sum->focal += (predicted / all - 1) * (predicted / all - 1);
        sum->settings++;
    }
    for (const size_t capture : captures) {
        add_epipolar(problem, solution.layout, estimate, capture,
                     solution.problem.captures[capture].view, sum);
    }
}

// Residuals of one camera at one setting in one part of the image.
struct cell {
    double x = 0, y = 0;  // sums in sigmas
    int count = 0;
};

std::vector<cell> cells_of(const zoom_solution &solution) {
    const zoom_problem &problem = solution.problem;
    std::map<std::array<int, 3>, cell> cells;
    for (size_t i = 0; i < problem.captures.size(); i++) {
        for (int camera = 0; camera < CAMERAS; camera++) {
            const bundle_view &view = problem.captures[i].view[size_t(camera)];
            const lens_frame &frame = problem.side[size_t(camera)].frame;
            const posed_camera posed =
                fitted_camera(problem, solution.layout, solution.estimate, i, camera);
            for (const bundle_corner &corner : view.corners) {
                double r[2];
                if (!view.used || !corner.used ||
                    !zoom_residual(problem, solution.layout, solution.estimate, posed, i, camera,
                                   corner, r)) {
                    continue;
                }
                const int column = int(corner.x_px * CELLS_X / frame.width_px);
                const int row = int(corner.y_px * CELLS_Y / frame.height_px);
                cell &one = cells[{camera, problem.captures[i].setting[size_t(camera)],
                                   row * CELLS_X + column}];
                one.x += r[0] / corner.sigma_px;
                one.y += r[1] / corner.sigma_px;
                one.count++;
            }
        }
    }
    std::vector<cell> result;
    for (const auto &one : cells) {
        result.push_back(one.second);
    }
    return result;
}

double baseline_sigma_mm(const zoom_solution &solution) {
    const double *at_mm = &solution.rig->camera[RIGHT].mount[ZOOM_POSITION_X];
    const double length_mm = geometry_norm(at_mm);
    double variance = 0;
    for (int i = 0; i < 3; i++) {
        for (int k = 0; k < 3; k++) {
            variance +=
                at_mm[i] * at_mm[k] *
                solution.covariance.shared(solution.layout.mount_at(RIGHT, ZOOM_POSITION_X + i),
                                           solution.layout.mount_at(RIGHT, ZOOM_POSITION_X + k));
        }
    }
    return length_mm > 0 ? std::sqrt(std::max(0.0, variance)) / length_mm : INFINITY;
}

void check_baseline(const zoom_solution &solution, std::vector<std::string> *warnings) {
    const double *at_mm = &solution.rig->camera[RIGHT].mount[ZOOM_POSITION_X];
    const double baseline_mm = geometry_norm(at_mm), distance_mm = board_distance_mm(solution);
    const double sigma_mm = baseline_sigma_mm(solution);
    if (at_mm[0] < 0 && -at_mm[0] > std::fabs(at_mm[1])) {
        warnings->push_back(
            sentence("left and right are exchanged: the right camera is %.0f mm to the left of the "
                     "left one; exchange the cameras' cables or their names, and take the pictures "
                     "again",
                     -at_mm[0]));
    }
    if (baseline_mm > BASELINE_DEPTHS * distance_mm) {
        warnings->push_back(
            sentence("the baseline of %.3g mm is impossible, with boards at %.3g mm", baseline_mm,
                     distance_mm));
    } else if (baseline_mm > LARGEST_BASELINE_MM) {
        warnings->push_back(
            sentence("the baseline would be %.3g m: is --square in mm?", baseline_mm / 1000));
    }
    if (!(sigma_mm <= BASELINE_SHARE * baseline_mm)) {
        warnings->push_back(sentence(
            "the baseline of %.3g mm is known only to %.2g mm: the board was in too few or "
            "too similar positions",
            baseline_mm, sigma_mm));
    }
}

void check_poses(const zoom_solution &solution, std::vector<std::string> *warnings) {
    double turned_rad = 0;
    for (size_t i = 0; i < solution.problem.captures.size(); i++) {
        const posed_camera posed[CAMERAS] = {
            fitted_camera(solution.problem, solution.layout, solution.estimate, i, LEFT),
            fitted_camera(solution.problem, solution.layout, solution.estimate, i, RIGHT)};
        turned_rad = std::max(turned_rad, turn_between_rad(posed[LEFT].T_camera_instrument,
                                                           posed[RIGHT].T_camera_instrument));
    }
    if (turned_rad > TURNED_RAD) {
        warnings->push_back(sentence("the cameras would be turned by %.0f degrees from each other",
                                     turned_rad / MATH_RAD_PER_DEGREE));
    }
    for (int camera = 0; camera < CAMERAS; camera++) {
        const double scale = solution.rig->camera[camera].mount[ZOOM_PAN_SCALE];
        if (!(std::fabs(scale) <= PAN_SCALE)) {
            warnings->push_back(sentence(
                "the %s servo would turn by %.2f of the angle that was set: were its cables or "
                "the cameras exchanged?",
                side_names[camera], 1 + scale));
        }
    }
}

// The focal length of a zoom grows or shrinks all the way.
void check_focal(const zoom_solution &solution, std::vector<std::string> *warnings) {
    for (int side = 0; side < CAMERAS; side++) {
        const zoom_camera &camera = solution.rig->camera[side];
        int growing = 0;
        double last = 0;
        for (int i = 0; i <= ZOOM_SAMPLES; i++) {
            const double part = double(i) / ZOOM_SAMPLES;
            const double counts = camera.zoom.min + (camera.zoom.max - camera.zoom.min) * part;
            const double f_px = zoom_function_value(&camera, ZOOM_FOCAL, counts);
            if (i > 0) {
                growing += f_px > last ? 1 : -1;
            }
            last = f_px;
        }
        if (std::abs(growing) < ZOOM_SAMPLES) {
            warnings->push_back(
                sentence("the focal length of the %s camera does not follow the "
                         "zoom: too few zooms, or its positions are wrong",
                         side_names[side]));
        }
    }
}

}  // namespace

void check_left_out(zoom_solution *solution, int threads, const std::function<void()> &between) {
    left_out sum;
    const int settings = solution->layout.settings(LEFT);
    for (int setting = 1; setting + 1 < settings; setting++) {
        leave_out(*solution, setting, threads, between, &sum);
    }
    zoom_validation &out = solution->rig->validation;
    out.held_out_px = sum.corners > 0 ? std::sqrt(sum.epipolar_px / sum.corners) : 0;
    out.held_out_focal = sum.settings > 0 ? std::sqrt(sum.focal / sum.settings) : 0;
    if (out.held_out_px > HELD_OUT_ROWS * solution->problem.side[LEFT].frame.radius_px ||
        out.held_out_focal > HELD_OUT_FOCAL) {
        solution->warnings.push_back(sentence(
            "zooms that were left out are predicted only to %.1f px of rows and %.2f %% of the "
            "focal length: the lenses do not repeat, positions are wrong, or zooms are too few",
            out.held_out_px, 100 * out.held_out_focal));
    }
}

void check_rig(zoom_solution *solution) {
    check_baseline(*solution, &solution->warnings);
    check_poses(*solution, &solution->warnings);
    check_focal(*solution, &solution->warnings);
}

void check_fit(zoom_solution *solution) {
    double squares = 0, excess = 0, corners = 0;
    int freedom = 0;
    const double noise2 = solution->noise_ratio * solution->noise_ratio;
    INVARIANT(noise2 > 0);
    for (const cell &one : cells_of(*solution)) {
        const double chi2 = (one.x * one.x + one.y * one.y) / one.count / noise2;
        squares += chi2;
        freedom += 2;
        excess += chi2 - 2;
        corners += one.count;
    }
    const double z = freedom > 0 ? (squares - freedom) / std::sqrt(2.0 * freedom) : 0;
    const double share = corners > 0 ? std::sqrt(std::fmax(0, excess) / (2 * corners)) : 0;
    solution->rig->validation.chi_square_z = z;
    if (solution->noise_ratio > ALARM_NOISE) {
        solution->warnings.push_back(
            sentence("corners are off by %.1f times what their noise explains: the lenses or the "
                     "servos do not repeat, or the rig moved while the pictures were taken",
                     solution->noise_ratio));
    }
    if (z > ALARM_Z && share > ALARM_SHARE) {
        solution->warnings.push_back(
            sentence("residuals have a pattern of %.1f px over the images that the model does not "
                     "explain",
                     share * solution->rms_px));
    }
}

}  // namespace calib
