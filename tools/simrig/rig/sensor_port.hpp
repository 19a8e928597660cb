// SPDX-License-Identifier: Apache-2.0
/// A sensor on the bridge: its end of the I2C branch, its control pins, and its pixels.
#ifndef VERGENCE_SIMRIG_RIG_SENSOR_PORT_HPP
#define VERGENCE_SIMRIG_RIG_SENSOR_PORT_HPP

#include <functional>
#include <vector>

#include "tools/simrig/devices/i2c_target.hpp"
#include "tools/simrig/devices/mt9t001.hpp"
#include "tools/simrig/rig/wires.hpp"

namespace simrig {

struct SensorSettings {
    double clock_mhz = 48;       ///< frequency of the sensor's clock input
    double clock_error_ppm = 0;  ///< frequency error of the sensor's oscillator
    double answer_ns = 350;      ///< delay from SCL's fall until the sensor's SDA is valid
};

/// Faults between a sensor and the bridge.
struct SensorFaults {
    bool unplugged = false;  ///< neither I2C nor clock
    bool silent = false;     ///< answers on I2C, but its clock is stopped
    uint16_t torn_bits = 0;  ///< data lines without contact: read as 0
    bool sda_stuck = false;  ///< pulls the branch's SDA
};

class SensorPort : public PinListener, public ClockListener {
  public:
    SensorPort(Wires &wires, int camera, const SensorSettings &settings, FrameSource source);

    uint32_t wanted() const override { return BRIDGE_EVENT_BRANCH | BRIDGE_EVENT_SENSOR; }
    void on_pins(uint64_t time_ps, uint32_t groups, const bridge_outputs &now) override;
    void on_clock(uint64_t time_ps, int camera) override;

    /// Whether the frames are watched; may be called at any time. A frame that began unwatched does
    /// not reach the pins; while none does, the pins show only enough clock edges that the bridge
    /// does not report the clock as lost. The sensor's frames continue in time either way.
    std::function<bool()> watched = [] { return true; };
    /// Checks watched() now instead of at the next look; after a rest of the wires looks continue.
    void look() { update_clock(); }
    /// All of its clock's edges are at the pins.
    bool live() const { return live_; }
    void set_faults(const SensorFaults &faults);
    /// Begin of the frame that it shows now: the rise of frame valid.
    uint64_t frame_begun_ps() const { return frame_begun_ps_; }
    uint64_t period_ps() const { return period_ps_; }
    Mt9t001 &sensor() { return sensor_; }

  private:
    void pull(bool low);
    void update_clock();
    void catch_up();
    void go_live();
    bool may_go_still(uint64_t time_ps) const;
    void go_still(uint64_t now_ps);
    void next_look();
    void burst();

    Wires &wires_;
    int camera_;
    SensorSettings settings_;
    Mt9t001 sensor_;
    I2cTarget target_;
    SensorFaults faults_;
    std::vector<uint16_t> words_;
    uint64_t pull_order_ = 0, period_ps_ = 0, frame_begun_ps_ = 0;
    uint64_t caught_up_ps_ = 0;  ///< time up to which the sensor was simulated while not live
    uint64_t look_ps_ = 0;       ///< time of the scheduled look; 0: none
    uint64_t blank_since_ps_ = 0;
    bool live_ = false, joined_late_ = false, trigger_ = false;
};

}  // namespace simrig

#endif
