// SPDX-License-Identifier: Apache-2.0
/// A bridge and the master of its bus, with accesses that must succeed.
#ifndef VERGENCE_TESTS_HDL_BENCH_BUS_BENCH_HPP
#define VERGENCE_TESTS_HDL_BENCH_BUS_BENCH_HPP

#include <doctest/doctest.h>

#include "bench/bridge.hpp"
#include "bench/i2c_master.hpp"

namespace hdl {

struct BusBench {
    Bridge bridge;
    I2cMaster master;
    Registers registers;

    explicit BusBench(uint64_t seed = synthetic::test_seed(),
                      const I2cTiming &timing = standard_timing(1000))
        : bridge(seed), master(bridge, timing), registers(master) {}
    void write(uint8_t index, unsigned value) { REQUIRE(registers.write(index, uint16_t(value))); }
    uint16_t read(uint8_t index) {
        const auto value = registers.read(index);
        REQUIRE(value);
        return *value;
    }
};

}  // namespace hdl

#endif
