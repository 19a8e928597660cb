// SPDX-License-Identifier: Apache-2.0
#include "tools/simrig/devices/lens_controller.hpp"

#include <cstdio>
#include <cstdlib>
#include <utility>

namespace simrig {

LensController::LensController(const LensControllerSettings &settings,
                               std::array<Lens, kLenses> lenses, uint64_t seed)
    : settings_(settings),
      lenses_(std::move(lenses)),
      line_(
          settings.bits_per_s, settings.answer_ms,
          [this](double time_us, const std::string &text) { return command(time_us, text); },
          seed) {}

std::string LensController::command(double time_us, const std::string &text) {
    size_t at = 0, lens = 0;
    if (at < text.size() && (text[at] == '1' || text[at] == '2')) {
        lens = size_t(text[at] - '1');
        at++;
    }
    if (text.compare(at, std::string::npos, "?") == 0) {
        return status(time_us, lens);
    }
    const size_t axis = at < text.size() ? std::string("ZFI").find(text[at]) : std::string::npos;
    if (axis == std::string::npos) {
        return "";
    }
    const std::string digits = text.substr(at + 1);
    if (digits.empty() || digits.size() > 4 ||
        digits.find_first_not_of("0123456789") != std::string::npos) {
        return "";
    }
    const int position = std::atoi(digits.c_str());
    if (position >= settings_.lowest && position <= settings_.highest) {
        lenses_[lens][axis].go(time_us, position);
    }
    return "";
}

std::string LensController::status(double time_us, size_t lens) {
    char text[80];
    std::snprintf(text, sizeof text, "V3LC %u\rZoom:%04d\rFocus:%04d\rIris:%04d\r\n",
                  unsigned(lens + 1), lenses_[lens][kZoom].read(time_us),
                  lenses_[lens][kFocus].read(time_us), lenses_[lens][kIris].read(time_us));
    return text;
}

}  // namespace simrig
