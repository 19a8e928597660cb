// SPDX-License-Identifier: Apache-2.0
/// A measurement's decisions and its result in words.
#ifndef VERGENCE_CONSOLE_MEASURE_TEXT_H
#define VERGENCE_CONSOLE_MEASURE_TEXT_H

#include "console/command_text.h"
#include "measure/measure.h"

#ifdef __cplusplus
extern "C" {
#endif

/// Static storage; the argument must be valid.
const char *measure_phase_text(enum measure_phase phase);
const char *measure_why_text(enum measure_why why);
const char *measure_loss_text(enum measure_loss loss);
const char *measure_advice_text(enum measure_advice advice);

/// "zoom: both see 363 mm at 1802 mm: 31.6 px/mm^2, 0.99 mm per px of disparity".
void measure_text_add_step(struct command_text *text, const struct measure_step *step);

/// One sentence: what the result is good for, what it lost, what would make it better; of one
/// without a surface, why: `why`, unless it is "".
void measure_text_add_result(struct command_text *text, const struct measure_result *result,
                             const char *why);

#ifdef __cplusplus
}
#endif

#endif
