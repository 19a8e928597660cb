// SPDX-License-Identifier: Apache-2.0
/// The focus control of a camera with its own port, as a search sees it: an axis that is moved in
/// steps. Positions are steps of the control, larger ones nearer. Errors as rig_focus_part.
#ifndef VERGENCE_RIG_AUTO_FOCUS_MOVER_H
#define VERGENCE_RIG_AUTO_FOCUS_MOVER_H

#include "focus/focus_search.h"
#include "rig/rig.h"

#ifdef __cplusplus
extern "C" {
#endif

/// Whether all these sides have something to focus with: a motorized lens, or a focus control.
/// ERROR_ARGUMENT, ERROR_NOT_CONNECTED, ERROR_NOT_READY.
int focus_mover_check(struct rig *self, unsigned sides);

/// Number of steps; 0: this side has a motorized lens, or no focus control.
unsigned focus_mover_steps(const struct rig *self, unsigned side);
/// Where it is: 0 .. the number of steps.
double focus_mover_position(const struct rig *self, unsigned side);
/// Sends it there. Frames taken afterwards count when it has arrived.
int focus_mover_go(struct rig *self, unsigned side, double position);

/// What a search knows about such a lens: its range, and nothing else.
struct focus_search_options focus_mover_options(const struct rig *self, unsigned side);

/// Takes the step's frames at rest at a position, and adds them to the search.
typedef int focus_mover_look(void *context, const struct focus_step *step, double position);

/// Carries out a step of a search, which is not its end.
int focus_mover_carry_out(struct rig *self, unsigned side, const struct focus_step *step,
                          focus_mover_look *look, void *context, struct focus_event *event);

#ifdef __cplusplus
}
#endif

#endif
