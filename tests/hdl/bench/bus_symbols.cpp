// SPDX-License-Identifier: Apache-2.0
#include "bus_symbols.hpp"

namespace hdl {

TargetOracle::Pull TargetOracle::pull() const {
    if (bits_ == 8) {
        return unsure_ ? Pull::kUnsure : acknowledge_ ? Pull::kYes : Pull::kNo;
    }
    if (state_ != State::kRead) {
        return Pull::kNo;
    }
    if (known_.count(index_) != 0 && followed_.count(index_) == 0) {
        return Pull::kUnsure;
    }
    const unsigned word = known_.count(index_) != 0 ? values_[index_] : 0u;
    const unsigned bit = word >> ((second_byte_ ? 7u : 15u) - bits_) & 1u;
    return bit == 0 ? Pull::kYes : Pull::kNo;
}

bool TargetOracle::about_to_store(uint8_t &index) const {
    index = index_;
    return state_ == State::kLow && bits_ >= 7;
}

void TargetOracle::word_is_taken() {
    stored_++;
    index_++;
    acknowledge_ = true;
    next_ = State::kHigh;
}

void TargetOracle::byte_is_there() {
    acknowledge_ = false;
    next_ = State::kIgnore;
    switch (state_) {
        case State::kAddress:
            acknowledge_ = shift_ >> 1 == 0x2C;
            if (acknowledge_) {
                next_ = (shift_ & 1u) != 0 ? State::kRead : State::kIndex;
            }
            second_byte_ = false;
            break;
        case State::kIndex:
            index_ = uint8_t(shift_);
            acknowledge_ = true;
            next_ = State::kHigh;
            break;
        case State::kHigh:
            high_ = uint8_t(shift_);
            acknowledge_ = known_.count(index_) != 0;
            next_ = acknowledge_ ? State::kLow : State::kIgnore;
            break;
        case State::kLow:
            // Whether a register accepts the word is its own rule: observed, not predicted.
            unsure_ = followed_.count(index_) == 0;
            if (!unsure_ && constant_.count(index_) == 0) {
                values_[index_] = uint16_t(unsigned(high_) << 8 | shift_);
                word_is_taken();
            }
            break;
        default:
            next_ = state_;
            break;
    }
}

void TargetOracle::after_acknowledge(bool wire) {
    if (state_ == State::kRead) {
        state_ = wire ? State::kIgnore : State::kRead;
        if (second_byte_) {
            index_++;
        }
        second_byte_ = !second_byte_;
    } else {
        state_ = next_;
    }
}

void TargetOracle::clock(bool first, bool second) {
    if (unsure_ && bits_ == 8) {
        unsure_ = false;
        if (!first && !second) {
            word_is_taken();
        }
    }
    if (first != second) {
        // START or STOP: the clock around it does not count. But a word that was sent is complete.
        if (bits_ == 8 && state_ == State::kRead && second_byte_) {
            index_++;
        }
        state_ = second ? State::kIdle : State::kAddress;
        bits_ = shift_ = 0;
        return;
    }
    if (state_ == State::kIdle || state_ == State::kIgnore) {
        return;
    }
    if (bits_ == 8) {
        bits_ = shift_ = 0;
        after_acknowledge(first);
        return;
    }
    shift_ = (shift_ << 1 | unsigned(first)) & 0xFFu;
    if (++bits_ == 8) {
        byte_is_there();
    }
}

void SymbolSource::plan_byte(uint8_t value, bool read) {
    for (int i = 7; i >= 0; i--) {
        planned_.push_back(read || (value >> i & 1) != 0 ? kOne : kZero);
    }
    planned_.push_back(read && random_.chance(0.8) ? kZero : kOne);
}

void SymbolSource::plan() {
    planned_.push_back(kStart);
    const bool read = random_.chance(0.3);
    const uint8_t addresses[] = {0x2C, 0x2C, 0x2C, 0x2C, 0x2C, 0x5C, 0x5E, 0x5D};
    const uint32_t choice = random_.below(9);
    const unsigned address = choice < 8 ? addresses[choice] : random_.below(128);
    plan_byte(uint8_t(address << 1 | unsigned(read)), false);
    const uint32_t bytes = random_.below(8);
    for (uint32_t i = 0; i < bytes; i++) {
        // Indices are in the lower half.
        plan_byte(uint8_t(i == 0 ? random_.below(0x60) : random_.below(256)), read);
    }
    if (random_.chance(0.7)) {
        planned_.push_back(kStop);
    }
}

Symbol SymbolSource::next() {
    if (random_.chance(1.0 / 64)) {
        return {random_.chance(0.5), random_.chance(0.5)};
    }
    if (random_.chance(1.0 / 512)) {
        planned_.clear();
    }
    if (planned_.empty()) {
        plan();
    }
    const Symbol symbol = planned_.front();
    planned_.pop_front();
    return symbol;
}

}  // namespace hdl
