// SPDX-License-Identifier: Apache-2.0
/// Backends in front of others that make one call fail, or one and all later calls.
#ifndef VERGENCE_TESTS_RIG_BENCH_FAULTY_PORTS_HPP
#define VERGENCE_TESTS_RIG_BENCH_FAULTY_PORTS_HPP

#include <cstdint>
#include <functional>

#include "rig/rig.h"

namespace rig_bench {

enum class Port { kI2c, kGpio, kCamera, kUart };
constexpr int kPorts = 4;

/// The failure.
struct Fault {
    Port port = Port::kI2c;
    uint64_t call = ~uint64_t(0);  ///< number of the port's call, from 0
    bool for_ever = false;
    int error = 0;
};

class FaultyPorts {
  public:
    explicit FaultyPorts(const rig_ports &behind);
    FaultyPorts(const FaultyPorts &) = delete;
    FaultyPorts &operator=(const FaultyPorts &) = delete;

    const rig_ports &ports() const { return ports_; }
    /// Counts from 0 again, and fails as specified; without a fault no call fails.
    void fail(const Fault &fault);
    uint64_t calls(Port port) const { return calls_[int(port)]; }
    /// Time of the first failed call, on the clock behind; 0: none.
    uint64_t failed_us() const { return failed_us_; }
    /// A failed transfer may have been accepted and must not be repeated: a word that is not read
    /// back.
    bool failed_once_only() const { return failed_once_only_; }

    /// 0, or the result that a call of this port returns without being made.
    int next(Port port);
    void fail_once_only() { failed_once_only_ = true; }
    const rig_ports &behind() const { return behind_; }

  private:
    rig_ports behind_, ports_;
    hal_i2c i2c_;
    hal_gpio gpio_;
    hal_camera camera_;
    hal_uart uart_;
    Fault fault_;
    uint64_t calls_[kPorts] = {};
    uint64_t failed_us_ = 0;
    bool failed_once_only_ = false;
};

}  // namespace rig_bench

#endif
