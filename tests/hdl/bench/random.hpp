// SPDX-License-Identifier: Apache-2.0
/// Random numbers for the bridge's tests: the same on every machine for a seed.
#ifndef VERGENCE_TESTS_HDL_BENCH_RANDOM_HPP
#define VERGENCE_TESTS_HDL_BENCH_RANDOM_HPP

#include <cstdint>
#include <cstdlib>

#include "synthetic/seed.hpp"

namespace hdl {

/// Steele's splitmix64.
class Random {
  public:
    explicit Random(uint64_t seed) : state_(seed) {}

    uint64_t next() {
        uint64_t z = state_ += 0x9E3779B97F4A7C15u;
        z = (z ^ z >> 30) * 0xBF58476D1CE4E5B9u;
        z = (z ^ z >> 27) * 0x94D049BB133111EBu;
        return z ^ z >> 31;
    }
    /// 0 .. bound - 1
    uint32_t below(uint32_t bound) { return uint32_t((next() >> 32) * bound >> 32); }
    /// low .. high
    uint64_t between(uint64_t low, uint64_t high) { return low + next() % (high - low + 1); }
    bool chance(double probability) { return double(next() >> 11) * 0x1p-53 < probability; }

  private:
    uint64_t state_;
};

/// Number of rounds of a random test: VERGENCE_DRAWS from the environment, else `default_value`.
inline uint64_t draws(uint64_t default_value) {
    const char *text = std::getenv("VERGENCE_DRAWS");
    return text != nullptr ? std::strtoull(text, nullptr, 0) : default_value;
}

}  // namespace hdl

#endif
