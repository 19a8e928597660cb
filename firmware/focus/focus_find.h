// SPDX-License-Identifier: Apache-2.0
/// What the curve of a search shows: whether there is a subject, and where. For focus_search.c
/// only, which decides what to do about it.
#ifndef VERGENCE_FOCUS_FOCUS_FIND_H
#define VERGENCE_FOCUS_FOCUS_FIND_H

#include "focus/focus_search_types.h"

#ifdef __cplusplus
extern "C" {
#endif

/// Samples of these legs (bits 1 << enum focus_leg) in a channel.
struct focus_range focus_find_range(unsigned legs, enum focus_channel channel, double min,
                                    double max);

/// The peak of the sweep that most likely is one although none stands out from the noise; it is
/// then of `finder`. False: there is no such peak.
bool focus_find_hidden(struct focus_search *self, struct focus_peak *peak);

/// Learns the noise of the frames at rest, which are of a longer exposure than those of the sweep.
void focus_find_learn_rest(struct focus_search *self, double min, double max);

/// Learns floors and noises of all channels from the sweep.
void focus_find_learn(struct focus_search *self);

/// Least contrast of a subject in a channel, in its unit.
double focus_find_least(const struct focus_search *self, enum focus_channel channel);

/// Chooses the finest measure that sees a peak in the sweep as `finder`; false: none does.
bool focus_find_choose(struct focus_search *self);

/// The highest peak of the sweep, or the one that was asked for; the other one is `second` of the
/// result. Returns their number.
unsigned focus_find_peaks(struct focus_search *self, struct focus_peak *peak);

/// Whether any measure sees a subject in samples of a leg.
bool focus_find_subject(const struct focus_search *self, unsigned leg, double min, double max);

/// Locates the top of a peak by the finest measure that stands out from its noise and locates it
/// well for `good` counts, or else the one that locates it best; it is then `channel`. False: none
/// does.
bool focus_find_top(struct focus_search *self, unsigned leg, double min, double max, double good,
                    struct focus_peak *peak);

/// Locates a wide peak of the sweep by the measure that does it best, which is then `channel`.
/// `least`: curvature over its standard deviation.
bool focus_find_wide_peak(struct focus_search *self, double least, struct focus_peak *peak);

/// Whether lights in or beside the region outshine it around the result's peak. Blur is the same at
/// equal distances on both sides of a focus, and so is the light that it brings into the region or
/// takes out of it: where the light grows to one side, the peak comes from the discs of lights that
/// are out of focus. Where the ring cannot reach the other side, the light must not change.
bool focus_find_lights(const struct focus_search *self);

/// Sharpness at the top of the result's peak, as the first `count` samples of the curve show it: of
/// a wide peak not more than the highest of them, as the vertex of a fit may be above a rounded
/// top.
/// `*light`: the mean light around the peak, 0 without samples.
double focus_find_at_peak(const struct focus_search *self, unsigned count, double *light);

#ifdef __cplusplus
}
#endif

#endif
