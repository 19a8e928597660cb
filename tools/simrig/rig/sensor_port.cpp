// SPDX-License-Identifier: Apache-2.0
#include "tools/simrig/rig/sensor_port.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace simrig {

namespace {

// While a sensor's clock is hidden, it is shown this often; the bridge reports a clock as lost
// after 150 us at least.
constexpr uint64_t kLookPs = 140 * kPsPerUs;
// The bridge sees the clock at least so long before and after a frame.
constexpr uint64_t kLeadPs = 20 * kPsPerUs;

}  // namespace

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

// The pixel clock as registers, pins and faults make it now.
void SensorPort::update_clock() {
    const unsigned divider = faults_.silent || faults_.unplugged ? 0 : sensor_.clock_divider();
    const double input_ps = 1e6 / (settings_.clock_mhz * (1 + settings_.clock_error_ppm * 1e-6));
    const auto period_ps = uint64_t(std::lround(divider * input_ps));
    catch_up();
    if (live_ && sensor_.clocks_to_frame() == 0) {
        wires_.feed(camera_, {}, !sensor_.clock_inverted());  // a restart: the row is abandoned
    }
    if (period_ps != period_ps_) {
        period_ps_ = period_ps;
        if (wires_.resting()) {
            wires_.stop();  // the bridge has to see this
        }
        caught_up_ps_ = wires_.now_ps();
        if (live_ && period_ps != 0) {
            wires_.set_clock(camera_, uint32_t(period_ps));
        } else if (live_) {
            go_still(wires_.now_ps());
        }
    }
    next_look();
}

// Catches up with the time that passed while hidden.
void SensorPort::catch_up() {
    const uint64_t now_ps = wires_.now_ps();
    if (live_ || period_ps_ == 0) {
        caught_up_ps_ = now_ps;
        return;
    }
    const uint64_t clocks = (now_ps - caught_up_ps_) / period_ps_;
    sensor_.skip(clocks, us_of(period_ps_));
    caught_up_ps_ += clocks * period_ps_;
}

void SensorPort::go_live() {
    live_ = joined_late_ = true;
    blank_since_ps_ = wires_.now_ps();
    wires_.feed(camera_, {}, !sensor_.clock_inverted());
    wires_.set_clock(camera_, uint32_t(period_ps_));
    wires_.stop();  // every clock counts from now on
}

void SensorPort::go_still(uint64_t now_ps) {
    live_ = false;
    caught_up_ps_ = now_ps;
    wires_.feed(camera_, {}, !sensor_.clock_inverted());
    wires_.set_clock(camera_, 0);
    wires_.stop();
    next_look();
}

// While still: at every whole kLookPs, the right one's half of it later, so that one clock at a
// time runs; and just before a frame that is wanted.
void SensorPort::next_look() {
    if (live_ || period_ps_ == 0 || look_ps_ != 0) {
        return;
    }
    const uint64_t now_ps = wires_.now_ps(), later_ps = camera_ == 0 ? 0 : kLookPs / 2;
    look_ps_ = ((now_ps + later_ps) / kLookPs + 1) * kLookPs - later_ps;
    const uint64_t clocks = sensor_.clocks_to_frame();
    if (watched() && clocks < 2 * kLookPs / period_ps_) {
        look_ps_ = std::min(look_ps_, now_ps + std::max(clocks * period_ps_, kLeadPs) - kLeadPs);
    }
    wires_.at(look_ps_, [this] {
        look_ps_ = 0;
        if (live_ || period_ps_ == 0 || wires_.resting()) {
            return;
        }
        catch_up();
        if (watched() && sensor_.clocks_to_frame() <= kLeadPs / period_ps_ + 1) {
            go_live();
        } else {
            burst();
            next_look();
        }
    });
}

// The bridge's watch divides the clock by 16 and looks at changes: 16 clocks are one change,
// whatever came before; one more could make two changes, which look like none if the watch does not
// sample in between.
void SensorPort::burst() {
    constexpr uint64_t kClocks = 16;
    if (blank_since_ps_ == 0) {
        // It was reset, or its clock stopped, within a row. A frame left valid on the pins would
        // keep the bridge's gate closed forever.
        wires_.show(camera_, 0);
        blank_since_ps_ = wires_.now_ps();
    }
    wires_.set_clock(camera_, uint32_t(period_ps_));
    // The level may be high or low before; a quarter more ends both alike after 16 rising edges.
    wires_.at(wires_.now_ps() + kClocks * period_ps_ + period_ps_ / 4, [this] {
        if (!live_) {
            wires_.set_clock(camera_, 0);
        }
    });
}

bool SensorPort::may_go_still(uint64_t time_ps) const {
    const uint64_t clocks = sensor_.clocks_to_frame();
    return blank_since_ps_ != 0 && time_ps - blank_since_ps_ > kLeadPs && clocks != 0 &&
           (!watched() || clocks > 3 * kLookPs / period_ps_);
}

void SensorPort::on_clock(uint64_t time_ps, int camera) {
    (void)camera;
    if (!live_) {
        return;
    }
    if (may_go_still(time_ps)) {
        go_still(time_ps);
        return;
    }
    sensor_.run(us_of(time_ps), us_of(period_ps_), words_);
    const bool frame_valid = (words_[0] & Mt9t001::kFrameValid) != 0;
    if (frame_valid && sensor_.begins_frame()) {
        joined_late_ = false;
        frame_begun_ps_ = time_ps;
    }
    const unsigned shown = joined_late_ ? 0u : ~unsigned(faults_.torn_bits);
    if (shown != ~0u) {
        for (uint16_t &word : words_) {
            word = uint16_t(word & shown);
        }
    }
    // The last row's words end with those after frame valid's fall.
    const bool blank = (words_.back() & Mt9t001::kFrameValid) == 0;
    if (!blank) {
        blank_since_ps_ = 0;
    } else if (blank_since_ps_ == 0) {
        blank_since_ps_ = time_ps + words_.size() * period_ps_;
    }
    wires_.feed(camera_, words_, !sensor_.clock_inverted());
}

void SensorPort::set_faults(const SensorFaults &faults) {
    faults_ = faults;
    if (faults.unplugged) {
        target_.reset();
        wires_.show(camera_, 0);
    }
    wires_.in.branch_sda[camera_] = !target_.pulls() && !faults.sda_stuck;
    wires_.drive();
    update_clock();
}

}  // namespace simrig
