// SPDX-License-Identifier: Apache-2.0
#include "i2c_sensor.hpp"

#include <algorithm>

namespace hdl {

I2cSensor::I2cSensor(Bridge &bridge, int camera, uint64_t answer_ps)
    : bridge_(bridge), camera_(camera), answer_ps_(answer_ps) {
    bridge_.add(*this);
}

void I2cSensor::hang(bool sda, bool scl) {
    hung_ = sda || scl;
    bridge_.in.branch_sda[camera_] = !sda;
    bridge_.in.branch_scl[camera_] = !scl;
    bridge_.drive();
}

void I2cSensor::drive(bool level) {
    const uint64_t order = ++order_;
    bridge_.at(bridge_.now() + answer_ps_, [this, level, order] {
        if (order == order_ && !hung_) {
            bridge_.in.branch_sda[camera_] = level;
            bridge_.drive();
        }
    });
}

void I2cSensor::on_event(uint64_t time_ps, uint32_t, const bridge_outputs &now) {
    const bool scl = now.branch_scl[camera_] != 0, sda = now.branch_sda[camera_] != 0;
    if (scl && scl_ && sda != sda_) {
        // A START or STOP between bytes comes before the first bit's fall.
        if (state_ != State::kIdle && state_ != State::kIgnore && bits_ > 1) {
            broken++;
        }
        start_ps_ = time_ps;
        state_ = sda ? State::kIdle : State::kAddress;
        (sda ? stops : starts)++;
        bits_ = 0;
        shift_ = 0;
        drive(true);
    } else if (scl && !scl_) {
        if (state_ != State::kIdle && time_ps - fall_ps_ < 1300 * kNs) {
            short_times++;
        }
        rise_ps_ = time_ps;
        clocks++;
        rise(sda);
    } else if (!scl && scl_) {
        // The high time, or the hold time of START.
        if (state_ != State::kIdle && time_ps - std::max(rise_ps_, start_ps_) < 600 * kNs) {
            short_times++;
        }
        fall_ps_ = time_ps;
        fall();
    }
    scl_ = scl;
    sda_ = sda;
}

void I2cSensor::rise(bool sda) {
    if (state_ == State::kIdle || state_ == State::kIgnore) {
        return;
    }
    bits_++;
    if (bits_ <= 8 && state_ != State::kRead) {
        shift_ = (shift_ << 1 | unsigned(sda)) & 0xFFu;
    } else if (bits_ == 9 && state_ == State::kRead) {
        acknowledge_ = !sda;
    }
}

void I2cSensor::byte_is_there() {
    acknowledge_ = true;
    switch (state_) {
        case State::kAddress:
            if (shift_ >> 1 != kAddress) {
                state_ = State::kIgnore;
                acknowledge_ = false;
                break;
            }
            addressed++;
            low_byte_ = false;
            state_ = (shift_ & 1u) != 0 ? State::kRead : State::kIndex;
            break;
        case State::kIndex:
            index_ = uint8_t(shift_);
            state_ = State::kWrite;
            break;
        case State::kWrite:
            bytes_written++;
            if (low_byte_) {
                registers[index_++] = uint16_t(unsigned(high_) << 8 | shift_);
            }
            high_ = uint8_t(shift_);
            low_byte_ = !low_byte_;
            break;
        default:
            break;
    }
}

void I2cSensor::fall() {
    if (state_ == State::kIdle || state_ == State::kIgnore) {
        return;
    }
    const bool sending = state_ == State::kRead;
    if (bits_ == 8 && !sending) {
        byte_is_there();
        drive(!acknowledge_);
        return;
    }
    if (bits_ == 8) {
        drive(true);  // the master acknowledges
        return;
    }
    if (bits_ == 9) {
        bits_ = 0;
        if (stretch_ps != 0) {
            bridge_.in.branch_scl[camera_] = 0;
            bridge_.drive();
            bridge_.at(bridge_.now() + stretch_ps, [this] {
                bridge_.in.branch_scl[camera_] = 1;
                bridge_.drive();
            });
        }
        if (sending && !acknowledge_) {
            state_ = State::kIgnore;
            drive(true);
            return;
        }
        if (sending) {
            shift_ = low_byte_ ? registers[index_++] & 0xFFu : unsigned(registers[index_] >> 8);
            low_byte_ = !low_byte_;
            bytes_read++;
        } else {
            shift_ = 0;
            drive(true);
        }
    }
    if (sending) {
        drive((shift_ >> (7 - bits_) & 1u) != 0);
    }
}

}  // namespace hdl
