// SPDX-License-Identifier: Apache-2.0
/// One command from a cold instrument to a surface. The decisions are those of firmware/measure;
/// here each step becomes commands of the console, and what they showed becomes its event.
///
/// The owner parses the request, fills in the first group of members and calls measure_driver_run.
#ifndef VERGENCE_CONSOLE_MEASURE_MEASURE_DRIVER_H
#define VERGENCE_CONSOLE_MEASURE_MEASURE_DRIVER_H

#include <stdbool.h>
#include <stdint.h>

#include "console/measure/measure_report.h"
#include "console/measure/measure_surface.h"
#include "console/pair/zoom_query.h"
#include "core/message.h"
#include "measure/measure_place.h"
#include "rig/pair.h"

#ifdef __cplusplus
extern "C" {
#endif

struct measure_driver;

/// What the instrument does for a measurement.
struct measure_host {
    const struct command_host *commands;
    /// Runs a command as if a user had entered it. Its error, with the call's message.
    int (*give)(const struct command_call *call, const char *line,
                const struct command_reply *reply);
    uint64_t (*now_us)(const struct command_call *call);  ///< the rig's clock
    bool (*should_stop)(const struct command_call *call);
    /// Reports progress; `what` stays where it is while the command runs.
    void (*progress)(const struct command_call *call, const char *what, uint32_t done,
                     uint32_t total);
    /// The pair that `capture` has just taken, until it is given back.
    const struct pair *(*use_pair)(struct measure_driver *driver);
    void (*give_back)(struct measure_driver *driver);
    /// What can be checked only of an instrument that is up: once. Errors with the call's message.
    int (*check)(struct measure_driver *driver);
    /// Called before a step and before a surface, with what has been decided so far. NULL: it
    /// is not kept.
    void (*note)(struct measure_driver *driver);
    /// Computes a surface, and leaves it in `driver->surface`; `keep`: with its file. After an
    /// error `driver->why` says why, unless it is ERROR_NO_SURFACE and the pictures show no reason.
    int (*compute)(struct measure_driver *driver, const struct measure_search *search, bool keep);
};

/// Large: not for a stack.
struct measure_driver {
    // Set by the owner, the rest zeroed:
    const struct command_call *call;
    const struct measure_host *host;
    void *owner;
    const struct zoom_calibration *zoom;  ///< the calibration of all zooms; NULL: of one state
    struct measure_place place;           ///< that is asked for, by the request's pixel
    const char *name;                     ///< as the user gave it
    const char *session;  ///< what the pairs are added to; NULL: nothing, or what records
    const char *pairs;    ///< the name of what has the pairs; NULL: nothing
    bool plan;            ///< nothing is carried out

    struct measure machine;
    struct measure_step step;
    struct measure_event event;
    struct measure_report report;
    struct measure_surface surface;
    double size_px;           ///< of the subject in the left picture; 0: not known
    char why[MESSAGE_BYTES];  ///< of the last step that failed
    uint64_t begin_us;
    bool checked;
    double distance_mm;  ///< of the subject, for a plan
};

/// Measures, and answers the call. 0, or an error with the call's message.
int measure_driver_run(struct measure_driver *self, const struct measure_request *request);

#ifdef __cplusplus
}
#endif

#endif
