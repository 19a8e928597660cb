// SPDX-License-Identifier: Apache-2.0
/// Marks in a picture for aiming, as viewfinders have them: edges in focus (focus peaking), clipped
/// highlights (zebra), parts too dark to show anything, and a cross in the middle.
#ifndef VERGENCE_DAEMON_IMAGES_PICTURE_MARKS_H
#define VERGENCE_DAEMON_IMAGES_PICTURE_MARKS_H

#include <stdint.h>

#include "daemon/images/picture.h"
#include "focus/focus_measure.h"

#ifdef __cplusplus
extern "C" {
#endif

/// Values of a picture with marks: grey levels up to PICTURE_MARK_GREYS - 1, then the marks; where
/// they overlap, the larger one is shown.
enum {
    PICTURE_MARK_GREYS = PICTURE_COLOURS - 4,
    PICTURE_MARK_DARK = PICTURE_MARK_GREYS,  ///< blue
    PICTURE_MARK_SHARP,                      ///< green
    PICTURE_MARK_SATURATED,                  ///< red stripes
    PICTURE_MARK_CROSS                       ///< yellow
};

/// Red, green and blue of these values.
void picture_marks_palette(uint8_t palette[PICTURE_COLOURS][3]);

/// Number of blocks of 2 x 2 pixels with each mark, and of all. `sharp` grows as edges get sharper:
/// a block counts by the square of its step's share of the range around it.
struct picture_marks {
    uint32_t sharp, saturated, dark, blocks;
};

/// Puts marks into a picture that picture_develop made of `raw` with one channel and this `shrink`,
/// whose values become those of picture_marks_palette.
///
/// A block of 2 x 2 pixels has an edge in focus if its two green (else: grey) pixels on the
/// diagonal differ by five standard deviations of their noise, and by a quarter of the range of the
/// values around it: an edge smeared over more than about 6 pixels, however strong, is not in
/// focus. This holds for thinned frames too, as a sensor skips pairs of pixels, and the two of a
/// block remain neighbours. Edges along this diagonal are not seen. `skip`: of the sensor, at
/// least 1.
///
/// Saturated: a value of 63/64 of full scale or more; dark: within two standard deviations of
/// black.
void picture_mark(const struct raw_image *raw, const struct focus_noise *noise, int skip,
                  int shrink, struct picture *picture, struct picture_marks *marks);

#ifdef __cplusplus
}
#endif

#endif
