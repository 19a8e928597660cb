// SPDX-License-Identifier: Apache-2.0
#include "tools/simrig/rig/rig.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "bridge_registers.h"

namespace simrig {

namespace {

// Only the newest edges of the IRQ line are kept.
constexpr size_t kEdgesKept = 4096;
constexpr uint64_t kResetPs = 10 * kPsPerUs;
constexpr uint64_t kPsPerS = 1000000 * kPsPerUs;
constexpr uint64_t kLongestPeriodPs = 30000 * kPsPerUs;

LensMotors make_motors(const RigSettings &settings) {
    const auto motor = [&settings](size_t lens, size_t axis) {
        return LensMotor(settings.lens[lens].motor[axis], settings.lens[lens].position[axis],
                         settings.seed * 64 + 16 + lens * kLensAxes + axis, settings.begin_s * 1e6);
    };
    const auto lens = [&motor](size_t number) {
        return LensMotors::value_type{motor(number, 0), motor(number, 1), motor(number, 2)};
    };
    return {lens(0), lens(1)};
}

// Rounds up to whole picoseconds.
uint64_t ps_of(double time_us) {
    const double whole_us = std::floor(time_us);
    return uint64_t(whole_us) * kPsPerUs +
           uint64_t(std::ceil((time_us - whole_us) * double(kPsPerUs)));
}

// Whether it writes a register on which the servos' pulses depend.
bool may_move_servos(const I2cMessage &message) {
    if (message.read || message.address != BRIDGE_I2C_ADDRESS || message.bytes.size() < 3) {
        return false;
    }
    const size_t first = message.bytes[0], last = first + (message.bytes.size() - 1) / 2 - 1;
    return first <= BRIDGE_SERVO1_FRAMES && last >= BRIDGE_SERVO_PERIOD_US;
}

}  // namespace

Rig::Rig(const RigSettings &settings, Scenery scenery)
    : settings_(settings),
      scenery_(std::move(scenery)),
      wires_(uint32_t(settings.seed), settings.begin_s * kPsPerS),
      host_(wires_),
      ppi_(wires_),
      servos_{Servo(settings.servo[0], settings.seed * 64),
              Servo(settings.servo[1], settings.seed * 64 + 1)},
      lenses_(make_lens_controller(settings.lens_controller, make_motors(settings),
                                   settings.seed * 64 + 2)),
      lens_target_(
          lenses_->address(),
          [this](uint8_t index, uint16_t value) { lenses_->write(now_us(), index, value); },
          [this](uint8_t index) { return lenses_->read(now_us(), index); }) {
    if (lenses_->address() != 0) {
        host_.attach(lens_target_);
    }
    for (int camera = 0; camera < BRIDGE_CAMERAS; camera++) {
        const auto source = [this, camera](const SensorFrame &frame, double begin_us) {
            return picture(camera, frame, begin_us);
        };
        auto port =
            std::make_unique<SensorPort>(wires_, camera, settings.sensor[size_t(camera)], source);
        // Render only what reaches the armed port.
        SensorPort *sensor = port.get();
        sensor->sensor().wanted = [this, sensor] {
            return ppi_.taking_since_ps() != 0 &&
                   ppi_.taking_since_ps() >= sensor->frame_begun_ps();
        };
        sensor->watched = [this, camera] { return watched(camera); };
        sensors_[size_t(camera)] = std::move(port);
    }
    wires_.listen(*this);
    set_bridge_reset(true);
    wires_.run(kResetPs);
    set_bridge_reset(false);
}

void Rig::on_servo(size_t i, uint64_t time_ps, bool high) {
    Pulse &pulse = pulses_[i];
    servos_[i].edge(us_of(time_ps), high);
    if (high && !pulse.high) {
        const uint64_t period_ps = time_ps - pulse.rise_ps;
        pulse.period_ps = period_ps < kLongestPeriodPs ? period_ps : 0;
        pulse.rise_ps = time_ps;
        if (quiet_) {
            wires_.stop();  // its end must be predicted: see run_quietly()
        }
    } else if (!high && pulse.high) {
        const uint64_t width_ps = time_ps - pulse.rise_ps;
        pulse.change_ps = std::max(width_ps, pulse.width_ps) - std::min(width_ps, pulse.width_ps);
        pulse.width_ps = width_ps;
    }
    pulse.high = high;
}

void Rig::on_pins(uint64_t time_ps, uint32_t groups, const bridge_outputs &now) {
    if ((groups & BRIDGE_EVENT_SERVO) != 0) {
        for (size_t i = 0; i < servos_.size(); i++) {
            on_servo(i, time_ps, now.servo[i] != 0);
        }
    }
    if ((groups & BRIDGE_EVENT_IRQ) != 0 && (now.irq != 0) != irq_) {
        irq_ = now.irq != 0;
        if (irq_edges_.size() == kEdgesKept) {
            irq_edges_.erase(irq_edges_.begin());
        }
        irq_edges_.push_back({us_of(time_ps), irq_});
        if (wake_on_irq_) {
            woken_by_irq_ = true;
            wires_.stop();
        }
    }
}

// In idle time a clock lasts a microsecond, and edges come later by clocks: what the servos see of
// their pulses is exact to 40 ns only when both edges of a pulse come at full rate. They can be
// foreseen from those before, but for the one or two pulses after a write, of any width.
Rig::Span Rig::next_edge(const Pulse &pulse, uint64_t now_ps) const {
    constexpr uint64_t kGuardPs = 3 * kPsPerUs;
    Span span;
    if (pulse.high && pulse.width_ps != 0) {
        const bool foreseen = pulse.rise_ps > written_ps_ + pulse.period_ps;
        const uint64_t guard_ps =
            foreseen ? std::min(2 * pulse.change_ps + kGuardPs, pulse.width_ps) : pulse.width_ps;
        span = {pulse.rise_ps + pulse.width_ps - guard_ps,
                pulse.rise_ps + pulse.width_ps + guard_ps};
    } else if (!pulse.high && pulse.period_ps != 0) {
        const uint64_t rise_ps = pulse.rise_ps + pulse.period_ps;
        span = {rise_ps - kGuardPs, rise_ps + kGuardPs};
    }
    return now_ps <= span.end_ps ? span : Span();
}

void Rig::run_quietly(uint64_t until_ps) {
    quiet_ = true;
    while (wires_.now_ps() < until_ps && !woken_by_irq_ && !(wake_on_frame_ && ppi_.done())) {
        const uint64_t now_ps = wires_.now_ps();
        if (live()) {
            wires_.run_until(until_ps);
            continue;
        }
        uint64_t fine_ps = std::numeric_limits<uint64_t>::max();
        for (const Pulse &pulse : pulses_) {
            fine_ps = std::min(fine_ps, next_edge(pulse, now_ps).begin_ps);
        }
        if (now_ps + kPsPerUs < std::min(fine_ps, until_ps)) {
            wires_.set_idle(true);
            run_idle(std::min(until_ps, fine_ps - kPsPerUs));
            wires_.set_idle(false);
        } else {
            wires_.run_until(std::min(until_ps, now_ps + kPsPerUs));
        }
    }
    quiet_ = false;
}

// When no camera's frames are wanted, their clocks rest too, except shortly before they may be
// wanted.
void Rig::run_idle(uint64_t end_ps) {
    constexpr uint64_t kShowPs = 200 * kPsPerUs, kShortestPs = 3 * kShowPs, kStepPs = 10 * kPsPerUs;
    unsigned alive = 0;
    for (unsigned i = 0; i < sensors_.size(); i++) {
        alive |= sensors_[i]->period_ps() != 0 ? 1u << i : 0u;
    }
    const bool wanted = watched(BRIDGE_LEFT) || watched(BRIDGE_RIGHT);
    while (!wanted && now_ps() + kShortestPs < end_ps) {
        if (wires_.may_rest(alive)) {
            wires_.set_resting(true);
            wires_.run_until(end_ps - kShowPs);
            wires_.set_resting(false);
            for (const auto &sensor : sensors_) {
                sensor->look();
            }
        } else {
            wires_.run_until(now_ps() + kStepPs);
        }
        if (wires_.stopped()) {
            return;
        }
    }
    wires_.run_until(end_ps);
}

uint32_t Rig::advance(double until_us, uint32_t wake) {
    wake_on_irq_ = (wake & kWakeGpio) != 0;
    wake_on_frame_ = (wake & kWakeFrame) != 0;
    woken_by_irq_ = false;
    const size_t edges = irq_edges_.size();
    uint32_t woken = 0;
    SerialLine &line = lenses_->line();
    const uint64_t until_ps = ps_of(until_us);
    while (woken == 0 && now_ps() < until_ps) {
        // Bytes that no request waits for must not stop the clock.
        const bool unwanted = line.next_ps() <= now_ps() && (wake & kWakeSerial) == 0;
        run_quietly(unwanted ? until_ps : std::min(until_ps, line.next_ps()));
        line.advance(now_ps());
        woken |= irq_edges_.size() != edges ? wake & kWakeGpio : 0u;
        woken |= line.next_ps() <= now_ps() ? wake & kWakeSerial : 0u;
        woken |= ppi_.done() ? wake & kWakeFrame : 0u;
    }
    wake_on_irq_ = false;
    return woken;
}

I2cResult Rig::i2c(unsigned speed_hz, std::vector<I2cMessage> &messages) {
    const I2cResult result = host_.transfer(speed_hz, messages);
    for (const I2cMessage &message : messages) {
        if (may_move_servos(message)) {
            written_ps_ = wires_.now_ps();
        }
    }
    return result;
}

void Rig::set_bridge_reset(bool reset) {
    wires_.in.reset = reset;
    wires_.drive();
}

std::vector<GpioEdge> Rig::take_irq_edges() {
    return std::exchange(irq_edges_, {});
}

bool Rig::watched(int camera) const {
    return settings_.every_clock ||
           (ppi_.armed() && !ppi_.done() && (wires_.watched() >> camera & 1u) != 0);
}

void Rig::look() {
    for (const auto &sensor : sensors_) {
        sensor->look();
    }
}

bool Rig::live() const {
    return sensors_[0]->live() || sensors_[1]->live();
}

void Rig::arm_frame(unsigned columns, unsigned rows) {
    ppi_.arm(columns, rows);
    look();
}

void Rig::cancel_frame() {
    ppi_.cancel();
}

bool Rig::wait_frame(double deadline_us) {
    while (!ppi_.done() && now_us() < deadline_us) {
        advance(deadline_us, kWakeFrame);
    }
    return ppi_.done();
}

void Rig::release_board() {
    cancel_frame();
    set_bridge_reset(false);
    irq_edges_.clear();
}

// Motion is known up to now and predicted from the commands so far; earlier times use the present
// state.
CameraState Rig::state_at(int camera, double time_us) {
    const auto at = std::max(time_us, now_us());
    Servo servo = servos_[size_t(camera)];
    // In steps of ten seconds, so that most frames are of a camera at rest.
    constexpr double kStepUs = 10e6, kUsPerH = 3600e6;
    const double since_us = std::floor((at - settings_.begin_s * 1e6) / kStepUs) * kStepUs;
    const double warm =
        settings_.warm_up_h == 0 ? 0 : -std::expm1(-since_us / kUsPerH / settings_.warm_up_h);
    const auto ring = [this, camera, at](LensAxis axis) {
        LensMotor motor = lenses_->motor(size_t(camera), axis);
        return motor.ring(at);
    };
    return {servo.angle_deg(at), ring(kZoom), ring(kFocus), ring(kIris), warm};
}

std::vector<uint16_t> Rig::picture(int camera, const SensorFrame &frame, double begin_us) {
    return scenery_(camera, frame, begin_us,
                    [this, camera](double time_us) { return state_at(camera, time_us); });
}

}  // namespace simrig
