// SPDX-License-Identifier: Apache-2.0
/// A motorized zoom lens by the formulas of a thin lens, independent of the simulated rig's
/// renderer. Lengths in mm; blur diameters in pixels of the full array; positions are those of the
/// rings.
#ifndef VERGENCE_TESTS_FOCUS_LENS_TRUTH_HPP
#define VERGENCE_TESTS_FOCUS_LENS_TRUTH_HPP

#include <algorithm>
#include <cmath>

namespace focus {

constexpr double kRingLow = 300, kRingHigh = 850, kRingSpan = kRingHigh - kRingLow;
constexpr double kPixelMm = 0.0032;
constexpr double kNearestMm = 800;  ///< sharp with the ring at 850
/// The motors' resolution: a shorter move does not start.
constexpr double kResolutionCounts = 2;
/// A blur of this diameter counts as sharp: it is the depth of focus.
constexpr double kSharpPx = 1;

struct LensTruth {
    double wide_mm = 8.5, tele_mm = 85;  ///< focal length, linear in the zoom's position
    double open_wide = 1.6, open_tele = 2.0, closed = 16;
    double drift_per_m = 0;  ///< change of the sharp plane's 1 / distance over the zoom
    double spot_rms_px = 0.31;

    static double part(double ring) { return (ring - kRingLow) / kRingSpan; }
    double focal_mm(double zoom) const { return wide_mm + (tele_mm - wide_mm) * part(zoom); }
    double f_number(double zoom, double iris) const {
        const double open = open_wide + (open_tele - open_wide) * part(zoom);
        return open * std::pow(closed / open, 1 - part(std::clamp(iris, kRingLow, kRingHigh)));
    }
    /// 1 / distance of the plane that is sharp.
    double sharp_per_mm(double ring, double zoom) const {
        return part(ring) / kNearestMm + drift_per_m * part(zoom) / 1000;
    }
    /// The ring's position where a plane is sharp; may be beyond an end.
    double ring_for(double per_mm, double zoom) const {
        return kRingLow + kRingSpan * kNearestMm * (per_mm - drift_per_m * part(zoom) / 1000);
    }
    /// Distance of the image from the lens.
    double image_mm(double ring, double zoom) const {
        return 1 / (1 / focal_mm(zoom) - sharp_per_mm(ring, zoom));
    }
    /// Diameter of the image of a point at a distance of 1 / per_mm: the cone of rays that
    /// converges there is as wide as the pupil at the lens.
    double blur_px(double ring, double zoom, double iris, double per_mm) const {
        const double pupil_mm = focal_mm(zoom) / f_number(zoom, iris);
        const double meets_mm = 1 / (1 / focal_mm(zoom) - per_mm);
        return pupil_mm * std::abs(1 - image_mm(ring, zoom) / meets_mm) / kPixelMm;
    }
    double blur_px_per_count(double zoom, double iris, double per_mm) const {
        const double best = ring_for(per_mm, zoom);
        return blur_px(best + 0.5, zoom, iris, per_mm) + blur_px(best - 0.5, zoom, iris, per_mm);
    }
    /// Image of a point in focus: the lens's own spot and diffraction (0.6 px rms at f/8).
    double spot_px(double zoom, double iris) const {
        return std::hypot(spot_rms_px, 0.6 / 8 * f_number(zoom, iris));
    }
};

}  // namespace focus

#endif
