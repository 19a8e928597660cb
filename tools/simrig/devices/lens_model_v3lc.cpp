// SPDX-License-Identifier: Apache-2.0
// The lens controller Image Labs V3LC, as far as it is known: 9600 baud, lines of ASCII. The
// commands are those of its sibling V1LC (seen in public code); positions of 10 bits from 300 to
// 850 are the paper's. How it addresses two lenses is not public: here by a leading digit.
//
//   [1|2]Znnn [1|2]Fnnn [1|2]Innn  moves zoom, focus or iris to a position; no answer
//   [1|2]?                         status: "V3LC n", "Zoom:nnnn", "Focus:nnnn", "Iris:nnnn", each
//                                  with CR, the last with CR LF
//   T255                           accepted without visible effect
//
// Unknown commands and positions out of range get no answer.
#include <cstdio>
#include <cstdlib>
#include <utility>

#include "tools/simrig/devices/lens_controller.hpp"

namespace simrig {

namespace {

class V3lc : public LensController {
  public:
    using LensController::LensController;

  private:
    std::string command(double time_us, const std::string &text) override {
        size_t at = 0, lens = 0;
        if (at < text.size() && (text[at] == '1' || text[at] == '2')) {
            lens = size_t(text[at] - '1');
            at++;
        }
        if (text.compare(at, std::string::npos, "?") == 0) {
            return status(time_us, lens);
        }
        const size_t axis =
            at < text.size() ? std::string("ZFI").find(text[at]) : std::string::npos;
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
            motors_[lens][axis].go(time_us, position);
        }
        return "";
    }

    std::string status(double time_us, size_t lens) {
        char text[80];
        std::snprintf(text, sizeof text, "V3LC %u\rZoom:%04d\rFocus:%04d\rIris:%04d\r\n",
                      unsigned(lens + 1), motors_[lens][kZoom].read(time_us),
                      motors_[lens][kFocus].read(time_us), motors_[lens][kIris].read(time_us));
        return text;
    }
};

}  // namespace

std::unique_ptr<LensController> make_lens_v3lc(const LensControllerSettings &settings,
                                               LensMotors motors, uint64_t seed) {
    return std::make_unique<V3lc>(settings, std::move(motors), seed);
}

}  // namespace simrig
