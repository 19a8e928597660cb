// SPDX-License-Identifier: Apache-2.0
#include "driver_rig.hpp"

#include <stdexcept>

namespace hdl {

namespace {

I2cTiming timing_of(unsigned khz) {
    I2cTiming timing = khz == 400 ? branch_timing(400) : standard_timing(khz);
    timing.data_hold = 300 * kNs;
    return timing;
}

}  // namespace

DriverRig::DriverRig(uint64_t seed, unsigned khz) : world(seed), bus(world.bridge, timing_of(khz)) {
    world.prepare();
    if (fpga_bridge_open(&driver, bus.bus(), bus.clock()) != ERROR_OK) {
        throw std::runtime_error("the driver cannot open the bridge");
    }
    counted();
    took_us();
}

std::string DriverRig::counted() {
    fpga_bridge_counts &counts = driver.bus.counts;
    const struct {
        const char *name;
        uint32_t count;
    } all[] = {{"transfers", counts.transfers},
               {"nacks", counts.nacks},
               {"arbitration", counts.arbitration},
               {"timeouts", counts.timeouts},
               {"stuck", counts.stuck},
               {"verify", counts.verify},
               {"doubts", counts.doubts},
               {"repeats", counts.repeats},
               {"recoveries", counts.recoveries},
               {"unrecovered", counts.unrecovered},
               {"refused", counts.refused},
               {"other", counts.other_errors}};
    std::string text;
    for (const auto &one : all) {
        if (one.count != 0) {
            text += (text.empty() ? "" : ", ") + std::string(one.name) + " " +
                    std::to_string(one.count);
        }
    }
    counts = {};
    return text;
}

uint64_t DriverRig::took_us() {
    const uint64_t begin_ps = begin_ps_;
    begin_ps_ = world.bridge.now();
    return (begin_ps_ - begin_ps) / kUs;
}

void DriverRig::heal() {
    bus.on_fall({});
    bus.misread({});
    bus.others_pull(0);
    world.bridge.in.sda_noise = world.bridge.in.scl_noise = 0;
    world.bridge.in.reset = 0;
    world.bridge.drive();
    bus.wait(5 * kUs);
}

}  // namespace hdl
