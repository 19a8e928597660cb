// SPDX-License-Identifier: Apache-2.0
// Calibration and adjustment-calibration of a zoom rig on the simulated rig's cameras and motors,
// against the truth: run by tools/campaign zoom.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <stdexcept>

#include "calib/zoom/zoom_solve.hpp"
#include "stereo/zoom/zoom_sigma.h"
#include "tests/study/zoom/rendered.hpp"
#include "tests/study/zoom/rendered_board.hpp"
#include "tests/study/zoom/trial.hpp"

namespace {

using namespace zoom_study;

// A zoom, and number and noise of matches as rendered pairs of a rig show them there.
struct Focal {
    const char *name;
    double mm;
    int matches;
    double match_px;
};
constexpr int kPlaces = 3;
constexpr Focal kDefault[kPlaces] = {
    {"1x", 8.75, 600, 0.075}, {"3x", 25.5, 450, 0.05}, {"10x", 82, 400, 0.047}};
constexpr Focal kHarsh[kPlaces] = {
    {"1x", 8.75, 40, 0.08}, {"3x", 25.5, 240, 0.1}, {"10x", 82, 150, 0.12}};
constexpr double kFarMatchPx = 0.12;  // matching error between pictures at both ends of the zoom

struct Options {
    std::vector<std::string> rigs = {"default", "harsh"};
    int runs = 100, rendered = 0;
    int captures = 0;  // 0: a fifth of the moves, as a calibration's error is in all of its moves
    uint64_t seed = 20261126;
    std::string render, corners;  // files
    int check = -1;
};

std::vector<adjust_track> matches_of(const Moment &moment, int state, const Focal &focal,
                                     simrig::Noise &noise) {
    return tracks_of({&moment}, state, focal.match_px, focal.matches, noise);
}

// What the same matches would leave unknown if all were as the calibration expects.
double sigma_mm(const zoom_calibration &calibration, const Moment &moment,
                std::vector<adjust_track> tracks) {
    Memory memory(adjustment_need_bytes(1));
    adjustment adjustment = begin(calibration, {moment.state}, memory);
    for (adjust_track &track : tracks) {
        track.rejected = !adjustment_track_place(&adjustment, &track);
        for (int i = 0; i < track.count; i++) {
            (void)camera_view_project(&adjustment.view[track.view[i]], &track.point,
                                      track.pixel_px[i], nullptr, nullptr);
        }
    }
    (void)adjustment_solve(&adjustment, tracks.data(), int(tracks.size()));
    return depth_sigma_mm(adjustment, 0);
}

// What limits a pair: the sigma that it leaves, then with an exact calibration, then also with
// lenses that do not drift.
struct Limits {
    Sample all, exact, still;
};

void find_limits(const zoom_calibration &calibration, const Moment &moment,
                 const std::vector<adjust_track> &tracks, Limits &limits) {
    auto ideal = std::make_unique<zoom_calibration>(calibration);
    limits.all.add(sigma_mm(*ideal, moment, tracks));
    ideal->parameters = 0;
    for (zoom_camera &camera : ideal->camera) {
        for (zoom_function &function : camera.function) {
            function.irregularity = 0;
        }
    }
    limits.exact.add(sigma_mm(*ideal, moment, tracks));
    for (zoom_camera &camera : ideal->camera) {
        camera.drift_sigma_counts = 0;
    }
    limits.still.add(sigma_mm(*ideal, moment, tracks));
}

// Row 4: one pair.
void try_pair(const zoom_calibration &calibration, const Moment &moment, const Focal &focal,
              simrig::Noise &noise, Result &result, Limits &limits) {
    Memory memory(adjustment_need_bytes(1));
    adjustment adjustment = begin(calibration, {moment.state}, memory);
    std::vector<adjust_track> tracks = matches_of(moment, 0, focal, noise);
    find_limits(calibration, moment, tracks, limits);
    (void)adjustment_solve(&adjustment, tracks.data(), int(tracks.size()));
    judge(moment, adjustment, 0, noise, adjust_chi_square_score(&adjustment) > 4, result);
}

// Row 6: the pair with a board in view, whose print is off.
void try_board(const zoom_calibration &calibration, const Moment &moment, const Focal &focal,
               simrig::Noise &noise, Result &result) {
    constexpr double kCornerPx = 0.05, kPrint = 2e-4;
    Memory memory(adjustment_need_bytes(1));
    adjustment adjustment = begin(calibration, {moment.state}, memory);
    std::vector<adjust_track> tracks = matches_of(moment, 0, focal, noise);
    (void)adjustment_solve(&adjustment, tracks.data(), int(tracks.size()));
    const BoardSeen board = board_of(moment, 1 + kPrint * noise.gauss(), kCornerPx, noise);
    adjust_target target = {};
    target.points = int(board.points.size());
    target.observations = int(board.observations.size());
    target.point_mm = reinterpret_cast<const double(*)[3]>(board.points.data());
    target.observation = board.observations.data();
    target.sigma_px = kCornerPx;
    if (!adjust_target_place(adjustment.view, &target)) {
        result.failed++;
        return;
    }
    adjustment.target = &target;
    (void)adjustment_solve(&adjustment, tracks.data(), int(tracks.size()));
    judge(moment, adjustment, 0, noise, adjust_chi_square_score(&adjustment) > 4, result, kPrint);
}

// Row 5: the pair before and after zooming, pan untouched.
void try_wide_pair(const zoom_calibration &calibration, const Moment &wide, const Moment &narrow,
                   const Focal focals[kPlaces], simrig::Noise &noise, Result &at_wide,
                   Result &at_narrow) {
    Memory memory(adjustment_need_bytes(2));
    adjustment adjustment = begin(calibration, {wide.state, narrow.state}, memory);
    std::vector<adjust_track> tracks = tracks_of({&wide, &narrow}, 0, kFarMatchPx, 100, noise);
    for (const adjust_track &track : matches_of(wide, 0, focals[0], noise)) {
        tracks.push_back(track);
    }
    for (const adjust_track &track : matches_of(narrow, 1, focals[2], noise)) {
        tracks.push_back(track);
    }
    (void)adjustment_solve(&adjustment, tracks.data(), int(tracks.size()));
    const bool surprised = adjust_chi_square_score(&adjustment) > 4;
    judge(wide, adjustment, 0, noise, surprised, at_wide);
    judge(narrow, adjustment, 1, noise, surprised, at_narrow);
}

void print(const char *what, const Result &r) {
    std::printf(
        "| %s | %.3f px, %.1f %% within 0.3 | %.1f mm (unrefined %.1f) | %.2f %% | %.2f, worst "
        "%.1f "
        "| %d of %d, %d unsaid |\n",
        what, r.rows_px.quantile(0.5), 100 * r.rows_px.share_within(0.3), r.depth_mm.rms(),
        r.before_mm.rms(), 100 * r.relief.rms(), r.z.rms(), r.z.worst(), r.beyond, r.trials,
        r.unsaid);
}

void focal_logs(const zoom_pair *pair, void *context, double *values) {
    (void)context;
    for (int side = 0; side < 2; side++) {
        values[side] = std::log(pair->side[side].lens.fx_px);
    }
}

// All figures of one rig.
struct Figures {
    const Focal *focals = kDefault;
    Sample exact[kPlaces], read[kPlaces], exact_z[kPlaces];  // relative errors of f
    Result pair[kPlaces], board[kPlaces], wide, narrow;
    Limits limits[kPlaces];
    Rendered frames[kPlaces];
    RenderedWidePair wide_pair;
    int captures = 0, alarms = 0, failed = 0;
};

// Row 3: unseen zooms, unrefined; and the same with exact positions, where only the calibration
// errs.
void try_zooms(const std::string &name, const zoom_calibration &calibration, uint64_t seed,
               int runs, Figures &figures) {
    StudyRig rig(name, seed, 0);
    simrig::Noise noise(seed + 77);
    for (int i = 0; i < kPlaces; i++) {
        for (int run = 0; run < runs; run++) {
            zoom_both(rig, figures.focals[i].mm * (1 + 0.03 * (noise.uniform() - 0.5)));
            const Moment moment = moment_of(rig);
            const zoom_state at = rig.exact();
            zoom_variance variance[2];
            zoom_propagate(&calibration, &moment.state, focal_logs, nullptr, 2, variance);
            zoom_pair read, known;
            zoom_pair_at(calibration.camera, &moment.state, &read);
            zoom_pair_at(calibration.camera, &at, &known);
            for (int side = 0; side < 2; side++) {
                const double truth = moment.truth[side].optics.focal_px;
                const double error = known.side[side].lens.fx_px / truth - 1;
                figures.read[i].add(read.side[side].lens.fx_px / truth - 1);
                figures.exact[i].add(error);
                figures.exact_z[i].add(error / std::sqrt(variance[side].lens));
            }
        }
    }
}

void try_moves(const std::string &name, const zoom_calibration &calibration, uint64_t seed,
               int runs, Figures &figures) {
    for (int run = 0; run < runs; run++) {
        StudyRig rig(name, seed + uint64_t(run), 1);
        simrig::Noise noise(seed + 900000 + uint64_t(run));
        Moment at[kPlaces];
        move_about(rig, noise);
        for (int i = 0; i < kPlaces; i++) {
            zoom_both(rig, figures.focals[i].mm);
            at[i] = moment_of(rig);
            try_pair(calibration, at[i], figures.focals[i], noise, figures.pair[i],
                     figures.limits[i]);
            try_board(calibration, at[i], figures.focals[i], noise, figures.board[i]);
        }
        try_wide_pair(calibration, at[0], at[2], figures.focals, noise, figures.wide,
                      figures.narrow);
    }
}

// One capture, its solution, and moves with it.
void study(const std::string &name, uint64_t seed, int runs, int rendered, Figures &figures) {
    const double begin_s = cpu_s();
    StudyRig rig(name, seed, 0);
    const calib::zoom_observations seen = capture(rig, {}, seed + 1);
    const calib::zoom_solution solution = calib::solve_zoom(seen, {});
    figures.captures++;
    // Residuals that the model does not explain: the solution is refused, and says so.
    const bool alarm = !solution.failure.empty() || solution.noise_ratio > 1.2;
    figures.alarms += alarm;
    std::fprintf(stderr, "seed %llu: %zu pairs, %.1f CPU s, residuals / sigma %.3f%s%s\n",
                 static_cast<unsigned long long>(seed), seen.captures.size(), cpu_s() - begin_s,
                 solution.noise_ratio, alarm ? ", not accepted " : "", solution.failure.c_str());
    if (!solution.failure.empty()) {
        figures.failed++;
        return;
    }
    zoom_calibration calibration = *solution.rig;
    for (zoom_camera &camera : calibration.camera) {
        if (camera.drift_sigma_counts == 0) {
            camera.drift_sigma_counts = 1;
        }
    }
    if (alarm) {
        return;
    }
    try_zooms(name, calibration, seed + 5, runs, figures);
    try_moves(name, calibration, seed + 1000, runs, figures);
    for (int run = 0; run < rendered; run++) {
        StudyRig used(name, seed + 5000 + uint64_t(run), 1);
        simrig::Noise noise(seed + 5000 + uint64_t(run));
        move_about(used, noise);
        RenderedPair pair[kPlaces];
        for (int i = 0; i < kPlaces; i++) {
            zoom_both(used, figures.focals[i].mm);
            pair[i] = render_pair(used, noise);
            try_rendered(calibration, pair[i], noise, figures.frames[i]);
        }
        try_rendered_wide_pair(calibration, pair[0], pair[2], noise, figures.wide_pair);
    }
}

void print(const std::string &name, const Figures &figures) {
    std::printf("\n## %s rig: %d captures, %d not accepted\n\n", name.c_str(), figures.captures,
                figures.alarms);
    std::printf(
        "| unseen zooms, unrefined | f, exact positions | its error over predicted sigma | "
        "f, 16 readings: rms, worst |\n|---|---|---|---|\n");
    for (int i = 0; i < kPlaces; i++) {
        std::printf("| %s | %.3f %% | %.2f | %.3f, %.3f %% |\n", figures.focals[i].name,
                    100 * figures.exact[i].rms(), figures.exact_z[i].rms(),
                    100 * figures.read[i].rms(), 100 * figures.read[i].worst());
    }
    std::printf(
        "\n| adjustment-calibration | rows, median | depth at 1.8 m, rms | relief, rms | error "
        "over predicted sigma | beyond 4 sigma |\n|---|---|---|---|---|---|\n");
    for (int i = 0; i < kPlaces; i++) {
        print((std::string("pair, ") + figures.focals[i].name).c_str(), figures.pair[i]);
    }
    print("pairs at 1x and 10x, at 1x", figures.wide);
    print("pairs at 1x and 10x, at 10x", figures.narrow);
    for (int i = 0; i < kPlaces; i++) {
        print((std::string("board in view, ") + figures.focals[i].name).c_str(), figures.board[i]);
    }
    std::printf(
        "\n| what limits a pair: predicted sigma of depth | | with an exact calibration | and "
        "lenses that do not drift |\n|---|---|---|---|\n");
    for (int i = 0; i < kPlaces; i++) {
        const Limits &limits = figures.limits[i];
        std::printf("| %s, %d matches to %.3f px | %.1f mm | %.1f mm | %.1f mm |\n",
                    figures.focals[i].name, figures.focals[i].matches, figures.focals[i].match_px,
                    limits.all.rms(), limits.exact.rms(), limits.still.rms());
    }
    if (figures.frames[0].frames.trials > 0) {
        std::printf(
            "\n| rendered pairs, cylinder | matches, used | matched to | refined in, with matching "
            "| rows, "
            "median | depth at 1.8 m, rms | relief, rms | error over predicted sigma | "
            "beyond 4 sigma |\n|---|---|---|---|---|---|---|---|---|\n");
    }
    for (int i = 0; i < kPlaces && figures.frames[0].frames.trials > 0; i++) {
        const Rendered &r = figures.frames[i];
        char what[120];
        std::snprintf(what, sizeof what, "%s | %.0f, %.0f | %.3f px | %.0f, %.0f ms",
                      figures.focals[i].name, r.matches.quantile(0.5), r.used.quantile(0.5),
                      r.noise_px.quantile(0.5), 1000 * r.refining_seconds.quantile(0.5),
                      1000 * r.seconds.quantile(0.5));
        print(what, r.frames);
    }
    if (figures.wide_pair.wide.trials > 0) {
        const RenderedWidePair &r = figures.wide_pair;
        char what[120];
        std::snprintf(what, sizeof what, "two pairs, at 1x | %.0f carried | %.3f px | %.0f ms",
                      r.carried.quantile(0.5), r.carried_px.quantile(0.5),
                      1000 * r.seconds.quantile(0.5));
        print(what, r.wide);
        print("two pairs, at 10x | | |", r.narrow);
    }
    std::fflush(stdout);
}

// Row 2: what is solved from corners that the detector found in rendered frames.
void study_rendered(calib::zoom_observations seen, uint64_t seed, int runs) {
    // What the detector predicts is the noise of pixels; the model's own errors come on top.
    constexpr double kModelPx = 0.03;
    size_t corners = 0;
    for (calib::capture &pair : seen.captures) {
        for (calib::board_view &view : pair.view) {
            for (calib::corner &corner : view.corners) {
                corner.sigma_px = std::hypot(corner.sigma_px, kModelPx);
                corners++;
            }
        }
    }
    const calib::zoom_solution solution = calib::solve_zoom(seen, {});
    if (!solution.failure.empty()) {
        throw std::runtime_error(solution.failure);
    }
    Figures figures;
    try_zooms("default", *solution.rig, seed, runs, figures);
    std::printf(
        "\n## Rendered frames, detected corners, exact positions: default rig, %zu pairs\n\n"
        "%zu corners, residuals %.3f px.\n\n"
        "| unseen zooms | f, rms | its error over predicted sigma |\n|---|---|---|\n",
        seen.captures.size(), corners, solution.rms_px);
    for (int i = 0; i < kPlaces; i++) {
        std::printf("| %s | %.3f %% | %.2f |\n", figures.focals[i].name,
                    100 * figures.exact[i].rms(), figures.exact_z[i].rms());
    }
}

// The capture whose corners are kept. `check`: a pair that is rendered again.
constexpr uint64_t kRenderedSeed = 20261130;

int check_corners(const std::string &kept, int pair) {
    const double px = corner_distance(rendered_capture("default", kRenderedSeed, pair),
                                      read_corners(kept), size_t(pair));
    std::printf("pair %d: corners within %.4f px of those that are kept\n", pair, px);
    return px < 0.03 ? 0 : 1;
}

}  // namespace

int main(int count, char **arguments) {
    Options options;
    for (int i = 1; i + 1 < count; i += 2) {
        const std::string name = arguments[i];
        if (name == "--rig") {
            options.rigs = {arguments[i + 1]};
        } else if (name == "--runs") {
            options.runs = std::atoi(arguments[i + 1]);
        } else if (name == "--captures") {
            options.captures = std::max(std::atoi(arguments[i + 1]), 1);
        } else if (name == "--rendered") {
            options.rendered = std::atoi(arguments[i + 1]);
        } else if (name == "--render") {
            options.render = arguments[i + 1];
        } else if (name == "--corners") {
            options.corners = arguments[i + 1];
        } else if (name == "--check") {
            options.check = std::atoi(arguments[i + 1]);
        } else if (name == "--seed") {
            options.seed = std::strtoull(arguments[i + 1], nullptr, 10);
        } else {
            std::fprintf(stderr, "zoom_campaign: unknown option %s\n", arguments[i]);
            return 2;
        }
    }
    if (options.captures == 0) {
        options.captures = std::max(options.runs / 5, 1);
    }
    int failed = 0;
    try {
        if (!options.render.empty()) {
            write_corners(rendered_capture("default", kRenderedSeed, -1), options.render);
            return 0;
        }
        if (options.check >= 0) {
            return check_corners(options.corners, options.check);
        }
        for (const std::string &rig : options.rigs) {
            Figures figures;
            figures.focals = rig == "harsh" ? kHarsh : kDefault;
            for (int i = 0; i < options.captures; i++) {
                study(rig, options.seed + 100000 * uint64_t(i), options.runs / options.captures,
                      (options.rendered + options.captures - 1 - i) / options.captures, figures);
            }
            print(rig, figures);
            // The harsh rig may say `calibrate`; all that the default one has is in the model.
            failed += rig == "default" && figures.alarms > 0;
        }
        if (!options.corners.empty()) {
            study_rendered(read_corners(options.corners), options.seed, options.runs);
        }
    } catch (const std::exception &error) {
        std::fprintf(stderr, "zoom_campaign: %s\n", error.what());
        return 1;
    }
    return failed > 0;
}
