// SPDX-License-Identifier: Apache-2.0
#include "tools/simrig/devices/lens_motor.hpp"

#include <algorithm>
#include <cmath>

namespace simrig {

double drift_counts(const LensMotorSettings &settings, double since_us) {
    constexpr double kWarmUpH = 6, kUsPerH = 3.6e9;
    return settings.drift_counts +
           settings.drift_counts_per_h * kWarmUpH * -std::expm1(-since_us / kUsPerH / kWarmUpH);
}

LensMotor::LensMotor(const LensMotorSettings &settings, double position, uint64_t seed,
                     double begin_us)
    : settings_(settings),
      noise_(seed),
      motor_(position),
      ring_(position),
      target_(position),
      powered_us_(begin_us),
      at_us_(begin_us) {}

// Drift changes too slowly to differ between the command and the end of its move.
void LensMotor::go(double time_us, double counts) {
    step_to(time_us, counts - drift_counts(settings_, time_us - powered_us_));
}

void LensMotor::step_to(double time_us, double counts) {
    advance(time_us);
    const double dead = settings_.min_step_counts;
    if (std::abs(counts - motor_) < dead) {
        target_ = motor_;
        return;
    }
    target_ = counts + std::clamp(settings_.settle_error_counts * noise_.gauss(), -dead, dead);
    begins_us_ = time_us + settings_.start_ms * 1000;
}

void LensMotor::put(double time_us, double counts) {
    advance(time_us);
    motor_ = ring_ = target_ = std::clamp(counts, settings_.stop_low, settings_.stop_high);
}

void LensMotor::stop(double time_us) {
    advance(time_us);
    target_ = motor_;
}

// The motor moves the ring only once the backlash is taken up.
void LensMotor::drag() {
    const double half = settings_.backlash_counts / 2;
    ring_ = std::clamp(ring_, motor_ - half, motor_ + half);
    ring_ = std::clamp(ring_, settings_.stop_low, settings_.stop_high);
}

void LensMotor::advance(double time_us) {
    const double from_us = std::max(at_us_, begins_us_);
    if (!jammed_ && time_us > from_us) {
        const double way = settings_.counts_per_s * (time_us - from_us) * 1e-6;
        motor_ += std::clamp(target_ - motor_, -way, way);
        motor_ = std::clamp(motor_, settings_.stop_low, settings_.stop_high);
        drag();
    }
    at_us_ = std::max(at_us_, time_us);
}

double LensMotor::ring(double time_us) {
    advance(time_us);
    return ring_;
}

bool LensMotor::moving(double time_us) {
    advance(time_us);
    const double end = std::clamp(target_, settings_.stop_low, settings_.stop_high);
    return !jammed_ && motor_ != end;
}

int LensMotor::read(double time_us) {
    advance(time_us);
    if (noise_.chance(settings_.outlier_chance)) {
        return int(noise_.next() % 1024);
    }
    const double drift = drift_counts(settings_, time_us - powered_us_);
    const double value = motor_ + drift + settings_.read_noise_counts * noise_.gauss();
    return int(std::clamp(std::floor(value + 0.5), 0.0, 1023.0));
}

void LensMotor::jam(double time_us, bool jammed) {
    advance(time_us);
    jammed_ = jammed;
}

}  // namespace simrig
