// SPDX-License-Identifier: Apache-2.0
/// The hal's I2C bus and clock on the simulated bridge's pins: every bit of a driver's transfer is
/// sent on two open-drain wires that other devices may pull too.
#ifndef VERGENCE_TESTS_HDL_BENCH_DRIVER_BUS_HPP
#define VERGENCE_TESTS_HDL_BENCH_DRIVER_BUS_HPP

#include <functional>

#include "bridge.hpp"
#include "hal/clock.h"
#include "hal/i2c.h"
#include "i2c_master.hpp"

namespace hdl {

class DriverBus {
  public:
    /// A master with these timings. Lines already pulled by the bridge's inputs stay pulled, as
    /// left by an earlier master, until this one releases them.
    DriverBus(Bridge &bridge, const I2cTiming &timing);

    const hal_i2c *bus() const { return &bus_; }
    const hal_clock *clock() const { return &clock_; }
    /// Disables access to the lines for recovery, as with Linux i2c-dev.
    void hide_lines();

    /// Lines pulled by another device (HAL_I2C_*) from now on, for a duration.
    void others_pull(unsigned lines, uint64_t duration_ps = UINT64_MAX);
    unsigned others() const { return others_; }
    /// They are released at the rise of this clock of a recovery.
    void release_after(uint64_t recovery_falls) { release_after_ = recovery_falls; }
    /// When they were last released.
    uint64_t released_ps() const { return released_ps_; }
    /// Called after each fall of SCL in a transfer, with its number in this transfer (1 for that of
    /// START): after fall 9 * n + k + 1 comes bit k of byte n (the address is 0, bit 8
    /// acknowledges). A repeated START has its own fall.
    void on_fall(std::function<void(uint64_t)> hook) { hook_ = std::move(hook); }
    /// The master misreads SDA in the bit after the falls for which this returns true.
    void misread(std::function<bool(uint64_t)> wrong) { wrong_ = std::move(wrong); }
    /// SCL falls in the present or last transfer, and those made through lines().
    uint64_t falls() const { return falls_; }
    uint64_t recovery_falls() const { return recovery_falls_; }
    uint64_t transfers() const { return transfers_; }
    /// Simulates a duration; cheap if it is long and nothing changes.
    void wait(uint64_t duration_ps) { pass_until(bridge_.now() + duration_ps); }

  private:
    struct Failure {
        int error;
    };
    static int transfer(void *self, const hal_i2c_message *messages, size_t count,
                        uint64_t deadline_us, size_t *begun);
    static int lines(void *self, unsigned pulled, unsigned *high);
    static uint64_t now_us(void *self);
    static void wait_until_us(void *self, uint64_t time_us);

    int run(const hal_i2c_message *messages, size_t count, size_t &begun);
    void message(const hal_i2c_message &message, size_t &begun);
    void start(bool repeated);
    void stop();
    bool bit(bool level, bool own);
    bool write_byte(uint8_t value, size_t &begun);
    uint8_t read_byte(bool acknowledge, size_t &begun);
    void pull(unsigned lines);
    void fall();
    void rise();
    bool high(unsigned line) const;
    void drive();
    void pass_until(uint64_t end_ps);

    Bridge &bridge_;
    I2cTiming timing_;
    hal_i2c_operations operations_{transfer, lines};
    hal_clock_operations clock_operations_{now_us, wait_until_us, nullptr};
    hal_i2c bus_;
    hal_clock clock_;
    unsigned own_ = 0, others_ = 0;  // lines pulled
    uint64_t deadline_ps_ = 0, falls_ = 0, recovery_falls_ = 0, transfers_ = 0;
    uint64_t release_after_ = UINT64_MAX, release_ps_ = UINT64_MAX, released_ps_ = 0;
    uint64_t moved_ps_ = 0;
    std::function<void(uint64_t)> hook_;
    std::function<bool(uint64_t)> wrong_;
};

}  // namespace hdl

#endif
