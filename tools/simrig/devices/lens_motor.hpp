// SPDX-License-Identifier: Apache-2.0
/// One motor of a motorised lens (zoom, focus or iris) with its position potentiometer, in counts
/// of the controller's 10-bit converter.
#ifndef VERGENCE_SIMRIG_DEVICES_LENS_MOTOR_HPP
#define VERGENCE_SIMRIG_DEVICES_LENS_MOTOR_HPP

#include <cstdint>

#include "tools/simrig/devices/noise.hpp"

namespace simrig {

/// Its parameters; every imperfection can be 0.
struct LensMotorSettings {
    double counts_per_s = 150;
    double start_ms = 20;                    ///< from command to motion
    double backlash_counts = 4;              ///< play between motor and ring
    double min_step_counts = 2;              ///< a shorter move does not start
    double stop_low = 290, stop_high = 860;  ///< mechanical end stops
    double read_noise_counts = 1;            ///< sigma of a read-back
    double outlier_chance = 0.002;           ///< chance of a read-back with a random value
    double settle_error_counts = 0.7;        ///< sigma of the resting position
    double drift_counts_per_h = 0;           ///< of the potentiometer against the ring, when cold
};

/// Drift of the potentiometer at a time after power-up: it slows down as the part warms up, and
/// ends at six hours of the initial drift.
double drift_counts(const LensMotorSettings &settings, double since_us);

class LensMotor {
  public:
    /// begin_us: time of power-up.
    LensMotor(const LensMotorSettings &settings, double position, uint64_t seed,
              double begin_us = 0);

    /// Starts a move; a move in progress is abandoned.
    void go(double time_us, double counts);
    void stop(double time_us);
    /// Position of the optics. Times must not decrease.
    double ring(double time_us);
    bool moving(double time_us);
    /// What the converter reads now, 0 .. 1023.
    int read(double time_us);
    /// Fault: it stops moving, or moves again.
    void jam(double time_us, bool jammed);

  private:
    void advance(double time_us);
    void drag();

    LensMotorSettings settings_;
    Noise noise_;
    bool jammed_ = false;
    double motor_, ring_, target_, powered_us_, begins_us_ = 0, at_us_;
};

}  // namespace simrig

#endif
