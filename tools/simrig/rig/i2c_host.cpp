// SPDX-License-Identifier: Apache-2.0
#include "tools/simrig/rig/i2c_host.hpp"

#include <algorithm>

namespace simrig {

namespace {

constexpr uint64_t kNs = 1000, kMs = 1000 * kPsPerUs;
// Time-out of a processor's controller for SCL held low.
constexpr uint64_t kStretchLimitPs = 25 * kMs;

}  // namespace

// High and low time of one half each; SDA moves a little after SCL's fall.
void I2cHost::set_speed(unsigned speed_hz) {
    const uint64_t period_ps = uint64_t(1e12) / std::clamp(speed_hz, 10000u, 1000000u);
    high_ps_ = std::min(period_ps / 2, std::max(period_ps * 2 / 5, 850 * kNs));
    low_ps_ = period_ps - high_ps_;
    hold_ps_ = std::min(low_ps_ / 4, 300 * kNs);
}

void I2cHost::set_faults(const BusFaults &faults) {
    faults_ = faults;
    set(scl_, sda_);
}

void I2cHost::set(bool scl, bool sda) {
    scl_ = scl;
    sda_ = sda;
    wires_.in.scl = scl && !faults_.scl_stuck;
    wires_.in.sda = sda && !faults_.sda_stuck && !(target_ != nullptr && target_->pulls());
    wires_.drive();
}

void I2cHost::wait(uint64_t duration_ps) {
    wires_.run(duration_ps);
    if (target_ != nullptr) {
        target_->lines(wires_.in.scl && wires_.out().scl != 0, sda_is_high());
    }
}

void I2cHost::raise_scl() {
    set(true, sda_);
    const uint64_t limit_ps = wires_.now_ps() + kStretchLimitPs;
    wait(high_ps_ / 8);
    while (!scl_is_high()) {
        if (wires_.now_ps() > limit_ps) {
            throw Failed{I2cStatus::kTimeout};
        }
        wait(kPsPerUs);
    }
}

void I2cHost::start(bool repeated) {
    if (repeated) {
        wait(hold_ps_);
        set(false, true);
        wait(low_ps_ - hold_ps_);
        raise_scl();
        wait(high_ps_);
    }
    if (!sda_is_high()) {
        throw Failed{repeated ? I2cStatus::kArbitration : I2cStatus::kStuck};
    }
    set(true, false);
    wait(high_ps_);
    set(false, false);
}

void I2cHost::stop() {
    wait(hold_ps_);
    set(false, false);
    wait(low_ps_ - hold_ps_);
    raise_scl();
    wait(high_ps_);
    set(true, true);
    wait(low_ps_);
    if (!sda_is_high()) {
        throw Failed{I2cStatus::kStuck};
    }
}

bool I2cHost::bit(bool level) {
    wait(hold_ps_);
    set(false, level);
    wait(low_ps_ - hold_ps_);
    raise_scl();
    wait(high_ps_ / 2);
    const bool seen = sda_is_high();
    wait(high_ps_ - high_ps_ / 2 - high_ps_ / 8);
    set(false, level);
    return seen;
}

bool I2cHost::write_byte(uint8_t value) {
    for (int i = 7; i >= 0; i--) {
        const bool level = (value >> i & 1) != 0;
        if (bit(level) != level) {
            throw Failed{I2cStatus::kArbitration};
        }
    }
    return !bit(true);
}

uint8_t I2cHost::read_byte(bool acknowledge) {
    unsigned value = 0;
    for (int i = 0; i < 8; i++) {
        value = value << 1 | unsigned(bit(true));
    }
    if (bit(!acknowledge) != !acknowledge) {
        throw Failed{I2cStatus::kArbitration};
    }
    return uint8_t(value);
}

void I2cHost::run_message(I2cMessage &message, I2cResult &result) {
    if (!write_byte(uint8_t(message.address << 1 | int(message.read)))) {
        throw Failed{I2cStatus::kNackAddress};
    }
    for (size_t i = 0; i < message.bytes.size(); i++) {
        if (message.read) {
            message.bytes[i] = read_byte(i + 1 < message.bytes.size());
        } else if (!write_byte(message.bytes[i])) {
            throw Failed{I2cStatus::kNackData};
        }
        result.bytes_done++;
    }
}

I2cResult I2cHost::transfer(unsigned speed_hz, std::vector<I2cMessage> &messages) {
    I2cResult result;
    set_speed(speed_hz);
    if (!scl_is_high() || !sda_is_high()) {
        result.status = I2cStatus::kStuck;
        return result;
    }
    try {
        for (I2cMessage &message : messages) {
            start(result.path_costs_done != 0);
            result.bytes_done = 0;
            run_message(message, result);
            result.path_costs_done++;
        }
        result.bytes_done = 0;
        stop();
    } catch (const Failed &failed) {
        result.status = failed.status;
        if (failed.status == I2cStatus::kNackAddress || failed.status == I2cStatus::kNackData) {
            try {
                stop();
            } catch (const Failed &) {
                set(true, true);
            }
        } else {
            // Arbitration lost: release the bus.
            set(true, true);
            wait(low_ps_);
        }
    }
    return result;
}

}  // namespace simrig
