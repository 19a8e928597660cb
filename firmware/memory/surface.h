// SPDX-License-Identifier: Apache-2.0
/// The surface of a pair, and the file surface.compact of it.
#ifndef VERGENCE_MEMORY_SURFACE_H
#define VERGENCE_MEMORY_SURFACE_H

#include <stdbool.h>

#include "console/command.h"
#include "console/measure/measure_surface.h"
#include "rig/pair.h"

/// What is wanted of a surface, beyond the calibration in force.
struct memory_surface_request {
    const char *command;    ///< what messages begin with
    const char *directory;  ///< of its file; NULL: there is none
    struct reconstruct_options options;
    bool accept_mismatch;
    bool adjust;                   ///< the pair corrects the calibration, if that is of all zooms
    const struct pair *with_pair;  ///< which helps with that, at another zoom; NULL: none
};

/// The options with all defaults, but what is made again where it is read.
struct reconstruct_options memory_surface_options(void);

/// Computes the surface of a pair, valid until the next surface or capture. `surface->name` is not
/// set. Errors with the call's message.
int memory_surface_make(const struct command_call *call,
                        const struct memory_surface_request *request, const struct pair *pair,
                        struct measure_surface *surface);

#endif
