// SPDX-License-Identifier: Apache-2.0
/// A zoom lens as a thin lens: what positions of its rings mean in millimetres and f-numbers, and
/// how far an image is out of focus. Pure functions; lengths are mm, blurs are diameters on the
/// sensor, distances are those from the lens, INFINITY included. Positions are counts of the lens
/// controller and may be fractions.
///
/// Nominal relations of the rings, from the lens's data sheet:
///
///     zoom   focal length, linear in the counts: wide at the lower end, tele at the upper
///     focus  1 / distance, linear in the counts: infinity at the lower end, nearest at the upper
///     iris   the same number of stops for each count: closed at the lower end, open at the upper
///
/// A point at distance u, with the focus at distance s, is a disc on the sensor, of diameter
/// (f / N) v |1/u - 1/s|, where v = 1 / (1/f - 1/s) is the image distance and N the f-number. So at
/// a given zoom and iris, the disc grows by the same amount for each count of focus.
#ifndef VERGENCE_FOCUS_LENS_OPTICS_H
#define VERGENCE_FOCUS_LENS_OPTICS_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/// Range of a ring's positions, min < max.
struct lens_ring {
    int32_t min, max;
};

/// The nominal relations. 0: not known.
struct lens_optics {
    struct lens_ring zoom, focus, iris;
    double focal_length_wide_mm, focal_length_tele_mm;
    double focus_nearest_mm;
    double f_number_open, f_number_closed;
};

/// What decides about the blur.
struct lens_state {
    double focal_length_mm;
    double f_number;
    double focus_distance_mm;  ///< > 2 focal lengths; INFINITY
};

/// Focal length at a zoom position, which may be outside the range, and the inverse. Both focal
/// lengths are known.
double lens_optics_focal_length(const struct lens_optics *optics, double zoom);
double lens_optics_zoom_for(const struct lens_optics *optics, double focal_length_mm);

/// Distance in focus at a focus position, INFINITY at and below the lower end, and the inverse. The
/// nearest distance is known.
double lens_optics_distance(const struct lens_optics *optics, double focus);
double lens_optics_focus_for(const struct lens_optics *optics, double distance_mm);

/// f-number at an iris position, and the inverse. Both f-numbers are known.
double lens_optics_f_number(const struct lens_optics *optics, double iris);
double lens_optics_iris_for(const struct lens_optics *optics, double f_number);

/// Distance from lens to sensor when a distance is in focus.
double lens_image_distance(double focal_length_mm, double distance_mm);

/// Diameter of the image of a point at a distance.
double lens_blur(const struct lens_state *state, double distance_mm);

/// Change of that diameter for each count of focus. The nearest distance is known.
double lens_blur_per_count(const struct lens_optics *optics, const struct lens_state *state);

/// The distances between which the blur is at most `blur_mm` (> 0): `*near_mm` <= the focus
/// distance <= `*far_mm`, which may be INFINITY.
void lens_sharp_range(const struct lens_state *state, double blur_mm, double *near_mm,
                      double *far_mm);

/// Diameter of the disc that spreads light as far (rms) as diffraction does in green light.
double lens_diffraction(double f_number);

/// The focus distance at which the ends of a depth range, 0 < near <= far <= INFINITY, are equally
/// blurred; INFINITY if both ends are.
double lens_range_middle(double near_mm, double far_mm);

/// The f-number that gives both ends of a range at most `blur_mm` of blur at the state's focal
/// length and focus distance, and the one at which the blur of the worse end equals diffraction: a
/// larger one blurs all of the range more. 0: no blur at any.
double lens_f_number_for_blur(const struct lens_state *state, double near_mm, double far_mm,
                              double blur_mm);
double lens_f_number_for_diffraction(const struct lens_state *state, double near_mm, double far_mm);

#ifdef __cplusplus
}
#endif

#endif
