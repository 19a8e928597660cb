// SPDX-License-Identifier: Apache-2.0
/// A pan servo of the kind HiTec HS-322HD, driven by the pulses on its wire.
#ifndef VERGENCE_SIMRIG_DEVICES_SERVO_HPP
#define VERGENCE_SIMRIG_DEVICES_SERVO_HPP

#include <cstdint>

#include "tools/simrig/devices/noise.hpp"

namespace simrig {

/// Its parameters; every imperfection can be 0.
struct ServoSettings {
    double centre_us = 1500;
    double us_per_degree = 10.3;
    /// 60 degrees in 0.19 s at 4.8 V.
    double degrees_per_s = 316;
    double min_us = 570, max_us = 2430;  ///< range of pulses; the end stops limit it beyond
    double dead_band_us = 3;             ///< a smaller change causes no motion
    double repeatability_degrees = 0.3;  ///< sigma of the resting position
    double offset_degrees = 0;           ///< mounting angle of the horn on its spline
    double play_degrees = 0;             ///< play of the gears: the horn lags by up to half of it
    /// At rest the horn creeps: by a random angle with this sigma, of which 1 - exp(-t / creep_s)
    /// is there a time t after the stop, in slips a second apart.
    double creep_degrees = 0;
    double creep_s = 30;
    /// Pulses outside this range are ignored; without pulses for so long it goes limp (stays).
    double shortest_us = 400, longest_us = 2700, limp_ms = 100;
};

class Servo {
  public:
    Servo(const ServoSettings &settings, uint64_t seed);

    /// An edge of the wire.
    void edge(double time_us, bool level);
    /// Angle of the horn, positive for longer pulses. Times must not decrease.
    double angle_deg(double time_us);
    bool moving(double time_us);

    /// Fault: it stops moving, or moves again.
    void jam(double time_us, bool jammed);
    /// Angle that the last pulse commands, without imperfections.
    double asked_deg() const { return asked_deg_; }
    double last_pulse_us() const { return pulse_us_; }
    /// Whether it gets pulses; without, it is limp.
    bool driven(double time_us) const {
        return time_us < last_pulse_at_us_ + settings_.limp_ms * 1000;
    }

  private:
    void advance(double time_us);
    double crept_deg(double time_us) const;
    void take_up_creep(double time_us);

    ServoSettings settings_;
    Noise noise_, creep_noise_;
    bool level_ = false, jammed_ = false;
    double rise_us_ = -1e18, pulse_us_ = 0, followed_us_ = 0, last_pulse_at_us_ = -1e18;
    double asked_deg_ = 0, target_deg_ = 0, at_us_ = 0;
    double motor_deg_ = 0, horn_deg_ = 0;
    double creep_deg_ = 0;  ///< final angle of the creep after the last stop
    double stopped_us_ = 0;
};

}  // namespace simrig

#endif
