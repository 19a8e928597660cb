// SPDX-License-Identifier: Apache-2.0
/// Uncertainty of a solution: standard deviations that follow from the corners' noise, as estimated
/// from the residuals, by linear propagation. Where p1 and p2 are left out they count as if they
/// were estimated. Other model errors are not covered unless the board positions reveal them; see
/// `fit_test`.
#ifndef VERGENCE_CALIB_SOLVE_UNCERTAINTY_HPP
#define VERGENCE_CALIB_SOLVE_UNCERTAINTY_HPP

#include <vector>

#include "calib/base/solution.hpp"
#include "calib/bundle/bundle.hpp"

namespace calib {

/// Joint covariance of what all boards share (lenses, rig, warp) and of the motion of the boards'
/// frame: the mean over the boards of their own increments. Two solutions of the same scene also
/// differ by such a motion, which must not be mistaken for an error of the lens.
class error_model {
  public:
    /// `state` must be the least-squares solution of `data` under `options`.
    error_model(const bundle &data, const bundle_options &options, const bundle_state &state);

    /// Multiplies every standard deviation but `sigma0`.
    void widen(double factor);

    /// All lengths may be wrong by this common share.
    void doubt_scale(double share);

    double sigma0() const { return sigma0_; }

    /// Do the board positions contradict each other? See `board_scatter.hpp`.
    double scatter_z() const { return scatter_z_; }
    double scatter_ratio() const { return scatter_ratio_; }
    /// Replaces the covariance by the mean of two: itself, widened by the ratio, and the one from
    /// the scatter of the positions. The first covers all directions, the second shows which of
    /// them are affected.
    void use_scatter();

    /// True when an estimated parameter is not determined by these views.
    bool is_singular() const { return singular_; }

    /// Standard deviation of one lens parameter, in its own unit; 0 when it was not estimated,
    /// except for p1 and p2: without them the model is simpler, but the lens may not be.
    double lens_sigma(int camera, int parameter) const;
    /// Of the increments of T_right_left (`bundle.hpp`): rotation in rad, then shift in mm.
    double rig_sigma(int parameter) const;
    double baseline_sigma_mm() const;

    /// Covariance {xx, xy, yy} in px^2 of where a camera shows the point that it shows at
    /// `pixel_px` and `distance_mm` from the camera (INFINITY for a direction), with the boards
    /// fixed. Returns false where the pixel has no ray. Source: mrcal documentation, "Projection
    /// uncertainty", mean of frames.
    bool projection_covariance(int camera, const double pixel_px[2], double distance_mm,
                               double covariance_px2[3]) const;

    /// Standard deviation in mm of the depth (left z) that the pair measures for a point at
    /// `depth_mm` on the left pixel's ray, when both pixels are exact: the calibration's share.
    /// Returns false for one camera, where the pixel has no ray, or where the right camera cannot
    /// see it.
    bool depth_sigma(const double left_pixel_px[2], double depth_mm, double *sigma_mm) const;

    /// Likewise of the length between two points in the left camera's frame.
    bool length_sigma(const double first_mm[3], const double second_mm[3], double *sigma_mm) const;

  private:
    // Derivatives of a point in the left frame, seen at fixed pixels, by the shared parameters.
    bool point_rows(const double in_left_mm[3], std::vector<double> (&rows)[3]) const;
    double variance(const std::vector<double> &row) const;
    double covariance(const std::vector<double> &a, const std::vector<double> &b) const;
    // Rows of derivatives of one camera's pixel by the shared parameters, and by a point in the
    // left frame (only its rotation when `far`).
    bool pixel_rows(int camera, const double in_left_mm[3], bool far,
                    std::vector<double> (&rows)[2], double by_left[2][3]) const;

    bundle_state state_;
    lens_frame frame_[CAMERAS];
    int cameras_;
    double sigma0_ = 0;
    bool singular_ = false;
    double scatter_z_ = 0, scatter_ratio_ = 1;
    std::vector<double> covariance_;  // SIZE x SIZE, 0 for parameters that were not estimated
    std::vector<double> scattered_;   // likewise, from the scatter of the positions
};

}  // namespace calib

#endif
