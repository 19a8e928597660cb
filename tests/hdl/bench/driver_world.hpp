// SPDX-License-Identifier: Apache-2.0
/// What a driver's test can inspect besides the driver: the bridge's registers through an
/// undisturbed master, the sensors' registers, and started actions.
#ifndef VERGENCE_TESTS_HDL_BENCH_DRIVER_WORLD_HPP
#define VERGENCE_TESTS_HDL_BENCH_DRIVER_WORLD_HPP

#include <cstdint>
#include <map>
#include <optional>
#include <string>

#include "bridge.hpp"
#include "i2c_master.hpp"
#include "i2c_sensor.hpp"

namespace hdl {

/// Counts pulses on the left camera's trigger line.
class TriggerCount : public Listener {
  public:
    uint32_t wanted() const override { return BRIDGE_EVENT_SENSOR; }
    void on_event(uint64_t, uint32_t, const bridge_outputs &now) override {
        pulses += now.trigger[0] != 0 && !level_;
        level_ = now.trigger[0] != 0;
    }
    uint32_t pulses = 0;

  private:
    bool level_ = false;
};

class DriverWorld {
  public:
    /// All bits that only a write can change: by register index, by 0x100 or 0x200 plus the index
    /// for the sensors, and trigger pulses under kTriggers.
    using State = std::map<unsigned, uint32_t>;
    static constexpr unsigned kTriggers = 0x300;

    explicit DriverWorld(uint64_t seed);
    ~DriverWorld() { bridge.remove(trigger); }
    /// Resets the bridge, and sets registers so that writing zeros or ones to any of them leaves a
    /// trace; limits are unlocked.
    void prepare();
    /// Releases the bus and reads everything; nullopt if the bridge does not answer.
    std::optional<State> state();
    /// Releases the bus and reads a register; nullopt if the bridge does not answer.
    std::optional<uint16_t> peek(uint8_t index);
    /// Writes a register; true: accepted.
    bool poke(uint8_t index, uint16_t value);

    Bridge bridge;
    I2cSensor left, right;
    TriggerCount trigger;
};

/// The first difference between two states, as text; empty: none.
std::string difference(const DriverWorld::State &is, const DriverWorld::State &should);

}  // namespace hdl

#endif
