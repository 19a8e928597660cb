// SPDX-License-Identifier: Apache-2.0
// Squares that look wider or taller than they are: by the print, or by the pixels.
#include <cmath>

#include "calib/base/sentence.hpp"
#include "calib/solve/solve_verdict.hpp"

namespace calib {

namespace {

const double SURE = 3;           // standard errors by which a candidate is worse
const double ODD_PIXELS = 0.01;  // share by which fx and fy differ notably

// Whether the candidates whose pixels are not square all explain the corners worse.
bool pixels_are_square(const solution &found) {
    bool tried = false, worse = true;
    for (const model_score &score : found.scores) {
        if (!score.model.square_pixels && !score.target.stretched) {
            tried = true;
            worse = worse && score.worse_than_best > SURE * score.worse_than_best_sigma;
        }
    }
    return tried && worse;
}

}  // namespace

std::string stretch_of(const bundle &data, const bundle_state &state, const solution &found) {
    if (!found.target.stretched) {
        return "";
    }
    const double percent = 100 * print_stretch(data, state);
    const bool wide = state.warp_mm[board_model::STRETCH] > 0;
    return pixels_are_square(found)
               ? sentence(
                     "the print's rows are %.2f %% %s than drawn, relative to its columns "
                     "(pixels that are not square explain it worse): all lengths may be wrong "
                     "by half of that; measure --square along both",
                     percent, wide ? "longer" : "shorter")
               : sentence(
                     "squares are %.2f %% %s: by the print or by the pixels, which boards "
                     "turned by 90 degrees would show; all lengths may be wrong by half of "
                     "that; measure --square along both",
                     percent, wide ? "wider than tall" : "taller than wide");
}

std::string pixels_of(const bundle &data, const solution &found) {
    double most = 0;
    int camera = LEFT;
    for (int i = 0; i < data.cameras; i++) {
        const double off = found.camera[i].fy_px / found.camera[i].fx_px - 1;
        if (std::fabs(off) > std::fabs(most)) {
            most = off;
            camera = i;
        }
    }
    return std::fabs(most) < ODD_PIXELS
               ? ""
               : sentence(
                     "pixels of the %s are not square (squares look %.1f %% %s), which the "
                     "calibration takes into account: were the pictures resized to another "
                     "shape?",
                     camera_name(data, camera), 100 * std::fabs(most),
                     most > 0 ? "taller than wide" : "wider than tall");
}

const char *camera_name(const bundle &data, int camera) {
    static const char *const names[CAMERAS] = {"left camera", "right camera"};
    return data.cameras == 1 ? "camera" : names[camera];
}

}  // namespace calib
