// SPDX-License-Identifier: Apache-2.0
#include "tools/simrig/devices/servo.hpp"

#include <algorithm>
#include <cmath>

namespace simrig {

namespace {

// Separates the creep's random numbers from those of the resting positions.
constexpr uint64_t kCreepStream = 0x632BE59BD9B4E019u;
constexpr double kSlipUs = 1e6;

}  // namespace

Servo::Servo(const ServoSettings &settings, uint64_t seed)
    : settings_(settings), noise_(seed), creep_noise_(seed ^ kCreepStream) {
    motor_deg_ = horn_deg_ = target_deg_ = settings.offset_degrees;
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
        take_up_creep(time_us);
        creep_deg_ = settings_.creep_degrees * creep_noise_.gauss();
        target_deg_ = asked_deg_ + settings_.offset_degrees +
                      settings_.repeatability_degrees * noise_.gauss();
    }
}

void Servo::advance(double time_us) {
    const double powered_until_us = last_pulse_at_us_ + settings_.limp_ms * 1000;
    const double moves_s = (std::min(time_us, powered_until_us) - at_us_) * 1e-6;
    if (!jammed_ && moves_s > 0) {
        const double way = settings_.degrees_per_s * moves_s;
        const double left = target_deg_ - motor_deg_;
        motor_deg_ += std::clamp(left, -way, way);
        if (left != 0) {
            const double needs_s = std::min(std::abs(left) / settings_.degrees_per_s, moves_s);
            stopped_us_ = at_us_ + needs_s * 1e6;
        }
        // The motor moves the horn only once the play is taken up.
        const double half = settings_.play_degrees / 2;
        horn_deg_ = std::clamp(horn_deg_, motor_deg_ - half, motor_deg_ + half);
    }
    at_us_ = std::max(at_us_, time_us);
}

double Servo::crept_deg(double time_us) const {
    const double slips = std::floor(std::max(time_us - stopped_us_, 0.0) / kSlipUs);
    return creep_deg_ * -std::expm1(-slips * kSlipUs * 1e-6 / settings_.creep_s);
}

// The next move begins where the horn crept to.
void Servo::take_up_creep(double time_us) {
    const double crept = crept_deg(time_us);
    motor_deg_ += crept;
    horn_deg_ += crept;
    creep_deg_ = 0;
    stopped_us_ = time_us;
}

double Servo::angle_deg(double time_us) {
    advance(time_us);
    return horn_deg_ + crept_deg(time_us);
}

bool Servo::moving(double time_us) {
    advance(time_us);
    return !jammed_ && motor_deg_ != target_deg_ && driven(time_us);
}

void Servo::jam(double time_us, bool jammed) {
    advance(time_us);
    take_up_creep(time_us);
    jammed_ = jammed;
}

}  // namespace simrig
