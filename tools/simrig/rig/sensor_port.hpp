// SPDX-License-Identifier: Apache-2.0
/// A sensor on the bridge: its end of the I2C branch, its control pins, and its pixels.
#ifndef VERGENCE_SIMRIG_RIG_SENSOR_PORT_HPP
#define VERGENCE_SIMRIG_RIG_SENSOR_PORT_HPP

#include "tools/simrig/devices/i2c_target.hpp"
#include "tools/simrig/devices/mt9t001.hpp"
#include "tools/simrig/rig/wires.hpp"

namespace simrig {

struct SensorSettings {
    double clock_mhz = 48;       ///< of the sensor's clock input
    double clock_error_ppm = 0;  ///< of its oscillator
    double answer_ns = 350;      ///< from SCL's fall until its SDA is valid
};

/// What can be wrong between a sensor and the bridge.
struct SensorFaults {
    bool unplugged = false;  ///< neither I2C nor clock
    bool silent = false;     ///< answers on I2C, but its clock stands
    uint16_t torn_bits = 0;  ///< data lines without contact: read as 0
    bool sda_stuck = false;  ///< pulls the branch's SDA
};

class SensorPort : public PinListener, public ClockListener {
  public:
    SensorPort(Wires &wires, int camera, const SensorSettings &settings, FrameSource source);

    uint32_t wanted() const override { return BRIDGE_EVENT_BRANCH | BRIDGE_EVENT_SENSOR; }
    void on_pins(uint64_t time_ps, uint32_t groups, const bridge_outputs &now) override;
    void on_clock(uint64_t time_ps, int camera, bool level) override;

    /// Whether its clock edges shall be seen at the pins. While they are not, the sensor's frames
    /// go on in time all the same.
    void show_clock(bool shown);
    void set_faults(const SensorFaults &faults);
    /// When the frame began that it shows now: the rise of frame valid.
    uint64_t frame_begun_ps() const { return frame_begun_ps_; }
    uint64_t period_ps() const { return period_ps_; }
    Mt9t001 &sensor() { return sensor_; }

  private:
    void pull(bool low);
    void update_clock();

    Wires &wires_;
    int camera_;
    SensorSettings settings_;
    Mt9t001 sensor_;
    I2cTarget target_;
    SensorFaults faults_;
    uint64_t pull_order_ = 0, period_ps_ = 0, stopped_at_ps_ = 0, frame_begun_ps_ = 0;
    bool shown_ = false, running_ = false, trigger_ = false;
};

}  // namespace simrig

#endif
