// SPDX-License-Identifier: Apache-2.0
/// Moves of a rig, and what a adjustment-calibration says after them, against the truth.
#ifndef VERGENCE_TESTS_ZOOM_TRIAL_HPP
#define VERGENCE_TESTS_ZOOM_TRIAL_HPP

#include <array>
#include <vector>

#include "stereo/zoom/adjustment.h"
#include "tests/study/zoom/study_rig.hpp"

namespace zoom_study {

constexpr double kDepthMm = 1800;

double cpu_s();

struct Memory {
    std::vector<unsigned char> bytes;
    arena pool = {};
    explicit Memory(size_t size) : bytes(size) { arena_init(&pool, bytes.data(), size); }
};

/// Figures of many trials.
class Sample {
  public:
    void add(double value) { values_.push_back(value); }
    size_t count() const { return values_.size(); }
    double rms() const;
    double worst() const { return quantile(1); }
    double quantile(double part) const;  ///< quantile of the absolute values
    double share_within(double limit) const;

  private:
    std::vector<double> values_;
};

/// A state of the rig: where it truly is and what is known of it.
struct Moment {
    world::Camera truth[2];
    zoom_state state;
};

Moment moment_of(StudyRig &rig);
/// Both lenses to a focal length, focused at kDepthMm.
void zoom_both(StudyRig &rig, double focal_mm);
/// Some other move before, a random time of use, and the cameras turned to kDepthMm again.
void move_about(StudyRig &rig, simrig::Noise &noise);

/// Points with 300 mm of relief about kDepthMm that all cameras of the moments see.
std::vector<adjust_track> tracks_of(const std::vector<const Moment *> &moments, int first_state,
                                    double noise_px, int count, simrig::Noise &noise);

struct Result {
    Sample rows_px, depth_mm, z, relief, before_mm, sigma_mm;
    int calibrate = 0, beyond = 0, unsaid = 0, trials = 0, failed = 0;
};

/// What a solved state says, against the truth; `says`: that the rig should be calibrated again.
void judge(const Moment &moment, const adjustment &adjustment, int state, simrig::Noise &noise,
           bool says, Result &result, double scale_sigma = 0);

/// Predicted for the middle of the left picture.
double depth_sigma_mm(const adjustment &adjustment, int state);

/// A board of 24 mm squares at kDepthMm as both cameras see it; its true squares are larger by
/// `scale`.
struct BoardSeen {
    std::vector<std::array<double, 3>> points;
    std::vector<target_observation> observations;
};
BoardSeen board_of(const Moment &moment, double scale, double noise_px, simrig::Noise &noise);

adjustment begin(const zoom_calibration &calibration, const std::vector<zoom_state> &states,
                 Memory &memory);

}  // namespace zoom_study

#endif
