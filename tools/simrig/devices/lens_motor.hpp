// SPDX-License-Identifier: Apache-2.0
/// One motor of a motorised lens (zoom, focus or iris) with its position potentiometer, in counts
/// of the controller's 10-bit converter. The potentiometer sits on the motor's side of the play, so
/// that readings do not show it: the worse case, as makers of lenses advise to approach from one
/// side.
#ifndef VERGENCE_SIMRIG_DEVICES_LENS_MOTOR_HPP
#define VERGENCE_SIMRIG_DEVICES_LENS_MOTOR_HPP

#include <cstdint>

#include "tools/simrig/devices/noise.hpp"

namespace simrig {

/// Its parameters; every imperfection can be 0.
struct LensMotorSettings {
    double counts_per_s = 150;
    double start_ms = 20;        ///< delay from command to motion
    double backlash_counts = 4;  ///< play between motor and ring
    double min_step_counts = 2;  ///< dead zone: a smaller error neither starts a move nor remains
    double stop_low = 290, stop_high = 860;  ///< mechanical end stops
    double read_noise_counts = 1;            ///< sigma of a read-back
    double outlier_chance = 0.002;           ///< chance of a read-back with a random value
    double settle_error_counts = 0.7;        ///< sigma of the resting position
    double drift_counts = 0;                 ///< drift of the potentiometer at power-up
    double drift_counts_per_h = 0;           ///< initial growth of the drift in a cold start
};

/// What the potentiometer reads too much at a time after power-up: the drift slows down as the part
/// warms up, and ends at six hours of the initial one.
double drift_counts(const LensMotorSettings &settings, double since_us);

class LensMotor {
  public:
    /// begin_us: time of power-up.
    LensMotor(const LensMotorSettings &settings, double position, uint64_t seed,
              double begin_us = 0);

    /// Starts a move until the potentiometer reads `counts`, as far as its dead zone goes; a move
    /// in progress is abandoned. Drift thus moves the ring.
    void go(double time_us, double counts);
    /// The same of a stepper, which counts its steps: drift has no effect.
    void step_to(double time_us, double counts);
    /// Motor and ring are there at once, as if turned by hand.
    void put(double time_us, double counts);
    void stop(double time_us);
    /// Position of the optics. Times must not decrease.
    double ring(double time_us);
    bool moving(double time_us);
    const LensMotorSettings &settings() const { return settings_; }
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
