// SPDX-License-Identifier: Apache-2.0
/// The lens as the solver sees it: every parameter is scaled by its effect in pixels, so that one
/// step size suits focal lengths from 500 to 30,000 px. The core's k2 of a 10x zoom is about 370
/// and moves the image corner by less than a pixel; `RADIAL_4` below is that movement.
#ifndef VERGENCE_CALIB_BASE_LENS_SCALE_HPP
#define VERGENCE_CALIB_BASE_LENS_SCALE_HPP

#include <array>

#include "stereo/geometry/lens.h"

namespace calib {

/// Indices of the parameters in a `lens_state`.
enum lens_parameter {
    LOG_FOCAL,     // log of fx in px
    LOG_ASPECT,    // log of fy / fx
    CENTRE_X,      // principal point from the middle of the image, px
    CENTRE_Y,      //
    RADIAL_2,      // k1: px by which it moves a point at the reference radius outwards
    RADIAL_4,      // k2: likewise
    TANGENTIAL_1,  // p1: px at the reference radius
    TANGENTIAL_2,  // p2: likewise
    RADIAL_6,      // k3: like RADIAL_2
    K4,            // k4 of a rational lens: px by which it alone moves a point at the reference
                   // radius inwards; of an equidistant one: like RADIAL_2
    K5,            // k5 and k6 of a rational lens: likewise
    K6,
    LENS_PARAMETERS,
};

/// Radii count as the lens's kind does: of an equidistant lens they are focal length times angle.
struct lens_state {
    std::array<double, LENS_PARAMETERS> value{};
    lens_kind kind = LENS_BROWN_CONRADY;
};

/// Constants of a solution. The reference radius is half of the image's diagonal.
struct lens_frame {
    int width_px = 0, height_px = 0;
    double middle_x_px = 0, middle_y_px = 0, radius_px = 1;
};

lens_frame make_lens_frame(int width_px, int height_px);

/// Converts between the solver's parameters and the core's. `lens_from_state` does not check
/// ranges.
lens lens_from_state(const lens_frame &frame, const lens_state &state);
lens_state state_from_lens(const lens_frame &frame, const lens &lens);

/// The lens of another kind whose image is closest, by least squares over the image's rays within
/// 80 degrees of the axis; with the same focal length and centre.
lens_state converted(const lens_frame &frame, const lens_state &state, lens_kind kind);

/// Pixel of a point in the camera's frame (z > 0), and its derivatives.
struct projection {
    double pixel_px[2];
    double by_point[2][3];               // px per mm
    double by_lens[2][LENS_PARAMETERS];  // px per unit of each parameter of the state
};

/// Returns false (result untouched) when z <= 0 (for an equidistant lens: when the point is the
/// camera's centre), behind a pole of a rational lens, or when the pixel overflows, as after a wild
/// step of a solver.
bool project(const lens_frame &frame, const lens_state &state, const double point_mm[3],
             projection *result);

/// The pixel alone.
bool project(const lens_frame &frame, const lens_state &state, const double point_mm[3],
             double pixel_px[2]);

/// Which lens parameters are estimated. Each kind of distortion includes those before it, except
/// EQUIDISTANT.
struct lens_model {
    enum kind { NONE, K1, K1_K2, K1_K2_P1_P2, K1_K2_P1_P2_K3, RATIONAL, EQUIDISTANT, KINDS };
    kind distortion = K1_K2_P1_P2;
    bool square_pixels = true;

    lens_kind lens() const;
    bool estimates(int parameter) const;
    int count() const;
};

/// What is estimated of the board: how it is bent out of its plane, and by how much its print is
/// longer along the rows than across. (Pixels of digital cameras are square to some 1e-4, prints
/// often are not to 1e-3: a stretched print seen from one side only looks like pixels that are not
/// square.)
struct board_model {
    enum { BEND_X, BEND_Y, TWIST, STRETCH, PARAMETERS };
    bool bent = false, stretched = false;

    bool estimates(int parameter) const { return parameter == STRETCH ? stretched : bent; }
    int count() const { return (bent ? 3 : 0) + (stretched ? 1 : 0); }
};

/// "k1 k2 p1 p2", "no distortion", ...; "free fy" is added for pixels that are not square.
const char *lens_model_name(lens_model model);

/// "flat", "bent", "flat, print stretched" or "bent, print stretched".
const char *board_model_name(board_model model);

}  // namespace calib

#endif
