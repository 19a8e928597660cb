// SPDX-License-Identifier: Apache-2.0
/// What the command `measure` is asked for, and how a session notes it.
#ifndef VERGENCE_DAEMON_MEASURE_MEASURE_REQUEST_H
#define VERGENCE_DAEMON_MEASURE_MEASURE_REQUEST_H

#include "console/command.h"
#include "daemon/session/session.h"
#include "daemon/surface/reconstruct_request.h"
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

/// The request that the arguments state. Returns what is wrong with it, in one line; NULL: nothing.
const char *measure_request_make(const struct command_value *values,
                                 struct measure_request *request);

/// The request in the words of the command, after `before`: "fit=360 quick=yes".
void measure_request_print(const struct measure_request *request, const char *before,
                           char text[SESSION_TEXT_MAX + 1]);

/// The request for the surface of a step, with lengths as its note has them, so that the same
/// surface follows from that.
void measure_request_surface(const struct measure_step *step, struct reconstruct_request *request);

/// The note of a surface, by whose words a PC makes the same one.
void measure_request_print_surface(const struct reconstruct_request *request,
                                   char text[SESSION_TEXT_MAX + 1]);

#ifdef __cplusplus
}
#endif

#endif
