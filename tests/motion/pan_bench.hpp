// SPDX-License-Identifier: Apache-2.0
/// The simulated rig's bus and time as the hal's, and a rig with bridge and servos only.
#ifndef VERGENCE_TESTS_MOTION_PAN_BENCH_HPP
#define VERGENCE_TESTS_MOTION_PAN_BENCH_HPP

#include <doctest/doctest.h>

#include <algorithm>
#include <cstring>
#include <limits>
#include <vector>

#include "core/error.h"
#include "rig/rig.h"
#include "tools/simrig/rig/rig.hpp"

namespace motion {

class PanBench {
  public:
    explicit PanBench(const simrig::RigSettings &settings)
        : world(settings, [](int, const simrig::SensorFrame &, double, const auto &) {
              return std::vector<uint16_t>();
          }) {
        world.advance(world.now_us() + 200, 0);
        std::memset(&rig, 0, sizeof rig);
        REQUIRE(rig_profile_named("rig", &rig.profile) == ERROR_OK);
        rig.ports.clock = &clock_;
        rig.ports.i2c = &bus_;
        rig.observer = {should_stop, nullptr, this};
        REQUIRE(fpga_bridge_open(&rig.bridge, &bus_, &clock_) == ERROR_OK);
        for (unsigned side = 0; side < RIG_SIDES; side++) {
            const servo_model &model = rig.profile.servo[side];
            CHECK(fpga_bridge_servo_limits(&rig.bridge, side, model.min_q4, model.max_q4) ==
                  ERROR_OK);
            set_slew(side, rig.profile.servo_slew_q4);
        }
        CHECK(fpga_bridge_watchdog_set(&rig.bridge, rig.profile.watchdog_ms,
                                       BRIDGE_WDG_ACTION_IS_OFF) == ERROR_OK);
        rig.state = RIG_READY;
    }
    void set_slew(unsigned side, uint16_t slew_q4) {
        CHECK(fpga_bridge_servo_slew(&rig.bridge, side, slew_q4) == ERROR_OK);
    }
    /// Offset of the horn from the angle, as if its spline were straight; degrees.
    double beside_deg(unsigned side, int32_t angle_urad, const simrig::ServoSettings &servo) {
        return world.servo(int(side)).angle_deg(world.now_us()) - servo.offset_degrees -
               angle_urad * 1e-6 * 180 / 3.14159265358979323846;
    }
    bool moving(unsigned side) { return world.servo(int(side)).moving(world.now_us()); }
    void begin() {
        asked_us = world.now_us();
        longest_silence_us = 0;
    }

    simrig::Rig world;
    struct rig rig;
    double cancel_us = std::numeric_limits<double>::infinity();
    double asked_us = 0, longest_silence_us = 0;  ///< time between two calls of the observer

  private:
    static PanBench &of(void *self) { return *static_cast<PanBench *>(self); }
    static bool should_stop(void *self) {
        PanBench &me = of(self);
        const double now_us = me.world.now_us();
        me.longest_silence_us = std::max(me.longest_silence_us, now_us - me.asked_us);
        me.asked_us = now_us;
        return now_us >= me.cancel_us;
    }
    static int transfer(void *self, const hal_i2c_message *messages, size_t count, uint64_t,
                        size_t *begun) {
        std::vector<simrig::I2cMessage> list;
        *begun = 0;
        for (size_t i = 0; i < count; i++) {
            const hal_i2c_message &from = messages[i];
            list.push_back({from.address, from.read, {from.data, from.data + from.bytes}});
            *begun += 1u + from.bytes;
        }
        const simrig::I2cStatus status = of(self).world.i2c(400000, list).status;
        for (size_t i = 0; i < count; i++) {
            if (messages[i].read) {
                std::copy(list[i].bytes.begin(), list[i].bytes.end(), messages[i].data);
            }
        }
        switch (status) {
            case simrig::I2cStatus::kOk:
                return ERROR_OK;
            case simrig::I2cStatus::kArbitration:
                return ERROR_I2C_ARBITRATION;
            case simrig::I2cStatus::kTimeout:
                return ERROR_TIMEOUT;
            case simrig::I2cStatus::kStuck:
                return ERROR_I2C_STUCK;
            default:
                return ERROR_I2C_NACK;
        }
    }
    static uint64_t now_us(void *self) { return uint64_t(of(self).world.now_us()); }
    static void wait_until_us(void *self, uint64_t time_us) {
        of(self).world.advance(double(time_us), 0);
    }

    hal_i2c_operations bus_operations_{transfer, nullptr};
    hal_clock_operations clock_operations_{now_us, wait_until_us, nullptr};
    hal_i2c bus_{&bus_operations_, this};
    hal_clock clock_{&clock_operations_, this};
};

}  // namespace motion

#endif
