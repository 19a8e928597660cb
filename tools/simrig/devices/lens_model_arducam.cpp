// SPDX-License-Identifier: Apache-2.0
// Arducam's controller of a zoom lens, the left one, as its maker's public code uses it: I2C,
// registers of 16 bits.
//
//   0x00 zoom, 0x01 focus   written: moves there; read: the last position written
//   0x04                    1 while a motor runs, else 0
//   0x0A zoom, 0x0B focus   written: moves to the first position
//
// The steppers have no position sensors: a jam shows only as a position that is wrong. Assumed
// here: it knows the positions at power-up, and ignores what is written while a motor runs or is
// out of range.
#include <cmath>
#include <utility>

#include "tools/simrig/devices/lens_controller.hpp"

namespace simrig {

namespace {

constexpr uint8_t kAddress = 0x0C, kBusy = 0x04, kReset = 0x0A;
constexpr size_t kMotors = 2;
constexpr double kFirst[kMotors] = {3000, 0}, kLast[kMotors] = {20000, 20000};

class Arducam : public LensController {
  public:
    Arducam(const LensControllerSettings &settings, LensMotors motors, uint64_t seed)
        : LensController(settings, std::move(motors), seed) {
        for (size_t i = 0; i < kMotors; i++) {
            const double part = (motors_[0][i].ring(0) - settings.lowest) / span();
            positions_[i] = uint16_t(std::lround(kFirst[i] + part * (kLast[i] - kFirst[i])));
        }
    }

    uint8_t address() const override { return kAddress; }

    void write(double time_us, uint8_t index, uint16_t value) override {
        const bool reset = index >= kReset;
        const size_t motor = reset ? size_t(index - kReset) : index;
        if (motor >= kMotors || busy(time_us)) {
            return;
        }
        const double position = reset ? kFirst[motor] : value;
        if (position >= kFirst[motor] && position <= kLast[motor]) {
            const double part = (position - kFirst[motor]) / (kLast[motor] - kFirst[motor]);
            positions_[motor] = uint16_t(position);
            motors_[0][motor].step_to(time_us, settings_.lowest + part * span());
        }
    }

    uint16_t read(double time_us, uint8_t index) override {
        if (index < kMotors) {
            return positions_[index];
        }
        return index == kBusy ? busy(time_us) : 0;
    }

  private:
    double span() const { return settings_.highest - settings_.lowest; }
    bool busy(double time_us) {
        return motors_[0][kZoom].moving(time_us) || motors_[0][kFocus].moving(time_us);
    }

    uint16_t positions_[kMotors];
};

}  // namespace

std::unique_ptr<LensController> make_lens_arducam(const LensControllerSettings &settings,
                                                  LensMotors motors, uint64_t seed) {
    return std::make_unique<Arducam>(settings, std::move(motors), seed);
}

}  // namespace simrig
