// SPDX-License-Identifier: Apache-2.0
/// The driver, opened over a bus on the simulated bridge.
#ifndef VERGENCE_TESTS_HDL_BENCH_DRIVER_RIG_HPP
#define VERGENCE_TESTS_HDL_BENCH_DRIVER_RIG_HPP

#include <string>

#include "core/error.h"
#include "device/fpga_bridge.h"
#include "driver_bus.hpp"
#include "driver_world.hpp"
#include "synthetic/seed.hpp"

namespace hdl {

class DriverRig {
  public:
    /// With the environment set up and the driver open; its counters are 0.
    explicit DriverRig(uint64_t seed = synthetic::test_seed(), unsigned khz = 400);

    /// The driver's counters since the last call, as "transfers 1, nacks 2"; zeros omitted.
    std::string counted();
    /// Microseconds since the last call.
    uint64_t took_us();
    /// Ends all faults.
    void heal();

    DriverWorld world;
    DriverBus bus;
    fpga_bridge driver{};

  private:
    uint64_t begin_ps_ = 0;
};

}  // namespace hdl

#endif
