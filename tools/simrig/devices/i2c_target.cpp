// SPDX-License-Identifier: Apache-2.0
#include "tools/simrig/devices/i2c_target.hpp"

#include <utility>

namespace simrig {

I2cTarget::I2cTarget(uint8_t address, Write write, Read read)
    : address_(address), write_(std::move(write)), read_(std::move(read)) {}

void I2cTarget::reset() {
    state_ = State::kIdle;
    pulls_ = false;
}

void I2cTarget::rise(bool sda) {
    bits_++;
    if (bits_ <= 8 && state_ != State::kRead) {
        shift_ = (shift_ << 1 | unsigned(sda)) & 0xFFu;
    } else if (bits_ == 9 && state_ == State::kRead) {
        acknowledge_ = !sda;
    }
}

bool I2cTarget::lines(bool scl, bool sda) {
    if (scl && scl_ && sda != sda_) {
        state_ = sda ? State::kIdle : State::kAddress;
        bits_ = shift_ = 0;
        pulls_ = false;
    } else if (scl && !scl_ && state_ != State::kIdle) {
        rise(sda);
    } else if (!scl && scl_ && state_ != State::kIdle) {
        fall();
    }
    scl_ = scl;
    sda_ = sda;
    return pulls_;
}

void I2cTarget::byte_is_there() {
    acknowledge_ = true;
    switch (state_) {
        case State::kAddress:
            acknowledge_ = shift_ >> 1 == address_;
            if (!acknowledge_) {
                state_ = State::kIdle;
                break;
            }
            low_byte_ = false;
            state_ = (shift_ & 1u) != 0 ? State::kRead : State::kIndex;
            break;
        case State::kIndex:
            index_ = uint8_t(shift_);
            state_ = State::kWrite;
            break;
        case State::kWrite:
            if (low_byte_) {
                write_(index_++, uint16_t(unsigned(high_) << 8 | shift_));
            }
            high_ = uint8_t(shift_);
            low_byte_ = !low_byte_;
            break;
        default:
            break;
    }
}

void I2cTarget::fall() {
    const bool sending = state_ == State::kRead;
    if (bits_ == 8) {
        if (!sending) {
            byte_is_there();
        }
        pulls_ = !sending && acknowledge_;
        return;
    }
    if (bits_ == 9) {
        bits_ = 0;
        pulls_ = false;
        shift_ = 0;
        if (sending && !acknowledge_) {
            state_ = State::kIdle;
            return;
        }
        if (sending) {
            const uint16_t word = read_(index_);
            shift_ = low_byte_ ? word & 0xFFu : unsigned(word >> 8);
            index_ = low_byte_ ? uint8_t(index_ + 1) : index_;
            low_byte_ = !low_byte_;
        }
    }
    if (sending) {
        pulls_ = (shift_ >> (7 - bits_) & 1u) == 0;
    }
}

}  // namespace simrig
