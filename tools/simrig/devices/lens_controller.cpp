// SPDX-License-Identifier: Apache-2.0
#include "tools/simrig/devices/lens_controller.hpp"

#include <stdexcept>
#include <utility>

namespace simrig {

LensController::LensController(const LensControllerSettings &settings, LensMotors motors,
                               uint64_t seed)
    : settings_(settings),
      motors_(std::move(motors)),
      line_(
          settings.bits_per_s, settings.answer_ms,
          [this](double time_us, const std::string &text) { return command(time_us, text); },
          seed) {}

void LensController::write(double, uint8_t, uint16_t) {}

uint16_t LensController::read(double, uint8_t) {
    return 0;
}

std::string LensController::command(double, const std::string &) {
    return "";
}

// SIMRIG_LENS_MODELS is X(NAME) for each source lens_model_NAME.cpp.
#define X(name) decltype(make_lens_controller) make_lens_##name;
SIMRIG_LENS_MODELS
#undef X

std::unique_ptr<LensController> make_lens_controller(const LensControllerSettings &settings,
                                                     LensMotors motors, uint64_t seed) {
    std::string names;
#define X(name)                                                     \
    if (settings.model == #name) {                                  \
        return make_lens_##name(settings, std::move(motors), seed); \
    }                                                               \
    names += " " #name;
    SIMRIG_LENS_MODELS
#undef X
    throw std::runtime_error("unknown lens controller '" + settings.model +
                             "' (expected one of:" + names + ")");
}

}  // namespace simrig
