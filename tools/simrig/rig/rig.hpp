// SPDX-License-Identifier: Apache-2.0
/// The whole simulated rig: the Verilated bridge, all devices on it, and its time.
#ifndef VERGENCE_SIMRIG_RIG_RIG_HPP
#define VERGENCE_SIMRIG_RIG_RIG_HPP

#include <array>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "tools/simrig/devices/i2c_target.hpp"
#include "tools/simrig/devices/lens_controller.hpp"
#include "tools/simrig/devices/servo.hpp"
#include "tools/simrig/rig/i2c_host.hpp"
#include "tools/simrig/rig/ppi_port.hpp"
#include "tools/simrig/rig/sensor_port.hpp"
#include "tools/simrig/rig/wires.hpp"

namespace simrig {

struct LensSettings {
    std::array<LensMotorSettings, kLensAxes> motor;
    std::array<double, kLensAxes> position = {300, 300, 850};  ///< positions at the start, counts
};

struct RigSettings {
    uint64_t seed = 1;
    /// The rig's time at the start, as if it had run for so long.
    uint32_t begin_s = 0;
    /// Every clock of both sensors reaches the bridge at all times, which costs some 5 CPU seconds
    /// for each second. Otherwise only frames that the armed port could get do, and the bridge's
    /// counts and times of frames and its measured pixel clock are of those alone.
    bool every_clock = false;
    /// Time constant in which the rig warms up after its start; 0: it never does.
    double warm_up_h = 0;
    std::array<ServoSettings, BRIDGE_SERVOS> servo;
    std::array<SensorSettings, BRIDGE_CAMERAS> sensor;
    LensControllerSettings lens_controller;
    std::array<LensSettings, BRIDGE_CAMERAS> lens;
};

/// Positions of a camera's moving parts.
struct CameraState {
    double pan_deg = 0;                    ///< angle of the horn, positive for longer pulses
    double zoom = 0, focus = 0, iris = 0;  ///< positions of the rings, counts
    double warm = 0;                       ///< share of the warming up, 0 to 1
};

/// What a camera sees: rows * columns numbers for a frame. state: at any time of the frame.
using Scenery =
    std::function<std::vector<uint16_t>(int camera, const SensorFrame &frame, double begin_us,
                                        const std::function<CameraState(double time_us)> &state)>;

/// What ended an advance.
enum Wake : uint32_t { kWakeGpio = 1, kWakeSerial = 2, kWakeFrame = 4 };

struct GpioEdge {
    double time_us;
    bool level;
};

class Rig : public PinListener {
  public:
    Rig(const RigSettings &settings, Scenery scenery);

    double now_us() const { return wires_.now_us(); }
    uint64_t now_ps() const { return wires_.now_ps(); }
    /// Advances time until then or until an event of `wake`; returns what happened.
    uint32_t advance(double until_us, uint32_t wake);

    I2cResult i2c(unsigned speed_hz, std::vector<I2cMessage> &messages);
    /// The bridge's reset line.
    void set_bridge_reset(bool reset);
    bool irq() { return wires_.out().irq != 0; }
    bool has_irq_edges() const { return !irq_edges_.empty(); }
    std::vector<GpioEdge> take_irq_edges();

    void arm_frame(unsigned columns, unsigned rows);
    void cancel_frame();
    bool frame_armed() const { return ppi_.armed(); }
    bool frame_done() const { return ppi_.done(); }
    /// Advances time until the armed frame is complete. False: not until then.
    bool wait_frame(double deadline_us);
    PpiFrame take_frame() { return ppi_.take(); }

    SerialLine &serial() { return lenses_->line(); }

    /// The board disconnected: releases everything that it drove.
    void release_board();

    // ---- the control side
    CameraState state(int camera) { return state_at(camera, now_us()); }
    Servo &servo(int number) { return servos_[size_t(number)]; }
    LensController &lenses() { return *lenses_; }
    SensorPort &sensor(int camera) { return *sensors_[size_t(camera)]; }
    I2cHost &host() { return host_; }
    Wires &wires() { return wires_; }

    // ---- PinListener
    uint32_t wanted() const override { return BRIDGE_EVENT_SERVO | BRIDGE_EVENT_IRQ; }
    void on_pins(uint64_t time_ps, uint32_t groups, const bridge_outputs &now) override;

  private:
    void on_servo(size_t i, uint64_t time_ps, bool high);
    CameraState state_at(int camera, double time_us);
    std::vector<uint16_t> picture(int camera, const SensorFrame &frame, double begin_us);
    bool watched(int camera) const;
    void look();
    bool live() const;
    void run_quietly(uint64_t until_ps);
    void run_idle(uint64_t end_ps);

    RigSettings settings_;
    Scenery scenery_;
    Wires wires_;
    I2cHost host_;
    PpiPort ppi_;
    std::array<Servo, BRIDGE_SERVOS> servos_;
    std::array<std::unique_ptr<SensorPort>, BRIDGE_CAMERAS> sensors_;
    std::unique_ptr<LensController> lenses_;
    I2cTarget lens_target_;

    struct Pulse {
        uint64_t rise_ps = 0, period_ps = 0;
        /// Width of the last whole pulse, and its change from the one before.
        uint64_t width_ps = 0, change_ps = 0;
        bool high = false;
    };
    struct Span {
        uint64_t begin_ps = UINT64_MAX, end_ps = 0;
    };
    Span next_edge(const Pulse &pulse, uint64_t now_ps) const;
    std::array<Pulse, BRIDGE_SERVOS> pulses_;
    uint64_t written_ps_ = 0;  ///< time of the last write to a register
    std::vector<GpioEdge> irq_edges_;
    bool irq_ = false, wake_on_irq_ = false, woken_by_irq_ = false, quiet_ = false;
    bool wake_on_frame_ = false;
};

/// The devices' part of a rig file: servos, lens motors, sensors' clocks and the lens controller.

/// Throws world::BadFile with one line that says what is wrong and where.
RigSettings load_settings(const std::string &path);

}  // namespace simrig

#endif
