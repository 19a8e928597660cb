// SPDX-License-Identifier: Apache-2.0
/// The I2C side of an MT9T001 on its branch: 0x5D, 16-bit registers behind an 8-bit index, high
/// byte first, auto-increment.
#ifndef VERGENCE_TESTS_HDL_BENCH_I2C_SENSOR_HPP
#define VERGENCE_TESTS_HDL_BENCH_I2C_SENSOR_HPP

#include <array>

#include "bridge.hpp"

namespace hdl {

class I2cSensor : public Listener {
  public:
    static constexpr uint8_t kAddress = 0x5D;

    /// answer_ps: from SCL's fall until its own SDA is valid (the standard: up to 900 ns).
    I2cSensor(Bridge &bridge, int camera, uint64_t answer_ps);

    uint32_t wanted() const override { return BRIDGE_EVENT_BRANCH; }
    void on_event(uint64_t time_ps, uint32_t events, const bridge_outputs &now) override;

    std::array<uint16_t, 256> registers{};
    /// What it has observed since its construction.
    uint64_t starts = 0, stops = 0, clocks = 0, addressed = 0, bytes_written = 0, bytes_read = 0;
    /// START or STOP in the middle of a byte; low and high times and holds of START shorter than
    /// the standard allows at 400 kHz.
    uint64_t broken = 0, short_times = 0;
    /// Pulls SDA or SCL permanently, as a hung sensor does.
    void hang(bool sda, bool scl);
    /// Stretches SCL this long after each byte, which the bridge does not support.
    uint64_t stretch_ps = 0;

  private:
    enum class State { kIdle, kAddress, kIndex, kWrite, kRead, kIgnore };
    void rise(bool sda);
    void fall();
    void byte_is_there();
    void drive(bool level);

    Bridge &bridge_;
    int camera_;
    uint64_t answer_ps_;
    State state_ = State::kIdle;
    bool scl_ = true, sda_ = true, acknowledge_ = false, hung_ = false;
    unsigned bits_ = 0;   // bits of the present byte, 9 with its acknowledge bit
    unsigned shift_ = 0;  // bits received, or to be sent
    uint8_t index_ = 0;
    bool low_byte_ = false;
    uint8_t high_ = 0;
    uint64_t rise_ps_ = 0, fall_ps_ = 0, start_ps_ = 0, order_ = 0;
};

}  // namespace hdl

#endif
