// SPDX-License-Identifier: Apache-2.0
#include "calib/solve/solve_verdict.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

#include "calib/base/sentence.hpp"
#include "calib/solve/solve_fit.hpp"
#include "calib/solve/uncertainty.hpp"
#include "core/error.h"
#include "core/math.h"
#include "stereo/geometry/geometry.h"

namespace calib {

namespace {

const double PARALLEL_RAD =
    5 * MATH_PI / 180;              // normals closer to their mean than this count as parallel
const double FOCAL_SHARE = 0.01;    // largest acceptable sigma of f
const double FOCAL_UNKNOWN = 0.05;  // relative sigma of f from which f counts as not determined
const double COVERAGE = 0.4;        // share of the image's cells with corners
const int FEW_BOARDS = 6, FEW_PAIRS = 4;
// Acceptable systematic residual: this share of the residuals, or this many pixels.
const double SYSTEMATIC_SHARE = 0.4, SYSTEMATIC_PX = 0.2;
// Acceptable corner error beyond the noise of the images.
const double FLOOR_PX = 0.5;
// For large images both limits grow: this share of the diagonal.
const double LARGE_IMAGE = 1.0 / 4000;
// A lens is outside its model if most boards are off in the same way by this, or in large images by
// this share of the diagonal, and with this many times the variance of what boards have of their
// own.
const double LENS_PX = 0.1, LENS_SHARE = 1e-4, LENS_RATIO = 8;
const double SCATTER_RATIO = 25;     // ratio of variances between board positions
const double BASELINE_SHARE = 0.01;  // largest acceptable sigma of the baseline
const double LEAST_BASELINE = 5e-3;  // share of the boards' distance
const double STRETCH_SHARE = 0.005;  // share by which a print's rows and columns may differ
const double OUTER = 0.7;    // ring where lenses bend most: its inner radius over half a diagonal
const int OUTER_FEWEST = 5;  // minimum number of corners rejected there to be significant
const double OUTER_REJECTED = 0.02;  // share of corners there that a fitting lens may lose

struct finding {
    double weight;  // larger is worse
    std::string reason;
};

// Largest angle between a board's normal and the mean normal, in one camera.
double normals_spread_rad(const bundle &data, const bundle_state &state, int camera) {
    double sum[3] = {0, 0, 0};
    std::vector<std::array<double, 3>> normals;
    for (size_t i = 0; i < data.captures.size(); i++) {
        if (data.captures[i][size_t(camera)].used) {
            const double *R = state.T_left_board[i].R;
            normals.push_back({R[2], R[5], R[8]});
            for (size_t axis = 0; axis < 3; axis++) {
                sum[axis] += normals.back()[axis];
            }
        }
    }
    const double length = geometry_norm(sum);
    double max = 0;
    for (const std::array<double, 3> &normal : normals) {
        const double cosine = geometry_dot(normal.data(), sum) / length;
        max = std::max(max, std::acos(std::clamp(cosine, -1.0, 1.0)));
    }
    return max;
}

// Share of a 4 x 3 grid of image cells that contain used corners.
double coverage(const bundle &data, int camera) {
    const int across = 4, down = 3;
    bool seen[across * down] = {};
    const lens_frame &frame = data.frame[camera];
    for (const auto &capture : data.captures) {
        const bundle_view &view = capture[size_t(camera)];
        for (const bundle_corner &corner : view.corners) {
            if (view.used && corner.used) {
                const int x =
                    std::clamp(int((corner.x_px + 0.5) / frame.width_px * across), 0, across - 1);
                const int y =
                    std::clamp(int((corner.y_px + 0.5) / frame.height_px * down), 0, down - 1);
                seen[y * across + x] = true;
            }
        }
    }
    return double(std::count(seen, seen + across * down, true)) / (across * down);
}

void look_at_camera(const bundle &data, const bundle_state &state, const solution &found,
                    int camera, std::vector<finding> *findings) {
    const char *who = camera_name(data, camera);
    int views = 0;
    for (const auto &capture : data.captures) {
        views += capture[size_t(camera)].used;
    }
    const double share = found.errors->lens_sigma(camera, LOG_FOCAL);
    const double spread = normals_spread_rad(data, state, camera);
    if (spread < PARALLEL_RAD) {
        findings->push_back(
            {1000,
             sentence("all boards of the %s are parallel to each other (within %.1f degrees), "
                      "so its focal length cannot be measured: tilt the board by 30 degrees and "
                      "more, in different directions",
                      who, spread * 180 / MATH_PI)});
    } else if (share > FOCAL_UNKNOWN) {
        findings->push_back(
            {900, sentence("the focal length of the %s is not determined (standard "
                           "deviation %.0f %%): tilt the board more, and in different "
                           "directions",
                           who, 100 * share)});
    } else if (share > FOCAL_SHARE) {
        findings->push_back(
            {300 * share / FOCAL_SHARE,
             sentence("the focal length of the %s is known only to %.1f %%", who, 100 * share)});
    }
    if (views < FEW_BOARDS) {
        findings->push_back({500 + 10.0 * (FEW_BOARDS - views),
                             sentence("only %d boards in the %s (recommended 15)", views, who)});
    }
    const double covered = coverage(data, camera);
    if (covered < COVERAGE) {
        findings->push_back(
            {200, sentence("the boards cover only %.0f %% of the %s's image", 100 * covered, who)});
    }
    if (lens_validate(&found.camera[camera]) != ERROR_OK) {
        findings->push_back({800, sentence("the lens estimated for the %s is impossible", who)});
    }
}

// The larger of a limit in pixels and a share of the image's diagonal.
double tolerable_px(const bundle &data, double px) {
    return std::max(px, 2 * LARGE_IMAGE * data.frame[LEFT].radius_px);
}

bool does_not_fit(const bundle &data, const fit_test &fit) {
    return fit.alarm && fit.systematic_share > SYSTEMATIC_SHARE &&
           fit.systematic_px > tolerable_px(data, SYSTEMATIC_PX);
}

bool contradict(const fit_test &fit) {
    return fit.scattered && fit.scatter_ratio > SCATTER_RATIO;
}

std::string scatter_of(const fit_test &fit) {
    return sentence(
        "the positions of the board contradict each other %.1f times as much as the noise of "
        "their corners explains: did the board move between left and right pictures, or a camera, "
        "or its focus, between positions? Error bars are widened %.1f times",
        std::sqrt(fit.scatter_ratio), fit.widened);
}

// What helps where a lens does not follow its model.
std::string other_lens(const solution &found) {
    const char *others = "try --model equidistant or rational";
    if (found.model_given) {
        others = "omit --model";
    } else if (found.model.distortion == lens_model::EQUIDISTANT) {
        others = "try --model rational";
    } else if (found.model.distortion == lens_model::RATIONAL) {
        others = "try --model equidistant";
    }
    return sentence("%s, or crop all pictures to the middle, where lenses bend less", others);
}

// Where a lens does not follow its model, nothing else fits either: named before what that causes.
bool look_at_lens(const bundle &data, const bundle_state &state, const solution &found,
                  std::vector<finding> *findings) {
    const double limit_px = std::max(LENS_PX, LENS_SHARE * 2 * data.frame[LEFT].radius_px);
    bool outside = found.wider_than_model;
    if (outside) {
        findings->push_back(
            {1650, sentence("the lenses are wider than their model (%s): %s",
                            lens_model_name(found.model), other_lens(found).c_str())});
    }
    for (int camera = 0; camera < data.cameras; camera++) {
        const lens_test lens = test_lens(data, state, camera);
        if (lens.ratio > LENS_RATIO && lens.off_px > limit_px) {
            outside = true;
            findings->push_back(
                {1600 + std::min(lens.off_px, 10.0),
                 sentence("the lens of the %s does not follow its model (%s): at the same distance "
                          "from its axis most boards are off in the same way, by %.2g px rms: %s",
                          camera_name(data, camera), lens_model_name(found.model), lens.off_px,
                          other_lens(found).c_str())});
        }
    }
    return outside;
}

// Corners of good views that were rejected near the image edges, if there are many, indicate a lens
// outside the model.
void look_at_edges(const bundle &data, const solution &found, std::vector<finding> *findings) {
    int rejected = 0, rejected_outside = 0, outside = 0;
    for (const auto &capture : data.captures) {
        for (int camera = 0; camera < data.cameras; camera++) {
            const lens_frame &frame = data.frame[camera];
            const bundle_view &view = capture[size_t(camera)];
            for (const bundle_corner &corner : view.corners) {
                const double radius_px =
                    std::hypot(corner.x_px - frame.middle_x_px, corner.y_px - frame.middle_y_px);
                const bool outer = view.used && radius_px > OUTER * frame.radius_px;
                outside += outer;
                rejected += view.used && !corner.used;
                rejected_outside += outer && !corner.used;
            }
        }
    }
    if (rejected_outside >= OUTER_FEWEST && rejected_outside > OUTER_REJECTED * outside &&
        2 * rejected_outside > rejected) {
        findings->push_back(
            {650, sentence("%d of %d corners near the edges of the images do not fit: the lens "
                           "bends more there than its model can describe: %s",
                           rejected_outside, outside, other_lens(found).c_str())});
    }
}

void look_at_rig(const bundle &data, const bundle_state &state, const solution &found,
                 std::vector<finding> *findings) {
    if (found.pairs_used < FEW_PAIRS) {
        findings->push_back(
            {450, sentence("only %d boards seen by both cameras", found.pairs_used)});
    }
    calibration named = found.rig;
    std::snprintf(named.id, sizeof named.id, "unnamed");
    if (calibration_validate(&named, nullptr) != ERROR_OK &&
        lens_validate(&found.rig.left) == ERROR_OK && lens_validate(&found.rig.right) == ERROR_OK) {
        findings->push_back({800, "the estimated pose of the right camera is impossible"});
    }
    const double baseline_mm = geometry_norm(found.T_right_left.t_mm);
    // Not where it is known but for the size of the squares.
    const double by_print_mm = 0.5 * print_stretch(data, state) * baseline_mm;
    if (found.sigma.baseline_mm > BASELINE_SHARE * baseline_mm &&
        found.sigma.baseline_mm > 2 * by_print_mm) {
        findings->push_back(
            {700,
             baseline_mm < 3 * found.sigma.baseline_mm ||
                     baseline_mm < LEAST_BASELINE * found.length.distance_mm
                 ? sentence("the cameras are in the same place, to %.2g mm: are these pictures "
                            "of two cameras, and is --square in mm?",
                            std::max(baseline_mm, found.sigma.baseline_mm))
                 : sentence("the baseline of %.3g mm is known only to %.2g mm: the board was in "
                            "too few or too similar positions",
                            baseline_mm, found.sigma.baseline_mm)});
    }
}

std::string pattern_of(const fit_test &fit) {
    return sentence(
        "%.0f %% of the residuals (%.2f px) are a pattern that noise does not explain (z = %.0f "
        "over the image, %.0f over the board); error bars are widened %.1f times",
        100 * fit.systematic_share, fit.systematic_px, fit.image_z, fit.board_z, fit.widened);
}

void look_at_rejections(const bundle &data, std::vector<finding> *findings) {
    size_t views = 0, wrong = 0;
    for (const auto &capture : data.captures) {
        for (const bundle_view &view : capture) {
            views += !view.empty();
            wrong += !view.empty() && !view.used;
        }
    }
    if (4 * wrong > views) {
        findings->push_back({400, sentence("%zu of %zu views were rejected", wrong, views)});
    }
}

void look_at_rest(const bundle &data, const bundle_state &state, const solution &found,
                  std::vector<finding> *findings) {
    if (found.errors->is_singular()) {
        findings->push_back({950, "an estimated parameter is not determined by these views"});
    }
    if (data.cameras == CAMERAS) {
        look_at_rig(data, state, found, findings);
    }
    if (does_not_fit(data, found.fit)) {
        findings->push_back({600, "the model does not fit: " + pattern_of(found.fit)});
    }
    if (contradict(found.fit)) {
        findings->push_back({620, scatter_of(found.fit)});
    }
    if (print_stretch(data, state) > STRETCH_SHARE) {
        findings->push_back({610, stretch_of(data, state, found)});
    }
    if (found.fit.floor_px > tolerable_px(data, FLOOR_PX)) {
        findings->push_back({550, sentence("corners are off by %.2f px beyond the noise of their "
                                           "images: is the board flat, is its print exact, and did "
                                           "nothing move?",
                                           found.fit.floor_px)});
    }
    if (found.second_start.done && !found.second_start.agrees) {
        findings->push_back({850, sentence("another start leads to another solution (%.1f sigma)",
                                           found.second_start.focal_difference_sigma)});
    }
    look_at_rejections(data, findings);
}

// Patterns that the error bars already include.
std::vector<std::string> remarks_on(const bundle &data, const bundle_state &state,
                                    const solution &found) {
    std::vector<std::string> remarks;
    if (found.fit.alarm && !does_not_fit(data, found.fit)) {
        remarks.push_back(pattern_of(found.fit));
    }
    if (found.fit.scattered && !contradict(found.fit)) {
        remarks.push_back(scatter_of(found.fit));
    }
    if (found.target.stretched && print_stretch(data, state) <= STRETCH_SHARE) {
        remarks.push_back(stretch_of(data, state, found));
    }
    if (const std::string pixels = pixels_of(data, found); !pixels.empty()) {
        remarks.push_back(pixels);
    }
    return remarks;
}

std::string sentence_on_good(const bundle &data, const solution &found) {
    const double worst = std::max(
        found.sigma.focal_px[LEFT] / found.camera[LEFT].fx_px,
        data.cameras == CAMERAS ? found.sigma.focal_px[RIGHT] / found.camera[RIGHT].fx_px : 0.0);
    std::string text =
        sentence("Good: %d boards fit to %.2f px", found.captures_used, found.rms_px);
    if (found.held_out_rms_px > 0) {
        text += sentence(" (%.2f px when held out)", found.held_out_rms_px);
    }
    text += sentence(", the focal length is known to %.2g %%", 100 * worst);
    if (data.cameras == CAMERAS) {
        text += sentence(", the baseline of %.2f mm to %.2g mm",
                         calibration_baseline_mm(&found.rig), found.sigma.baseline_mm);
    }
    if (found.length.sigma_mm > 0) {
        text += sentence("; a length of %.0f mm at %.0f mm is known to +- %.2g mm",
                         found.length.length_mm, found.length.distance_mm, found.length.sigma_mm);
    }
    return text + ".";
}

}  // namespace

verdict rejection(const std::string &reason) {
    return {false, false, "Not calibrated: " + reason + ".", {reason}, {}};
}

verdict assess_solution(const bundle &data, const bundle_state &state, const solution &found) {
    std::vector<finding> findings;
    for (int camera = 0; camera < data.cameras; camera++) {
        look_at_camera(data, state, found, camera, &findings);
    }
    look_at_rest(data, state, found, &findings);
    const bool outside = look_at_lens(data, state, found, &findings);
    if (!outside) {
        look_at_edges(data, found, &findings);
    }
    std::stable_sort(findings.begin(), findings.end(),
                     [](const finding &a, const finding &b) { return a.weight > b.weight; });
    verdict result;
    for (const finding &one : findings) {
        result.reasons.push_back(one.reason);
    }
    result.remarks = remarks_on(data, state, found);
    result.good = findings.empty();
    result.lens_outside_model = outside;
    if (!result.good) {
        result.sentence = "Not good: " + result.reasons[0];
        if (result.reasons.size() > 1) {
            result.sentence += sentence("; and %zu more %s", result.reasons.size() - 1,
                                        result.reasons.size() == 2 ? "reason" : "reasons");
        }
        result.sentence += ".";
        return result;
    }
    result.sentence = sentence_on_good(data, found);
    return result;
}

}  // namespace calib
