// SPDX-License-Identifier: Apache-2.0
#include "focus/lens_optics.h"

#include <math.h>

#include "core/invariant.h"
#include "core/math.h"

// Green light, where the eye and the sensor's green pixels see most.
#define WAVELENGTH_MM 550e-6
// The Airy pattern's middle is close to a Gauss curve with a sigma of 0.42 wavelengths times the
// f-number; a disc has four times its rms (of one axis) as diameter.
#define DIFFRACTION (4 * 0.42 * WAVELENGTH_MM)

// 1 / distance.
static double vergence(double distance_mm) {
    INVARIANT(distance_mm > 0);
    return isinf(distance_mm) ? 0 : 1 / distance_mm;
}

static double distance_of(double vergence_per_mm) {
    return vergence_per_mm > 0 ? 1 / vergence_per_mm : (double)INFINITY;
}

static double span_of(const struct lens_ring *ring) {
    INVARIANT(ring->min < ring->max);
    return (double)ring->max - ring->min;
}

double lens_optics_focal_length(const struct lens_optics *optics, double zoom) {
    const double wide_mm = optics->focal_length_wide_mm, tele_mm = optics->focal_length_tele_mm;
    INVARIANT(wide_mm > 0 && tele_mm > wide_mm);
    return wide_mm + (tele_mm - wide_mm) * (zoom - optics->zoom.min) / span_of(&optics->zoom);
}

double lens_optics_zoom_for(const struct lens_optics *optics, double focal_length_mm) {
    const double wide_mm = optics->focal_length_wide_mm, tele_mm = optics->focal_length_tele_mm;
    INVARIANT(wide_mm > 0 && tele_mm > wide_mm);
    return optics->zoom.min +
           span_of(&optics->zoom) * (focal_length_mm - wide_mm) / (tele_mm - wide_mm);
}

// Counts of focus for each 1/mm.
static double focus_scale(const struct lens_optics *optics) {
    INVARIANT(optics->focus_nearest_mm > 0);
    return span_of(&optics->focus) * optics->focus_nearest_mm;
}

double lens_optics_distance(const struct lens_optics *optics, double focus) {
    return distance_of((focus - optics->focus.min) / focus_scale(optics));
}

double lens_optics_focus_for(const struct lens_optics *optics, double distance_mm) {
    return optics->focus.min + focus_scale(optics) * vergence(distance_mm);
}

// Natural logarithm of the change of the f-number over the whole iris.
static double iris_span(const struct lens_optics *optics) {
    INVARIANT(optics->f_number_open > 0 && optics->f_number_closed > optics->f_number_open);
    return math_log(optics->f_number_closed / optics->f_number_open);
}

double lens_optics_f_number(const struct lens_optics *optics, double iris) {
    const double closed_part = (optics->iris.max - iris) / span_of(&optics->iris);
    return optics->f_number_open * math_exp(iris_span(optics) * closed_part);
}

double lens_optics_iris_for(const struct lens_optics *optics, double f_number) {
    INVARIANT(f_number > 0);
    return optics->iris.max -
           span_of(&optics->iris) * math_log(f_number / optics->f_number_open) / iris_span(optics);
}

double lens_image_distance(double focal_length_mm, double distance_mm) {
    INVARIANT(focal_length_mm > 0 && distance_mm > focal_length_mm);
    return 1 / (1 / focal_length_mm - vergence(distance_mm));
}

// Blur for each 1/mm between the object and the focus.
static double blur_scale(const struct lens_state *state) {
    INVARIANT(state->f_number > 0 && state->focus_distance_mm > 2 * state->focal_length_mm);
    return state->focal_length_mm / state->f_number *
           lens_image_distance(state->focal_length_mm, state->focus_distance_mm);
}

double lens_blur(const struct lens_state *state, double distance_mm) {
    return blur_scale(state) * fabs(vergence(distance_mm) - vergence(state->focus_distance_mm));
}

double lens_blur_per_count(const struct lens_optics *optics, const struct lens_state *state) {
    return blur_scale(state) / focus_scale(optics);
}

void lens_sharp_range(const struct lens_state *state, double blur_mm, double *near_mm,
                      double *far_mm) {
    INVARIANT(blur_mm > 0);
    const double reach = blur_mm / blur_scale(state);
    *near_mm = distance_of(vergence(state->focus_distance_mm) + reach);
    *far_mm = distance_of(vergence(state->focus_distance_mm) - reach);
    INVARIANT(*near_mm <= state->focus_distance_mm && *far_mm >= state->focus_distance_mm);
}

double lens_diffraction(double f_number) {
    INVARIANT(f_number > 0);
    return DIFFRACTION * f_number;
}

double lens_range_middle(double near_mm, double far_mm) {
    INVARIANT(near_mm <= far_mm);
    return distance_of((vergence(near_mm) + vergence(far_mm)) / 2);
}

// Blur of the worse end at f/1.
static double worse_end(const struct lens_state *state, double near_mm, double far_mm) {
    struct lens_state open = *state;
    open.f_number = 1;
    return math_max(lens_blur(&open, near_mm), lens_blur(&open, far_mm));
}

double lens_f_number_for_blur(const struct lens_state *state, double near_mm, double far_mm,
                              double blur_mm) {
    INVARIANT(blur_mm > 0);
    return worse_end(state, near_mm, far_mm) / blur_mm;
}

double lens_f_number_for_diffraction(const struct lens_state *state, double near_mm,
                                     double far_mm) {
    return sqrt(worse_end(state, near_mm, far_mm) / DIFFRACTION);
}
