// SPDX-License-Identifier: Apache-2.0
#include "console/pair/calibration_fit.h"

#include "core/invariant.h"
#include "device/mt9t001.h"

struct lens calibration_fit_lens(const struct lens *lens, const struct pair_window *window,
                                 int width_px, int height_px) {
    INVARIANT(window->skip >= 1);
    // Pixel u of the frame is at column + skip u of the sensor if u is even, and skip - 1 before
    // that if it is odd; their mean is (skip - 1) / 2 before.
    const double skip = window->skip;
    const double middle = (skip - 1) / 2;
    struct lens cut = *lens;
    cut.width_px = width_px;
    cut.height_px = height_px;
    cut.fx_px = lens->fx_px / skip;
    cut.fy_px = lens->fy_px / skip;
    cut.cx_px = (lens->cx_px - window->column_px + middle) / skip;
    cut.cy_px = (lens->cy_px - window->row_px + middle) / skip;
    return cut;
}

enum calibration_fit calibration_fit_side(struct calibration *calibration, int side,
                                          const struct pair_frame *frame) {
    struct lens *lens = side == RIG_LEFT ? &calibration->left : &calibration->right;
    const struct pair_window *window = &frame->window;
    const int width_px = frame->image.width_px, height_px = frame->image.height_px;
    if (lens->width_px == width_px && lens->height_px == height_px) {
        return CALIBRATION_FITS;
    }
    if (window->skip == 0 || lens->width_px != MT9T001_WIDTH_PX ||
        lens->height_px != MT9T001_HEIGHT_PX) {
        return CALIBRATION_OTHER;
    }
    *lens = calibration_fit_lens(lens, window, width_px, height_px);
    calibration->origin.side[side].window =
        (struct calibration_window){window->column_px, window->row_px, window->skip};
    return CALIBRATION_CUT;
}
