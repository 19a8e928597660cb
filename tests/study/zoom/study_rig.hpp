// SPDX-License-Identifier: Apache-2.0
/// The simulated rig's cameras, servos and lens motors in one process, in a time of their own,
/// without bridge, frames of a sensor and daemon: what a campaign of many captures and moves can
/// afford. Motors and servos are moved as the firmware moves them, always from the same side.
#ifndef VERGENCE_TESTS_ZOOM_STUDY_RIG_HPP
#define VERGENCE_TESTS_ZOOM_STUDY_RIG_HPP

#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "calib/zoom/zoom_data.hpp"
#include "stereo/zoom/zoom_calibration.h"
#include "tools/simrig/devices/noise.hpp"
#include "tools/simrig/rig/rig.hpp"
#include "tools/simrig/world/camera.hpp"

namespace zoom_study {

constexpr double kToeInMm = 1800, kBaselineMm = 250;

class StudyRig {
  public:
    /// `name` of a file in rigs/, or its path. Each potentiometer reads too much by a random drift
    /// with this sigma, which is constant for this rig's life; 0: as its file says.
    StudyRig(const std::string &name, uint64_t seed, double drift_sigma_counts);

    const world::Rig &world() const { return world_; }
    void wait(double seconds) { time_us_ += seconds * 1e6; }
    /// Commands angles from nominal ahead; returns when the servos have stopped.
    void turn(double left_rad, double right_rad);
    /// Commands zoom and focus of a side; returns when the lens has stopped.
    void set_lens(int side, double zoom, double focus);
    /// Means of 16 readings, and the commanded pans.
    zoom_state read();
    world::Camera camera(int side);
    world::Mechanics mechanics(int side);
    /// What the potentiometers would read on average: the rings lag by half of the play.
    zoom_state exact();

  private:
    simrig::LensMotor &motor(int side, int axis) { return motors_[size_t(side)][size_t(axis)]; }
    double mean_of_readings(int side, int axis);

    world::Rig world_;
    simrig::RigSettings settings_;
    std::vector<simrig::Servo> servos_;
    std::array<std::vector<simrig::LensMotor>, 2> motors_;
    std::array<double, 2> pan_rad_{};
    double time_us_ = 0;
};

/// The commanded pan of a side that looks at a point this far ahead of the rig's middle.
double toe_in_rad(int side, double distance_mm);
/// The zoom position at which this lens has a focal length, by its smooth law.
double zoom_of_focal(const world::RigCamera &camera, double focal_mm);

struct CapturePlan {
    int zooms = 13, positions = 12, visits = 4;
    // Of corners as the detector finds them: calib/RESULTS.md has 0.003 to 0.024 px.
    double noise_px = 0.03;
    bool is_exact = false;  // the lenses' positions are known
    /// What is found instead of the corners that are expected; empty: those.
    std::function<std::vector<calib::corner>(const calib::board &board,
                                             const world::Pose &world_board, int side,
                                             const std::vector<calib::corner> &expected)>
        detect;
};

/// Without pairs: the board and the cameras' frames.
calib::zoom_observations empty_observations();

/// A capture as the guide makes it: at each position of the board all zooms that see enough of it,
/// in both cameras, focused on it; other pans at each visit.
calib::zoom_observations capture(StudyRig &rig, const CapturePlan &plan, uint64_t seed);

}  // namespace zoom_study

#endif
