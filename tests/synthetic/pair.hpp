// SPDX-License-Identifier: Apache-2.0
/// Images of a scene through the two cameras of a rig, with the truth of every pixel.
#ifndef VERGENCE_TESTS_SYNTHETIC_PAIR_HPP
#define VERGENCE_TESTS_SYNTHETIC_PAIR_HPP

#include <cstdint>
#include <vector>

#include "stereo/image/image.h"
#include "synthetic/camera.hpp"
#include "synthetic/scene.hpp"

namespace synthetic {

/// Response of a sensor to a reflectance r: clip(gain r^gamma + offset), noise, rounding.
struct Sensor {
    int bits = 8;
    double gain = 1;
    double offset = 0;  // share of full scale
    double gamma = 1;
    double noise_grey = 0;           // sigma of additive noise in 1/255 of full scale
    double full_well_electrons = 0;  // > 0: photon noise of that many electrons at full scale
};

struct RenderOptions {
    Sensor left, right;
    int samples = 3;    // samples * samples points per pixel; 1: the pixel's centre only
    uint64_t seed = 1;  // seed of the noise
};

enum class Visibility : uint8_t {
    Visible,   // seen by both cameras
    Occluded,  // something nearer hides it from the other camera
    Outside,   // the point is beyond the border of the other camera's image
    Nothing,   // the ray hits no surface
};

/// Truth of one view. Rows of `width` values.
struct ViewTruth {
    std::vector<double> disparity_px;  // x_left - x_right; NaN where nothing is hit
    std::vector<double> vertical_px;   // y_right - y_left
    std::vector<Visibility> visibility;
    std::vector<int> surface;  // index, -1: none
};

struct Pair {
    Rig rig;
    int width, height;
    int bits;
    std::vector<uint16_t> left, right;
    ViewTruth left_truth, right_truth;

    size_t index(int x, int y) const {
        return static_cast<size_t>(y) * static_cast<size_t>(width) + static_cast<size_t>(x);
    }
};

/// Renders both views and their truth. Both cameras must have the same size.
Pair render(const Scene &scene, const Rig &rig, const RenderOptions &options);

/// The image a camera sees (no truth).
std::vector<uint16_t> render_view(const Scene &scene, const Camera &camera, const Sensor &sensor,
                                  int samples, uint64_t seed);

/// Truth of `camera` against the `other` one; `is_left` gives the disparity its sign.
ViewTruth truth_of(const Scene &scene, const Camera &camera, const Camera &other, bool is_left);

/// True where no pixel within `radius` (square window, inside the image) shows another surface.
std::vector<bool> inner_pixels(const Pair &pair, const ViewTruth &truth, int radius);

/// 8 bit copy of an image of `bits` bits, with rows of `stride` >= width values; the gap is filled
/// with a pattern that no algorithm should read.
std::vector<uint8_t> as_u8(const std::vector<uint16_t> &image, int width, int height, int bits,
                           int stride);

/// Swaps the views and flips both left to right: the same surface seen in a mirror.
Pair mirrored(const Pair &pair);

}  // namespace synthetic

#endif
