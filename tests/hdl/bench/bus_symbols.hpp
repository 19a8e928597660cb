// SPDX-License-Identifier: Apache-2.0
/// Random symbols on the DSP's bus, and the expected response of a correct target.
///
/// A symbol is one clock: SDA is set while SCL is low, and may change once while SCL is high.
#ifndef VERGENCE_TESTS_HDL_BENCH_BUS_SYMBOLS_HPP
#define VERGENCE_TESTS_HDL_BENCH_BUS_SYMBOLS_HPP

#include <array>
#include <cstdint>
#include <deque>
#include <set>

#include "random.hpp"

namespace hdl {

/// SDA before and after the middle of the high phase.
struct Symbol {
    bool first, second;
};
constexpr Symbol kZero{false, false}, kOne{true, true}, kStart{true, false}, kStop{false, true};

/// The bridge's target as documented, clock by clock.
class TargetOracle {
  public:
    /// known: indices that exist.
    explicit TargetOracle(std::set<uint8_t> known) : known_(std::move(known)) {}

    /// Whether it pulls SDA during the next clock. Unknown while it sends a register whose value is
    /// not known here, or decides on a word for it; then the wire must show it, so the master must
    /// not pull throughout the deciding clock.
    enum class Pull { kNo, kYes, kUnsure };
    Pull pull() const;
    bool judging() const { return bits_ == 8 && unsure_; }
    /// The next clock would store a word, in this register.
    bool about_to_store(uint8_t &index) const;
    /// The clock as seen on the wire.
    void clock(bool first, bool second);

    /// A register whose value is tracked: plain storage, or a constant that accepts nothing.
    void follow(uint8_t index, uint16_t value, bool constant) {
        values_[index] = value;
        followed_.insert(index);
        if (constant) {
            constant_.insert(index);
        }
    }
    uint16_t value(uint8_t index) const { return values_[index]; }
    uint64_t stored() const { return stored_; }

  private:
    enum class State { kIdle, kAddress, kIndex, kHigh, kLow, kRead, kIgnore };
    void byte_is_there();
    void word_is_taken();
    void after_acknowledge(bool wire);

    std::set<uint8_t> known_, followed_, constant_;
    std::array<uint16_t, 256> values_{};
    State state_ = State::kIdle, next_ = State::kIdle;
    unsigned bits_ = 0, shift_ = 0;
    bool acknowledge_ = false, unsure_ = false, second_byte_ = false;
    uint8_t index_ = 0, high_ = 0;
    uint64_t stored_ = 0;
};

/// Complete transfers with random interruptions: purely random symbols rarely contain an address.
class SymbolSource {
  public:
    explicit SymbolSource(uint64_t seed) : random_(seed) {}
    Symbol next();
    Random &random() { return random_; }

  private:
    void plan();
    void plan_byte(uint8_t value, bool read);

    Random random_;
    std::deque<Symbol> planned_;
};

}  // namespace hdl

#endif
