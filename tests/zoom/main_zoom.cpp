// SPDX-License-Identifier: Apache-2.0
// Calibration and self-calibration of a zoom rig on the simulated rig's cameras and motors, against
// the truth: run by tools/campaign zoom.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <functional>
#include <stdexcept>

#include "calib/zoom/zoom_solve.hpp"
#include "stereo/geometry/geometry.h"
#include "stereo/zoom/refine_pair.h"
#include "stereo/zoom/self_calibration.h"
#include "stereo/zoom/zoom_sigma.h"
#include "tests/zoom/study_rig.hpp"

namespace {

using zoom_study::StudyRig;

constexpr double kDepthMm = 1800, kMatchPx = 0.25;

struct Options {
    std::vector<std::string> rigs = {"default", "harsh"};
    int runs = 100, captures = 5;
    uint64_t seed = 20261126;
};

double cpu_s() {
    return double(std::clock()) / CLOCKS_PER_SEC;
}

struct Memory {
    std::vector<unsigned char> bytes;
    arena pool = {};
    explicit Memory(size_t size) : bytes(size) { arena_init(&pool, bytes.data(), size); }
};

// Figures of many trials.
class Sample {
  public:
    void add(double value) { values_.push_back(value); }
    double rms() const {
        double sum = 0;
        for (const double value : values_) {
            sum += value * value;
        }
        return values_.empty() ? 0 : std::sqrt(sum / double(values_.size()));
    }
    double worst() const { return quantile(1); }
    double quantile(double part) const {
        if (values_.empty()) {
            return 0;
        }
        std::vector<double> sizes;
        for (const double value : values_) {
            sizes.push_back(std::fabs(value));
        }
        std::sort(sizes.begin(), sizes.end());
        return sizes[std::min(sizes.size() - 1, size_t(part * double(sizes.size())))];
    }
    double share_within(double limit) const {
        const auto count = std::count_if(values_.begin(), values_.end(),
                                         [=](double value) { return std::fabs(value) <= limit; });
        return values_.empty() ? 0 : double(count) / double(values_.size());
    }

  private:
    std::vector<double> values_;
};

// One move of the rig: where it truly is and what is known of it.
struct Moment {
    world::Camera truth[2];
    zoom_state state;
};

Moment moment_of(StudyRig &rig) {
    Moment moment;
    moment.state = rig.read();
    for (int side = 0; side < 2; side++) {
        moment.truth[side] = rig.camera(side);
    }
    return moment;
}

void zoom_both(StudyRig &rig, double focal_mm) {
    for (int side = 0; side < 2; side++) {
        const world::RigCamera &camera = rig.world().camera[side];
        const double counts = zoom_study::zoom_of_focal(camera, focal_mm);
        rig.set_lens(side, counts,
                     std::round(world::focus_position_for(camera.lens, counts, kDepthMm)));
    }
}

// Some other move before, a random time of use, and the cameras turned to 1.8 m again.
void move_about(StudyRig &rig, simrig::Noise &noise) {
    const auto uniform = [&noise](double low, double high) {
        return low + (high - low) * noise.uniform();
    };
    rig.wait(uniform(0, 6 * 3600));
    rig.turn(uniform(-0.15, 0.25), uniform(-0.25, 0.15));
    for (int side = 0; side < 2; side++) {
        rig.set_lens(side, uniform(310, 840), uniform(400, 800));
    }
    rig.turn(zoom_study::toe_in_rad(0, kDepthMm), zoom_study::toe_in_rad(1, kDepthMm));
}

bool sees(const world::Camera &camera, const world::Vec3 &point, double noise_px,
          simrig::Noise &noise, double px[2]) {
    if ((world::inverse(camera.world_camera) * point).z < 100) {
        return false;
    }
    const world::Vec2 at = camera.project_world(point);
    px[0] = at.x + noise_px * noise.gauss();
    px[1] = at.y + noise_px * noise.gauss();
    return at.x > 4 && at.y > 4 && at.x < 2043 && at.y < 1531;
}

// Points with 300 mm of relief about 1.8 m that all cameras of the moments see.
std::vector<self_track> tracks_of(const std::vector<const Moment *> &moments, int first_state,
                                  double noise_px, int count, simrig::Noise &noise) {
    std::vector<self_track> tracks;
    const world::Camera &narrow = moments.back()->truth[0];
    for (int attempt = 0; attempt < 100 * count && int(tracks.size()) < count; attempt++) {
        const double z = kDepthMm - 150 + 300 * noise.uniform();
        const world::Vec2 slopes =
            narrow.slopes_of({2047 * noise.uniform(), 1535 * noise.uniform()});
        const world::Vec3 point = narrow.world_camera * world::Vec3{slopes.x * z, slopes.y * z, z};
        self_track track = {};
        bool seen = true;
        for (size_t i = 0; i < moments.size(); i++) {
            for (int side = 0; side < 2; side++) {
                track.view[track.count] = self_view(first_state + int(i), side);
                seen = sees(moments[i]->truth[side], point, noise_px, noise,
                            track.pixel_px[track.count++]) &&
                       seen;
            }
        }
        if (seen) {
            tracks.push_back(track);
        }
    }
    return tracks;
}

// Depth along the left camera's axis at which two views see a true point; its error.
double depth_error(const Moment &moment, const camera_view view[2], double column, double row,
                   double depth_mm) {
    const world::Camera &left = moment.truth[0];
    const world::Vec2 slopes = left.slopes_of({column, row});
    const world::Vec3 point =
        left.world_camera * world::Vec3{slopes.x * depth_mm, slopes.y * depth_mm, depth_mm};
    double ray[2][3], offset[3], seen[3];
    for (int side = 0; side < 2; side++) {
        const world::Vec2 at = moment.truth[side].project_world(point);
        const double px[2] = {at.x, at.y};
        if (!camera_view_ray(&view[side], px, ray[side])) {
            throw std::runtime_error("a view has no ray");
        }
    }
    geometry_midpoint middle;
    if (!geometry_rays_midpoint(view[0].position_mm, ray[0], view[1].position_mm, ray[1],
                                &middle)) {
        throw std::runtime_error("rays do not meet");
    }
    for (int i = 0; i < 3; i++) {
        offset[i] = middle.point_mm[i] - view[0].position_mm[i];
    }
    geometry_rotate_back(view[0].R_instrument_camera, offset, seen);
    return seen[2] - depth_mm;
}

struct Result {
    Sample rows_px, depth_mm, z, relief, before_mm, sigma_mm;
    int calibrate = 0, beyond = 0, unsaid = 0, trials = 0;
};

// What a solved state says, against the truth. `observed`: noise-free points of this state.
void judge(const Moment &moment, self_calibration &self, int state,
           std::vector<self_track> observed, bool says_calibrate, Result &result) {
    Sample rows;
    for (self_track &track : observed) {
        double residual_px = 0, derivative[2 * VIEW_TERMS];
        if (self_track_epipolar(&self, &track, &residual_px, derivative)) {
            rows.add(residual_px);
        }
    }
    result.rows_px.add(rows.quantile(0.5));
    const camera_view *view = &self.view[self_view(state, 0)];
    const double centre[2] = {1023.5, 767.5};
    double gradient[SELF_TERMS_MAX];
    if (!self_depth_gradient(&self, state, centre, kDepthMm, gradient)) {
        throw std::runtime_error("no gradient of depth");
    }
    const double sigma_mm = self_posterior_sigma(&self, gradient);
    const double error_mm = depth_error(moment, view, centre[0], centre[1], kDepthMm);
    result.depth_mm.add(error_mm);
    result.sigma_mm.add(sigma_mm);
    result.z.add(error_mm / sigma_mm);
    result.before_mm.add(
        depth_error(moment, &self.nominal[self_view(state, 0)], centre[0], centre[1], kDepthMm));
    // Of a body of 100 mm: how much of its relief is wrong.
    result.relief.add((depth_error(moment, view, 1023.5, 767.5, kDepthMm + 50) -
                       depth_error(moment, view, 1023.5, 767.5, kDepthMm - 50)) /
                      100);
    result.trials++;
    result.calibrate += says_calibrate;
    const bool beyond = std::fabs(error_mm) > 4 * sigma_mm;
    result.beyond += beyond;
    result.unsaid += beyond && !says_calibrate;
}

// The largest correction that pictures showed, in sigmas of the prior: refine_pair's alarm.
bool is_surprised(const self_calibration &self) {
    for (int term = 0; term < self.terms; term++) {
        double unit[SELF_TERMS_MAX] = {};
        unit[term] = 1;
        const double prior = self_prior_sigma(&self, unit);
        const double posterior = self_posterior_sigma(&self, unit);
        const double shown = std::sqrt(std::max(prior * prior - posterior * posterior, 0.0));
        if (shown > 0.1 * prior && std::fabs(self.correction[term]) > 4 * shown) {
            return true;
        }
    }
    return false;
}

self_calibration begin(const zoom_calibration &calibration, const std::vector<zoom_state> &states,
                       Memory &memory) {
    self_calibration self;
    if (self_calibration_begin(&calibration, states.data(), int(states.size()), &memory.pool,
                               &self) != 0) {
        throw std::runtime_error("no memory");
    }
    return self;
}

// Row 4: one pair.
void try_pair(const zoom_calibration &calibration, const Moment &moment, simrig::Noise &noise,
              Result &result) {
    Memory memory(self_calibration_need_bytes(1));
    self_calibration self = begin(calibration, {moment.state}, memory);
    std::vector<self_track> tracks = tracks_of({&moment}, 0, kMatchPx, 300, noise);
    (void)self_calibration_solve(&self, tracks.data(), int(tracks.size()), kMatchPx);
    judge(moment, self, 0, tracks_of({&moment}, 0, 0, 200, noise), is_surprised(self), result);
}

// Row 5: the pair before and after zooming, pan untouched.
void try_bracket(const zoom_calibration &calibration, const Moment &wide, const Moment &narrow,
                 simrig::Noise &noise, Result &at_wide, Result &at_narrow) {
    Memory memory(self_calibration_need_bytes(2));
    self_calibration self = begin(calibration, {wide.state, narrow.state}, memory);
    std::vector<self_track> tracks = tracks_of({&wide, &narrow}, 0, kMatchPx, 100, noise);
    for (const self_track &track : tracks_of({&wide}, 0, kMatchPx, 300, noise)) {
        tracks.push_back(track);
    }
    for (const self_track &track : tracks_of({&narrow}, 1, kMatchPx, 200, noise)) {
        tracks.push_back(track);
    }
    (void)self_calibration_solve(&self, tracks.data(), int(tracks.size()), kMatchPx);
    const bool surprised = is_surprised(self);
    judge(wide, self, 0, tracks_of({&wide}, 0, 0, 200, noise), surprised, at_wide);
    judge(narrow, self, 1, tracks_of({&narrow}, 1, 0, 200, noise), surprised, at_narrow);
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

struct Focal {
    const char *name;
    double mm;
};
constexpr Focal kFocals[] = {{"1x", 8.75}, {"3x", 25.5}, {"10x", 82}};
constexpr int kPlaces = 3;

void focal_logs(const zoom_pair *pair, void *context, double *values) {
    (void)context;
    for (int side = 0; side < 2; side++) {
        values[side] = std::log(pair->side[side].lens.fx_px);
    }
}

// All figures of one rig.
struct Figures {
    Sample exact[kPlaces], read[kPlaces], exact_z[kPlaces];  // relative errors of f
    Result pair[kPlaces], wide, narrow;
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
            zoom_both(rig, kFocals[i].mm * (1 + 0.03 * (noise.uniform() - 0.5)));
            const Moment moment = moment_of(rig);
            zoom_state at = moment.state;
            for (int side = 0; side < 2; side++) {
                const world::Mechanics m = rig.mechanics(side);
                // What the potentiometers read at rest: the ring lags by half of the play.
                at.side[side].zoom_counts = m.zoom - 2;
                at.side[side].focus_counts = m.focus - 2;
            }
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
            zoom_both(rig, kFocals[i].mm);
            at[i] = moment_of(rig);
            try_pair(calibration, at[i], noise, figures.pair[i]);
        }
        try_bracket(calibration, at[0], at[2], noise, figures.wide, figures.narrow);
    }
}

// One capture, its solution, and moves with it.
void study(const std::string &name, uint64_t seed, int runs, Figures &figures) {
    const double begin_s = cpu_s();
    StudyRig rig(name, seed, 0);
    const calib::zoom_observations seen = zoom_study::capture(rig, {}, seed + 1);
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
}

void print(const std::string &name, const Figures &figures) {
    std::printf("\n### %s rig: %d captures, %d not accepted\n\n", name.c_str(), figures.captures,
                figures.alarms);
    std::printf(
        "| unseen zooms, unrefined | f, exact positions | its error over predicted sigma | "
        "f, 16 readings: rms, worst |\n|---|---|---|---|\n");
    for (int i = 0; i < kPlaces; i++) {
        std::printf("| %s | %.3f %% | %.2f | %.3f, %.3f %% |\n", kFocals[i].name,
                    100 * figures.exact[i].rms(), figures.exact_z[i].rms(),
                    100 * figures.read[i].rms(), 100 * figures.read[i].worst());
    }
    std::printf(
        "\n| self-calibration | rows, median | depth at 1.8 m, rms | relief, rms | error "
        "over predicted sigma | beyond 4 sigma |\n|---|---|---|---|---|---|\n");
    for (int i = 0; i < kPlaces; i++) {
        print((std::string("pair, ") + kFocals[i].name).c_str(), figures.pair[i]);
    }
    print("bracket 1x and 10x, at 1x", figures.wide);
    print("bracket 1x and 10x, at 10x", figures.narrow);
    std::fflush(stdout);
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
        } else if (name == "--seed") {
            options.seed = std::strtoull(arguments[i + 1], nullptr, 10);
        } else {
            std::fprintf(stderr, "zoom_campaign: unknown option %s\n", arguments[i]);
            return 2;
        }
    }
    try {
        for (const std::string &rig : options.rigs) {
            Figures figures;
            for (int i = 0; i < options.captures; i++) {
                study(rig, options.seed + 100000 * uint64_t(i), options.runs / options.captures,
                      figures);
            }
            print(rig, figures);
        }
    } catch (const std::exception &error) {
        std::fprintf(stderr, "zoom_campaign: %s\n", error.what());
        return 1;
    }
    return 0;
}
