// SPDX-License-Identifier: Apache-2.0
#include "driver_world.hpp"

#include <cstdio>

#include "bridge_registers.h"

namespace hdl {

namespace {

// Bits of a register that only change when written.
unsigned kept_bits(const bridge_register &row) {
    switch (row.index) {
        case BRIDGE_UNLOCK:
            return 1;
        case BRIDGE_IRQ_STATUS:
            return row.clear_mask & ~unsigned(BRIDGE_IRQ_STATUS_I2C_ERROR_MASK);
        default:
            return row.stored_mask | row.clear_mask;
    }
}

}  // namespace

DriverWorld::DriverWorld(uint64_t seed)
    : bridge(seed), left(bridge, 0, 300 * kNs), right(bridge, 1, 300 * kNs) {
    bridge.add(trigger);
}

bool DriverWorld::poke(uint8_t index, uint16_t value) {
    I2cMaster master(bridge, standard_timing(1000));
    return Registers(master).write(index, value);
}

std::optional<uint16_t> DriverWorld::peek(uint8_t index) {
    I2cMaster master(bridge, standard_timing(1000));
    master.let_go();
    return Registers(master).read(index);
}

void DriverWorld::prepare() {
    bridge.in.scl = bridge.in.sda = 1;
    bridge.drive();
    bridge.reset();
    bridge.run(5 * kUs);
    bridge.run_idle(150 * kUs);  // the branches are cleared after a reset
    poke(BRIDGE_SCRATCH, 0x1234);
    poke(BRIDGE_IRQ_TEST, 0x82);
    poke(BRIDGE_SERVO0_TARGET_Q4, 0x5A5A);
    poke(BRIDGE_UNLOCK, BRIDGE_UNLOCK_KEY);
    left.registers.fill(0x3C96);
    right.registers.fill(0x3C96);
    trigger.pulses = 0;
}

std::optional<DriverWorld::State> DriverWorld::state() {
    I2cMaster master(bridge, standard_timing(1000));
    Registers registers(master);
    master.let_go();
    State state;
    constexpr int kGap = 4;  // shorter to read over than to start again
    for (int first = 0, last; first < BRIDGE_REGISTER_COUNT; first = last) {
        last = first + 1;
        if (kept_bits(bridge_registers[first]) == 0) {
            continue;
        }
        int end = first;  // the last register of interest
        for (; last < BRIDGE_REGISTER_COUNT &&
               bridge_registers[last].index - bridge_registers[end].index < kGap;
             last++) {
            end = kept_bits(bridge_registers[last]) != 0 ? last : end;
        }
        const uint8_t from = bridge_registers[first].index;
        const auto words = registers.read(from, size_t(bridge_registers[end].index - from + 1));
        if (!words) {
            return std::nullopt;
        }
        for (int i = first; i <= end; i++) {
            const bridge_register &row = bridge_registers[i];
            state[row.index] = (*words)[row.index - from] & kept_bits(row);
        }
    }
    for (unsigned i = 0; i < left.registers.size(); i++) {
        state[0x100 + i] = left.registers[i];
        state[0x200 + i] = right.registers[i];
    }
    state[kTriggers] = trigger.pulses;
    return state;
}

std::string difference(const DriverWorld::State &is, const DriverWorld::State &should) {
    for (const auto &[place, value] : should) {
        if (is.at(place) != value) {
            char text[80];
            std::snprintf(text, sizeof text, "place %03X holds %04X instead of %04X", place,
                          unsigned(is.at(place)), unsigned(value));
            return text;
        }
    }
    return "";
}

}  // namespace hdl
