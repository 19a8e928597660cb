// SPDX-License-Identifier: Apache-2.0
#include "servo_checker.hpp"

namespace hdl {

void ServoChecker::fault(int servo, uint64_t time_ps, const std::string &what) {
    if (faults_.size() < 20) {
        faults_.push_back("servo " + std::to_string(servo) + " at " +
                          std::to_string(double(time_ps) / double(kUs)) + " us: " + what);
    }
}

void ServoChecker::on_event(uint64_t time_ps, uint32_t, const bridge_outputs &now) {
    for (int servo = 0; servo < BRIDGE_SERVOS; servo++) {
        const bool high = now.servo[servo] != 0;
        if (high == high_[servo]) {
            continue;
        }
        high_[servo] = high;
        if (high) {
            if (period_ps_[servo] != 0 && demanded_before_[servo] &&
                time_ps - rise_ps_[servo] != period_ps_[servo]) {
                fault(servo, time_ps,
                      "frame of " +
                          std::to_string(double(time_ps - rise_ps_[servo]) / double(kUs)) + " us");
            }
            demanded_before_[servo] = period_ps_[servo] != 0;
            rise_ps_[servo] = time_ps;
            continue;
        }
        const Pulse pulse = {rise_ps_[servo], time_ps};
        const bool cut = reset_ps_ >= pulse.rise_ps && reset_ps_ <= time_ps;
        if ((pulse.width_ps() < kShortest && !cut) || pulse.width_ps() > kLongest) {
            fault(servo, time_ps,
                  "pulse of " + std::to_string(double(pulse.width_ps()) / double(kUs)) + " us");
        }
        pulses_[servo].push_back(pulse);
    }
}

void ServoChecker::on_reset(uint64_t time_ps) {
    reset_ps_ = time_ps;
    demand(0, 0);
    demand(1, 0);
}

void ServoChecker::demand(int servo, uint64_t period_ps) {
    period_ps_[servo] = period_ps;
    demanded_before_[servo] = false;
}

void ServoChecker::look(uint64_t time_ps) {
    for (int servo = 0; servo < BRIDGE_SERVOS; servo++) {
        if (period_ps_[servo] != 0 && time_ps - rise_ps_[servo] > period_ps_[servo]) {
            fault(servo, time_ps, "no pulse in a frame");
        }
        if (high_[servo] && time_ps - rise_ps_[servo] > kLongest) {
            fault(servo, time_ps, "pulse without an end");
        }
    }
}

}  // namespace hdl
