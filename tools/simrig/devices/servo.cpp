// SPDX-License-Identifier: Apache-2.0
#include "tools/simrig/devices/servo.hpp"

#include <algorithm>

namespace simrig {

Servo::Servo(const ServoSettings &settings, uint64_t seed) : settings_(settings), noise_(seed) {
    angle_deg_ = target_deg_ = settings.offset_degrees;
}

void Servo::edge(double time_us, bool level) {
    if (level == level_) {
        return;
    }
    advance(time_us);
    level_ = level;
    if (level) {
        rise_us_ = time_us;
        return;
    }
    const double pulse_us = time_us - rise_us_;
    if (pulse_us < settings_.shortest_us || pulse_us > settings_.longest_us) {
        return;
    }
    pulse_us_ = pulse_us;
    last_pulse_at_us_ = time_us;
    const double within_us = std::clamp(pulse_us, settings_.min_us, settings_.max_us);
    asked_deg_ = (within_us - settings_.centre_us) / settings_.us_per_degree;
    // Within the dead band the motor does not move.
    if (std::abs(within_us - followed_us_) > settings_.dead_band_us) {
        followed_us_ = within_us;
        target_deg_ = asked_deg_ + settings_.offset_degrees +
                      settings_.repeatability_degrees * noise_.gauss();
    }
}

void Servo::advance(double time_us) {
    const double powered_until_us = last_pulse_at_us_ + settings_.limp_ms * 1000;
    const double moves_s = (std::min(time_us, powered_until_us) - at_us_) * 1e-6;
    if (!jammed_ && moves_s > 0) {
        const double way = settings_.degrees_per_s * moves_s;
        angle_deg_ += std::clamp(target_deg_ - angle_deg_, -way, way);
    }
    at_us_ = std::max(at_us_, time_us);
}

double Servo::angle_deg(double time_us) {
    advance(time_us);
    return angle_deg_;
}

bool Servo::moving(double time_us) {
    advance(time_us);
    return !jammed_ && angle_deg_ != target_deg_ && driven(time_us);
}

void Servo::jam(double time_us, bool jammed) {
    advance(time_us);
    jammed_ = jammed;
}

}  // namespace simrig
