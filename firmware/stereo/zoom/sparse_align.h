// SPDX-License-Identifier: Apache-2.0
/// Alignment of a small window of one picture with another picture, to a fraction of a pixel (Lucas
/// and Kanade, IJCAI 1981, with the gradient of the fixed window).
#ifndef VERGENCE_STEREO_ZOOM_SPARSE_ALIGN_H
#define VERGENCE_STEREO_ZOOM_SPARSE_ALIGN_H

#include <stdbool.h>

#include "stereo/image/image.h"

#ifdef __cplusplus
extern "C" {
#endif

/// Moves `right_px` to where the right picture agrees best with the window around (x, y) of the
/// left one; brightness and contrast may differ, and the surface may be aslant: the shift along x
/// may grow by 2 px from the window's middle to its edge. False if a window leaves its picture, if
/// it does not converge within 4 px of the start, or if the windows are not alike.
bool sparse_align(const struct image_u8 *left, double x, double y, const struct image_u8 *right,
                  double right_px[2]);

#ifdef __cplusplus
}
#endif

#endif
