// SPDX-License-Identifier: Apache-2.0
// Prints the zoom calibration of synthetic/zoom_rig.hpp, for tests of the shipped programs.
#include <cstdio>
#include <vector>

#include "synthetic/zoom_rig.hpp"

int main() {
    std::vector<char> text(ZOOM_TEXT_MAX_BYTES);
    const int length =
        zoom_calibration_print(zoom_rig::calibration().get(), text.data(), text.size());
    return length > 0 && std::fwrite(text.data(), 1, static_cast<size_t>(length), stdout) ==
                             static_cast<size_t>(length)
               ? 0
               : 1;
}
