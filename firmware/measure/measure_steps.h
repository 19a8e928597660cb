// SPDX-License-Identifier: Apache-2.0
/// What the steps of a measurement are made of: what is known, which phases are needed, and where
/// they lead. For firmware/measure only.
#ifndef VERGENCE_MEASURE_MEASURE_STEPS_H
#define VERGENCE_MEASURE_MEASURE_STEPS_H

#include "measure/measure_types.h"

#ifdef __cplusplus
extern "C" {
#endif

// ---- measure_needs.c: what is known

/// Notes a loss.
void measure_lose(struct measure *self, enum measure_loss loss);

/// The calibration of all zooms; NULL: none.
const struct zoom_calibration *measure_model(const struct measure *self);
/// Whether parts may move: a calibration of one state does not survive it.
bool measure_may_move(const struct measure *self);
bool measure_may_zoom(const struct measure *self);

/// The subject, or a point ahead at its distance as far as that is known. The parts may move.
void measure_point(const struct measure *self, double point_mm[3]);

/// Turns `state` to a point ahead, in the middle of the depths that the request states, whose
/// distance it returns. `state` stays if that is too near. The parts may move.
double measure_look_ahead(const struct measure *self, struct zoom_state *state);

/// Whether the depths that the request states are somewhere in the view of both cameras at the
/// widest zoom, or will be when they have looked ahead. The parts may move.
bool measure_sees_stated(const struct measure *self);

/// Focal length of the left camera at the present zoom, px; 0: not known.
double measure_focal_px(const struct measure *self);

/// The request's wish; false: the subject's size is needed for it and not known.
bool measure_wish_of(const struct measure *self, struct zoom_wish *wish);

/// The state for the wish, and `*nearest`: it is out of reach, and this is the nearest to it.
/// False: none, or the cameras do not see the subject.
bool measure_state_for(const struct measure *self, struct zoom_state *state, bool *nearest);

/// Part of the view around the subject at the zoom that the request asks for; 1 if that is not
/// known.
double measure_centred(const struct measure *self);

/// The zoom that helps the pair most, times the smallest.
double measure_other_factor(const struct measure *self);
/// Whether a pair was taken with the same pan, at another zoom than the pair.
bool measure_has_other(const struct measure *self);

/// Whether a phase is needed, by what is known now.
bool measure_needs(const struct measure *self, enum measure_phase phase);

// ---- measure_steps.c, measure_optics.c: the steps

/// Fills in the step of a phase that is needed. False: it turns out to be impossible or to change
/// nothing; a loss is then noted if there is one.
bool measure_prepare(struct measure *self, enum measure_phase phase, struct measure_step *step);
bool measure_prepare_iris(struct measure *self, struct measure_step *step);
/// From the focus that was found to the middle of the depth, or to where the calibration has that.
bool measure_prepare_middle(struct measure *self, struct measure_step *step);

/// Sets the reason of a step.
void measure_explain(struct measure_step *step, enum measure_why why, double first, double second,
                     double third, double fourth);

#ifdef __cplusplus
}
#endif

#endif
