// SPDX-License-Identifier: Apache-2.0
// Spikes of up to 50 ns on both lines of the bus at 400 kHz change nothing. Merged spikes, which
// exceed the standard's requirement, are counted and reported.
#include <doctest/doctest.h>

#include "bench/i2c_master.hpp"
#include "bench/servo_checker.hpp"

namespace {

// Writes and reads back this often; returns how many pairs were wrong.
uint64_t wrong_pairs(uint64_t seed, uint64_t pairs, unsigned khz, double per_second,
                     uint64_t apart_ps, uint64_t &spikes_seen) {
    hdl::Bridge bridge(seed);
    hdl::I2cMaster master(bridge, hdl::standard_timing(khz));
    hdl::Registers registers(master);
    hdl::Random random(seed);
    hdl::Spikes spikes(bridge, seed + 1, per_second, 50 * hdl::kNs, apart_ps);
    uint64_t wrong = 0;
    for (uint64_t i = 0; i < pairs; i++) {
        const auto value = uint16_t(random.below(65536));
        const bool acknowledged = registers.write(0x04, value);
        if (!acknowledged || registers.read(0x04) != value) {
            wrong++;
        }
    }
    spikes_seen = spikes.count();
    CHECK(bridge.servos().faults().empty());
    return wrong;
}

}  // namespace

TEST_CASE("isolated spikes of 50 ns, 20000 a second on each line: no transaction is wrong") {
    const uint64_t seed = synthetic::test_seed(), pairs = hdl::draws(2000) / 2;
    INFO("seed " << seed);
    for (unsigned khz : {100u, 400u}) {
        uint64_t spikes = 0;
        const uint64_t part = khz == 400 ? pairs : pairs / 10 + 1;
        CHECK(wrong_pairs(seed, part, khz, 2e4, 200 * hdl::kNs, spikes) == 0);
        MESSAGE(khz << " kHz: " << 2 * part << " transactions, " << spikes << " spikes");
    }
}

// START lasts six clocks at 1 MHz, and a spike on its edge can take four of them: rare, not never.
TEST_CASE("isolated spikes at 1 MHz are reported") {
    const uint64_t seed = synthetic::test_seed(), pairs = hdl::draws(2000) / 20 + 1;
    uint64_t spikes = 0;
    const uint64_t wrong = wrong_pairs(seed, pairs, 1000, 2e4, 200 * hdl::kNs, spikes);
    MESSAGE("1000 kHz: " << 2 * pairs << " transactions, " << spikes << " spikes: " << wrong
                         << " pairs wrong");
    CHECK(wrong <= pairs / 100);
}

TEST_CASE("spikes that may merge are reported") {
    const uint64_t seed = synthetic::test_seed();
    uint64_t spikes = 0;
    const uint64_t wrong = wrong_pairs(seed, 200, 400, 2e5, 0, spikes);
    MESSAGE("400 transactions with " << spikes << " spikes that may touch: " << wrong
                                     << " pairs wrong");
    CHECK(wrong < 100);
}
