// SPDX-License-Identifier: Apache-2.0
/// What the command `measure` is asked for.
#ifndef VERGENCE_CONSOLE_MEASURE_MEASURE_REQUEST_H
#define VERGENCE_CONSOLE_MEASURE_MEASURE_REQUEST_H

#include "console/command.h"
#include "measure/measure_types.h"

#ifdef __cplusplus
extern "C" {
#endif

enum {
    MEASURE_REQUEST_NAME,
    MEASURE_REQUEST_FIT,
    MEASURE_REQUEST_DENSITY,
    MEASURE_REQUEST_ZOOM,
    MEASURE_REQUEST_AT,
    MEASURE_REQUEST_NEAR,
    MEASURE_REQUEST_FAR,
    MEASURE_REQUEST_QUICK,
    MEASURE_REQUEST_PLAN,
    MEASURE_REQUEST_ARGUMENTS
};
extern const struct command_argument measure_request_arguments[MEASURE_REQUEST_ARGUMENTS];

#define MEASURE_REQUEST_SUMMARY \
    "measure the surface of what is in the middle, from cold to the result"

/// Whether the calibration of all zooms is needed for it, and why a command without refuses.
bool measure_request_needs_zoom(const struct measure_request *request);
#define MEASURE_REQUEST_NEEDS_ZOOM                                 \
    "fit, density, zoom and at need the calibration of all zooms " \
    "(\"calibration set instrument.zoom\" first)"

/// The request that the arguments state. Returns what is wrong with it, in one line; NULL: nothing.
const char *measure_request_make(const struct command_value *values,
                                 struct measure_request *request);

/// Adds the request in the words of the command: "fit=360 quick=yes".
void measure_request_add(struct command_text *text, const struct measure_request *request);

#ifdef __cplusplus
}
#endif

#endif
