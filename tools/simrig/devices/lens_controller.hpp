// SPDX-License-Identifier: Apache-2.0
/// A controller of motorized lenses: its motors, and what commands them over a serial line or over
/// the board's I2C bus. Each model is a source lens_model_NAME.cpp here, which defines
/// make_lens_NAME(); the build finds it, and rig files name it as `model` of `lens_controller`.
#ifndef VERGENCE_SIMRIG_DEVICES_LENS_CONTROLLER_HPP
#define VERGENCE_SIMRIG_DEVICES_LENS_CONTROLLER_HPP

#include <array>
#include <cstdint>
#include <memory>
#include <string>

#include "tools/simrig/devices/lens_motor.hpp"
#include "tools/simrig/devices/serial_line.hpp"

namespace simrig {

enum LensAxis { kZoom = 0, kFocus = 1, kIris = 2, kLensAxes = 3 };

struct LensControllerSettings {
    std::string model = "v3lc";
    double bits_per_s = 9600;
    double answer_ms = 12;
    int lowest = 300, highest = 850;  ///< range of the rings
};

/// The motors of both lenses.
using LensMotors = std::array<std::array<LensMotor, kLensAxes>, 2>;

class LensController {
  public:
    LensController(const LensControllerSettings &settings, LensMotors motors, uint64_t seed);
    virtual ~LensController() = default;

    LensMotor &motor(size_t lens, LensAxis axis) { return motors_[lens][axis]; }
    /// Silent for a controller on I2C.
    SerialLine &line() { return line_; }

    /// Its address on the I2C bus; 0: it is not there. Registers of 16 bits.
    virtual uint8_t address() const { return 0; }
    virtual void write(double time_us, uint8_t index, uint16_t value);
    virtual uint16_t read(double time_us, uint8_t index);

  protected:
    /// A line that was received, without its end. Returns the answer.
    virtual std::string command(double time_us, const std::string &text);

    const LensControllerSettings settings_;
    LensMotors motors_;

  private:
    SerialLine line_;
};

/// Throws std::runtime_error for an unknown model.
std::unique_ptr<LensController> make_lens_controller(const LensControllerSettings &settings,
                                                     LensMotors motors, uint64_t seed);

}  // namespace simrig

#endif
