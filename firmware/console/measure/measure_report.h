// SPDX-License-Identifier: Apache-2.0
/// What a measurement decided and found, as the answer of `measure`.
#ifndef VERGENCE_CONSOLE_MEASURE_MEASURE_REPORT_H
#define VERGENCE_CONSOLE_MEASURE_MEASURE_REPORT_H

#include <stdint.h>

#include "console/command.h"
#include "console/measure/measure_surface.h"
#include "core/arena.h"
#include "measure/measure.h"
#include "rig/pair_frame.h"

#ifdef __cplusplus
extern "C" {
#endif

enum { MEASURE_REPORT_STEPS_MAX = 48, MEASURE_REPORT_TEXT_BYTES = 256 };

struct measure_report_step {
    double at_s, taken_s;  ///< on the rig's clock
    char text[MEASURE_REPORT_TEXT_BYTES];
    char failed[MEASURE_REPORT_TEXT_BYTES];  ///< why it failed; "": it did not
};

/// Zeroed before. Large: not for a stack.
enum { MEASURE_REPORT_DOUBT_BYTES = 256 };

struct measure_report {
    struct measure_report_step step[MEASURE_REPORT_STEPS_MAX];
    int steps;
    unsigned captures;
    double seconds;            ///< of the rig's clock
    double computing_seconds;  ///< of the machine's clock, on coarse surfaces and the surface
    double f_number;           ///< at the pair; 0: not known
    uint32_t exposure_us[PAIR_PARTS_MAX];  ///< of the pair's left frame
    int exposures;
    // Of the surface:
    char result[MEASURE_SURFACE_NAME_BYTES];  ///< its directory; "": there is none
    uint32_t points, reason_count[REASON_COUNT];
    double depth_mm[SURFACE_FIGURES_QUANTILES];  ///< of the subject: 1 %, 50 %, 99 %
    double scale;                                ///< of the pictures that it was computed from
    char doubt[MEASURE_REPORT_DOUBT_BYTES];      ///< as of the surface; "": none
};

/// Notes the next step. NULL: there are too many.
struct measure_report_step *measure_report_add(struct measure_report *self,
                                               const struct measure_step *step, double at_s);

/// Counts a pair, and keeps what that to be measured was taken with.
void measure_report_pair(struct measure_report *self, enum measure_phase phase,
                         const struct pair_frame *left, double f_number);

/// Takes over a surface: here and into the event, whose figures are of the subject, at these
/// depths. The arena has measure_share_need_bytes. Takes about as long as a stage of the
/// reconstruction.
void measure_report_surface(struct measure_report *self, const struct measure_surface *surface,
                            const struct surface_figures_depths *depths, struct arena *arena,
                            struct measure_event *event);

/// Why a pair has no surface although its pictures are good, and what to do.
void measure_report_no_surface(const struct reconstruct_result *result,
                               const struct measure_request *request, struct command_text *text);

/// That a surface does not show the subject.
void measure_report_no_subject(const struct measure_request *request, struct command_text *text);

/// Why there is no surface (`why`, "": the error alone says it), and what can be done: in one line.
/// `session`: what has the pairs; NULL: none.
void measure_report_failure(const struct measure_report *self, const struct measure_result *result,
                            const char *session, const char *why, struct command_text *text);

/// Adds the steps of a plan and what it expects to an answer.
void measure_report_put_plan(const struct measure_report *self, const struct command_call *call,
                             const struct measure_result *result);

/// Adds everything to an answer. `name`: as the user gave it; `session`: what has the pairs; NULL:
/// none.
void measure_report_put(const struct measure_report *self, const struct command_call *call,
                        const char *name, const char *session,
                        const struct measure_request *request, const struct measure_result *result,
                        const char *why);

#ifdef __cplusplus
}
#endif

#endif
