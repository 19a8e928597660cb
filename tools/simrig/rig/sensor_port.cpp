// SPDX-License-Identifier: Apache-2.0
#include "tools/simrig/rig/sensor_port.hpp"

#include <cmath>
#include <utility>

namespace simrig {

SensorPort::SensorPort(Wires &wires, int camera, const SensorSettings &settings, FrameSource source)
    : wires_(wires),
      camera_(camera),
      settings_(settings),
      sensor_(std::move(source)),
      target_(
          Mt9t001::kAddress,
          [this](uint8_t index, uint16_t value) {
              sensor_.write(index, value);
              update_clock();
          },
          [this](uint8_t index) { return sensor_.read(index); }) {
    wires.listen(*this);
    wires.listen_clock(camera, *this);
}

void SensorPort::pull(bool low) {
    const uint64_t order = ++pull_order_;
    const auto delay_ps = uint64_t(settings_.answer_ns * 1000);
    wires_.at(wires_.now_ps() + delay_ps, [this, low, order] {
        if (order == pull_order_) {
            wires_.in.branch_sda[camera_] = !low && !faults_.sda_stuck;
            wires_.drive();
        }
    });
}

void SensorPort::on_pins(uint64_t time_ps, uint32_t groups, const bridge_outputs &now) {
    (void)time_ps;
    if ((groups & BRIDGE_EVENT_BRANCH) != 0 && !faults_.unplugged) {
        const bool before = target_.pulls();
        const bool pulls =
            target_.lines(now.branch_scl[camera_] != 0, now.branch_sda[camera_] != 0);
        if (pulls != before) {
            pull(pulls);
        }
    }
    if ((groups & BRIDGE_EVENT_SENSOR) != 0) {
        Mt9t001::Pins pins;
        pins.reset_n = now.sensor_reset_n[camera_] != 0;
        pins.standby = now.sensor_standby[camera_] != 0;
        pins.output_enable = now.sensor_oe[camera_] != 0;
        pins.clock_in = now.sensor_extclk_enable[camera_] != 0;
        sensor_.set_pins(pins);
        if (!pins.reset_n && target_.pulls()) {
            pull(false);
        }
        if (!pins.reset_n) {
            target_.reset();
        }
        const bool trigger = now.trigger[camera_] != 0;
        if (trigger && !trigger_) {
            sensor_.trigger();
        }
        trigger_ = trigger;
        update_clock();
    }
}

void SensorPort::show_clock(bool shown) {
    shown_ = shown;
    update_clock();
}

// The pins' clock as it should be now; what passed while it could not be seen is caught up with.
void SensorPort::update_clock() {
    const unsigned divider = faults_.silent || faults_.unplugged ? 0 : sensor_.clock_divider();
    const double input_ps = 1e6 / (settings_.clock_mhz * (1 + settings_.clock_error_ppm * 1e-6));
    const auto period_ps = uint64_t(std::lround(divider * input_ps));
    const uint64_t now_ps = wires_.now_ps();
    if (!running_ && period_ps_ != 0) {
        const uint64_t clocks = (now_ps - stopped_at_ps_) / period_ps_;
        sensor_.skip(clocks, double(period_ps_) * 1e-6);
        stopped_at_ps_ += clocks * period_ps_;
    } else {
        stopped_at_ps_ = now_ps;
    }
    const bool runs = shown_ && period_ps != 0;
    if (runs != running_ || (runs && period_ps != period_ps_)) {
        wires_.set_clock(camera_, runs ? uint32_t(period_ps) : 0);
    }
    running_ = runs;
    period_ps_ = period_ps;
}

void SensorPort::on_clock(uint64_t time_ps, int camera, bool level) {
    (void)camera;
    if (level == sensor_.clock_inverted()) {
        return;
    }
    const Mt9t001::Output out = sensor_.clock(double(time_ps) * 1e-6, double(period_ps_) * 1e-6);
    bridge_inputs &in = wires_.in;
    if (out.frame_valid && in.frame_valid[camera_] == 0) {
        frame_begun_ps_ = time_ps;
    }
    const uint16_t pixel = out.pixel & uint16_t(~faults_.torn_bits);
    if (in.frame_valid[camera_] == uint8_t(out.frame_valid) &&
        in.line_valid[camera_] == uint8_t(out.line_valid) && in.pixel[camera_] == pixel) {
        return;
    }
    in.frame_valid[camera_] = out.frame_valid;
    in.line_valid[camera_] = out.line_valid;
    in.pixel[camera_] = pixel;
    wires_.drive();
}

void SensorPort::set_faults(const SensorFaults &faults) {
    faults_ = faults;
    if (faults.unplugged) {
        target_.reset();
        wires_.in.frame_valid[camera_] = wires_.in.line_valid[camera_] = 0;
        wires_.in.pixel[camera_] = 0;
    }
    wires_.in.branch_sda[camera_] = !target_.pulls() && !faults.sda_stuck;
    wires_.drive();
    update_clock();
}

}  // namespace simrig
