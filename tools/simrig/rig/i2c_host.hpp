// SPDX-License-Identifier: Apache-2.0
/// The DSP's end of the I2C bus, bit by bit on the bridge's pins: one master with clock stretching,
/// loss of arbitration and time-outs, as a controller in a processor has them (the TWI of a BF537;
/// not Linux's i2c-algo-bit, which does not look at SDA while it sends).
#ifndef VERGENCE_SIMRIG_RIG_I2C_HOST_HPP
#define VERGENCE_SIMRIG_RIG_I2C_HOST_HPP

#include <cstdint>
#include <vector>

#include "tools/simrig/devices/i2c_target.hpp"
#include "tools/simrig/rig/wires.hpp"

namespace simrig {

struct I2cMessage {
    uint8_t address;  ///< 7 bits
    bool read;
    std::vector<uint8_t> bytes;  ///< data to write; a read fills as many
};

enum class I2cStatus {
    kOk,
    kNackAddress,  ///< the address was not acknowledged; STOP was sent
    kNackData,     ///< a byte of a write was not acknowledged; STOP was sent
    kArbitration,  ///< SDA was low where the master released it; no clock, no STOP after that
    kTimeout,      ///< SCL was held for more than 25 ms; aborted there
    kStuck,        ///< a line was low before START, or SDA did not rise at STOP
};

struct I2cResult {
    I2cStatus status = I2cStatus::kOk;
    size_t path_costs_done = 0;
    size_t bytes_done = 0;  ///< bytes transferred of the message that failed
};

/// Faults on the bus: lines held low.
struct BusFaults {
    bool sda_stuck = false, scl_stuck = false;
};

class I2cHost {
  public:
    explicit I2cHost(Wires &wires) : wires_(wires) {}

    /// One transfer: START, the messages with repeated STARTs, STOP. Reads fill their bytes.
    I2cResult transfer(unsigned speed_hz, std::vector<I2cMessage> &messages);

    void set_faults(const BusFaults &faults);

    /// A device on the bus besides the bridge; the caller owns it. Its SDA changes when the
    /// master's may, a little after SCL's fall.
    void attach(I2cTarget &target) { target_ = &target; }

  private:
    struct Failed {
        I2cStatus status;
    };
    void set_speed(unsigned speed_hz);
    void set(bool scl, bool sda);
    void wait(uint64_t duration_ps);
    bool scl_is_high() { return wires_.in.scl && wires_.out().scl != 0; }
    bool sda_is_high() { return wires_.in.sda && wires_.out().sda != 0; }
    void raise_scl();
    void start(bool repeated);
    void stop();
    bool bit(bool level);
    bool write_byte(uint8_t value);
    uint8_t read_byte(bool acknowledge);
    void run_message(I2cMessage &message, I2cResult &result);

    Wires &wires_;
    BusFaults faults_;
    I2cTarget *target_ = nullptr;
    bool scl_ = true, sda_ = true;
    uint64_t low_ps_ = 0, high_ps_ = 0, hold_ps_ = 0;
};

}  // namespace simrig

#endif
