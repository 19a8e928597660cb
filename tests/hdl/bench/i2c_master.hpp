// SPDX-License-Identifier: Apache-2.0
/// A master of the DSP's bus, built from pin changes with exact times.
#ifndef VERGENCE_TESTS_HDL_BENCH_I2C_MASTER_HPP
#define VERGENCE_TESTS_HDL_BENCH_I2C_MASTER_HPP

#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "bridge.hpp"
#include "random.hpp"

namespace hdl {

/// Times of UM10204, table 10, in ps.
struct I2cTiming {
    uint64_t low, high;
    uint64_t start_setup, start_hold, stop_setup, free;
    /// SDA changes this long after SCL fell.
    uint64_t data_hold;
};

/// The shortest times of the standard; low is extended to fill the period.
I2cTiming standard_timing(unsigned khz);

/// For the sensors' branches at 400 kHz: the router shortens by up to 80 ns the high times and 200
/// ns off the hold time of START (see i2c_router.v), so the master gives 700 and 800 ns.
I2cTiming branch_timing(unsigned khz);

/// Ends a transfer in the middle (see I2cMaster::abort_after).
struct Aborted {};

class I2cMaster {
  public:
    I2cMaster(Bridge &bridge, const I2cTiming &timing) : bridge_(bridge), timing_(timing) {}

    void set_timing(const I2cTiming &timing) { timing_ = timing; }
    /// START, or a repeated one.
    void start();
    void stop();
    /// One clock. Returns the level of the wire while SCL was high.
    bool bit(bool level);
    /// True: acknowledged.
    bool write_byte(uint8_t value);
    uint8_t read_byte(bool acknowledge);

    /// Address and bytes in one transfer. Returns the number of acknowledged bytes, including the
    /// address.
    size_t write(uint8_t address, const std::vector<uint8_t> &bytes, bool with_stop = true);
    /// Result of a read; nullopt if the address was not acknowledged.
    std::optional<std::vector<uint8_t>> read(uint8_t address, size_t count);

    /// Throws Aborted after this many further pin changes; the lines then keep their state.
    void abort_after(uint64_t moves) { moves_left_ = moves; }
    void never_abort() { moves_left_ = UINT64_MAX; }
    uint64_t moves() const { return moves_; }
    /// Releases both lines.
    void let_go();
    /// Clocks until SDA is free, then sends a STOP. True: the bus is free. Never nine clocks
    /// blindly: with SDA free they would complete a word begun by another transfer.
    bool clear_bus();

  private:
    void scl(bool level);
    void sda(bool level);
    void wait(uint64_t duration_ps) { bridge_.run(duration_ps); }
    void count();

    Bridge &bridge_;
    I2cTiming timing_;
    uint64_t moves_left_ = UINT64_MAX, moves_ = 0;
    bool in_transfer_ = false;
};

/// The bridge's registers, accessed through the master.
class Registers {
  public:
    static constexpr uint8_t kAddress = 0x2C;
    explicit Registers(I2cMaster &master) : master_(master) {}
    /// True: everything was acknowledged.
    bool write(uint8_t index, uint16_t value);
    /// With a repeated START; nullopt if anything was not acknowledged.
    std::optional<uint16_t> read(uint8_t index);
    std::optional<std::vector<uint16_t>> read(uint8_t index, size_t words);

  private:
    I2cMaster &master_;
};

/// Short misreadings of the bus lines at random times.
class Spikes {
  public:
    /// per_second: on each line; longest_ps: of one; apart_ps: from the end of one to the next.
    Spikes(Bridge &bridge, uint64_t seed, double per_second, uint64_t longest_ps,
           uint64_t apart_ps);
    uint64_t count() const { return count_; }
    void end() { running_ = false; }

  private:
    void plan(int line);

    Bridge &bridge_;
    Random random_;
    double per_second_;
    uint64_t longest_ps_, apart_ps_, count_ = 0;
    bool running_ = true;
};

}  // namespace hdl

#endif
