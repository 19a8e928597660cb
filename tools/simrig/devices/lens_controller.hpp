// SPDX-License-Identifier: Apache-2.0
/// The lens controller Image Labs V3LC, as far as it is known: 9600 baud, lines of ASCII. The
/// commands are those of its sibling V1LC (seen in public code); positions of 10 bits from 300 to
/// 850 are the paper's. How it addresses two lenses is not public: here by a leading digit.
///
///   [1|2]Znnn [1|2]Fnnn [1|2]Innn  moves zoom, focus or iris to a position; no answer
///   [1|2]?                         status: "V3LC n", "Zoom:nnnn", "Focus:nnnn", "Iris:nnnn", each
///                                  with CR, the last with CR LF
///   T255                           accepted without visible effect
///
/// Unknown commands and positions out of range get no answer.
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
    double bits_per_s = 9600;
    double answer_ms = 12;
    int lowest = 300, highest = 850;
};

class LensController {
  public:
    static constexpr size_t kLenses = 2;
    using Lens = std::array<LensMotor, kLensAxes>;

    LensController(const LensControllerSettings &settings, std::array<Lens, kLenses> lenses,
                   uint64_t seed);

    SerialLine &line() { return line_; }
    LensMotor &motor(size_t lens, LensAxis axis) { return lenses_[lens][axis]; }

  private:
    std::string command(double time_us, const std::string &text);
    std::string status(double time_us, size_t lens);

    LensControllerSettings settings_;
    std::array<Lens, kLenses> lenses_;
    SerialLine line_;
};

}  // namespace simrig

#endif
