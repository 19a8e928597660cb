// SPDX-License-Identifier: Apache-2.0
/// Why a pixel has or does not have a disparity.
#ifndef VERGENCE_STEREO_IMAGE_REASON_H
#define VERGENCE_STEREO_IMAGE_REASON_H

#include <stdbool.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

// X(name, number, text)
#define REASON_LIST(X)                                                                    \
    X(VALID, 0, "valid")                                                                  \
    X(BORDER, 1, "border: outside what one of the cameras sees")                          \
    X(OCCLUDED, 2,                                                                        \
      "occluded: hidden from one camera, or left and right disagree for want of texture") \
    X(NO_TEXTURE, 3, "no texture: nothing to match")                                      \
    X(AMBIGUOUS, 4, "ambiguous: another disparity fits as well")                          \
    X(SPECKLE, 5, "speckle: a small island, isolated from its neighbourhood")             \
    X(OUT_OF_RANGE, 6, "out of range: no match within the depths searched or requested")  \
    X(FILLED, 7, "filled: not measured, continued from the surface around")               \
    X(BEYOND, 8, "beyond infinity: a disparity without a depth")

enum reason {
#define REASON_ENUM(name, number, text) REASON_##name = (number),
    REASON_LIST(REASON_ENUM)
#undef REASON_ENUM
        REASON_COUNT
};

/// Whether a pixel with this reason has a point of the surface.
static inline bool reason_has_point(uint8_t reason) {
    return reason == REASON_VALID || reason == REASON_FILLED;
}

/// Whether a pixel with this reason has a measured disparity.
static inline bool reason_has_disparity(uint8_t reason) {
    return reason == REASON_VALID || reason == REASON_BEYOND;
}

/// Text of a reason; "unknown" for any other number. Static storage.
const char *reason_text(int reason);

#ifdef __cplusplus
}
#endif

#endif
