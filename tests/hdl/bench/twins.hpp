// SPDX-License-Identifier: Apache-2.0
/// Two bridges with identical inputs, of which the second evaluates every edge of every clock.
#ifndef VERGENCE_TESTS_HDL_BENCH_TWINS_HPP
#define VERGENCE_TESTS_HDL_BENCH_TWINS_HPP

#include "bench/bus_bench.hpp"
#include "bench/register_map.hpp"

namespace hdl {

struct Twin : BusBench {
    explicit Twin(uint64_t seed) : BusBench(seed, standard_timing(400)) {}
};

class TwoBridges {
  public:
    explicit TwoBridges(uint64_t seed) : twins{Twin(seed), Twin(seed)} {
        bridge_model_set_stepping(twins[1].bridge.model(), 1);
    }

    /// The same write to both; each must accept it.
    void write(uint8_t index, uint16_t value) {
        for (Twin &twin : twins) {
            REQUIRE(twin.registers.write(index, value));
        }
    }
    /// Whether all registers and the time are the same.
    bool same() {
        return bridge_model_digest(twins[0].bridge.model()) ==
                   bridge_model_digest(twins[1].bridge.model()) &&
               twins[0].bridge.now() == twins[1].bridge.now();
    }

    Twin twins[2];
};

}  // namespace hdl

#endif
