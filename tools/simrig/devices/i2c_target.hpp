// SPDX-License-Identifier: Apache-2.0
/// A device on an I2C bus, bit by bit: registers of 16 bits, high byte first, behind an 8-bit
/// index that increments, as Micron's sensors have them.
#ifndef VERGENCE_SIMRIG_DEVICES_I2C_TARGET_HPP
#define VERGENCE_SIMRIG_DEVICES_I2C_TARGET_HPP

#include <cstdint>
#include <functional>

namespace simrig {

class I2cTarget {
  public:
    using Write = std::function<void(uint8_t index, uint16_t value)>;
    using Read = std::function<uint16_t(uint8_t index)>;

    I2cTarget(uint8_t address, Write write, Read read);

    /// Call when the wires have changed. Returns whether this device pulls SDA from now on (after
    /// its delay, which the caller applies).
    bool lines(bool scl, bool sda);
    /// Power loss or reset: releases SDA and waits for START.
    void reset();
    bool pulls() const { return pulls_; }

  private:
    enum class State { kIdle, kAddress, kIndex, kWrite, kRead };
    void rise(bool sda);
    void fall();
    void byte_is_there();

    uint8_t address_;
    Write write_;
    Read read_;
    State state_ = State::kIdle;
    bool scl_ = true, sda_ = true, pulls_ = false, acknowledge_ = false, low_byte_ = false;
    unsigned bits_ = 0, shift_ = 0;
    uint8_t index_ = 0, high_ = 0;
};

}  // namespace simrig

#endif
