// SPDX-License-Identifier: Apache-2.0
#include "memory/measure.h"

#include <string.h>

#include "console/line/file_blocks.h"
#include "console/measure/measure_driver.h"
#include "console/measure/measure_request.h"
#include "core/error.h"
#include "core/invariant.h"
#include "memory/calibration.h"
#include "memory/files.h"
#include "memory/host.h"
#include "memory/pair.h"
#include "memory/surface.h"
#include "rig/base/rig_clock.h"

static struct measure_driver driver;

static uint64_t now_us(const struct command_call *call) {
    return rig_now_us(call->rig);
}

static void progress(const struct command_call *call, const char *what, uint32_t done,
                     uint32_t total) {
    const struct rig_observer *observer = &call->rig->observer;
    observer->progress(observer->self, what, done, total);
}

// ---- pairs

static int give(const struct command_call *call, const char *line,
                const struct command_reply *reply) {
    const int error = memory_host_give(call, line, reply);
    if (error == ERROR_OK && driver.step.kind == MEASURE_STEP_PAIR) {
        const enum measure_phase phase = driver.step.phase;
        memory_pair_keep(phase == MEASURE_PAIR || phase == MEASURE_MERGED ? MEMORY_KEPT_PAIR
                                                                          : MEMORY_KEPT_WIDE);
    }
    return error;
}

static const struct pair *use_pair(struct measure_driver *self) {
    const char *name = NULL;
    (void)self;
    return memory_pair_last(&name);
}

static void give_back(struct measure_driver *self) {
    (void)self;
}

// Room for its pairs.
static int check(struct measure_driver *self) {
    const struct rig *rig = self->call->rig;
    return self->plan || memory_pair_begin_keeping(rig->format.width_px, rig->format.height_px)
               ? ERROR_OK
               : command_refuse(self->call, ERROR_MEMORY,
                                "measure: no memory for pairs of %d x %d px (choose a smaller "
                                "\"window\")",
                                rig->format.width_px, rig->format.height_px);
}

// ---- surfaces

static int compute(struct measure_driver *self, const struct measure_search *search, bool keep) {
    char directory[MEMORY_FILE_NAME_BYTES];
    struct command_text name = command_text_begin(directory, sizeof directory);
    struct memory_surface_request request = {
        .command = "measure",
        .directory = keep ? directory : NULL,
        .options = memory_surface_options(),
        .adjust = true,
        .with_pair = search->with_pair != 0 ? memory_pair_numbered(search->with_pair) : NULL,
    };
    const struct pair *pair =
        search->pair != 0 ? memory_pair_numbered(search->pair) : use_pair(self);
    INVARIANT(pair != NULL && (search->with_pair == 0 || request.with_pair != NULL));
    request.options.recompute_surface = keep;  // a coarse one keeps its points
    request.options.rectify.scale = search->scale;
    request.options.rectify.depth_near_mm = search->near_mm;
    request.options.rectify.depth_far_mm = search->far_mm;
    command_text_print(&name, "surface-%s-%u", self->name, (unsigned)search->pair);
    const int error = memory_surface_make(self->call, &request, pair, &self->surface);
    struct command_text text = command_text_begin(self->surface.name, sizeof self->surface.name);
    command_text_add(&text, directory);
    if (error != ERROR_OK && error != ERROR_NO_SURFACE) {
        struct command_text why = command_text_begin(self->why, sizeof self->why);
        command_text_add(&why, self->call->message);
    }
    return error;
}

// ---- the command

static int refuse(const struct command_call *call, int error, const char *why) {
    return command_refuse(call, error, "measure: %s", why);
}

static int run_measure(const struct command_call *call) {
    static const struct measure_host host = {
        .commands = &memory_host,
        .give = give,
        .now_us = now_us,
        .should_stop = memory_host_should_stop,
        .progress = progress,
        .use_pair = use_pair,
        .give_back = give_back,
        .check = check,
        .compute = compute,
    };
    struct measure_request request;
    const char *wrong = measure_request_make(call->values, &request);
    if (wrong != NULL) {
        return refuse(call, ERROR_ARGUMENT, wrong);
    }
    const char *fault = file_blocks_new_name_fault(call->values[MEASURE_REQUEST_NAME].text);
    if (fault != NULL) {
        return command_refuse(call, ERROR_ARGUMENT, "NAME: %s", fault);
    }
    memset(&driver, 0, sizeof driver);
    driver.call = call;
    driver.host = &host;
    driver.zoom = memory_calibration_zoom();
    driver.name = call->values[MEASURE_REQUEST_NAME].text;
    driver.plan = command_is_set(&call->values[MEASURE_REQUEST_PLAN]);
    if (!memory_calibration_is_set()) {
        return refuse(call, ERROR_MISSING,
                      "no calibration is set (\"calibration set FILE\" first)");
    }
    if (driver.zoom == NULL && measure_request_needs_zoom(&request)) {
        return refuse(call, ERROR_MISSING, MEASURE_REQUEST_NEEDS_ZOOM);
    }
    if (request.has_place) {
        return refuse(call, ERROR_UNSUPPORTED,
                      "at needs \"view\", which this instrument does not have (aim with pan)");
    }
    const int error = measure_driver_run(&driver, &request);
    memory_pair_end_keeping();
    return error;
}

const struct command *memory_measure_table(size_t *count) {
    static const struct command commands[] = {
        {.name = "measure",
         .summary = MEASURE_REQUEST_SUMMARY,
         .help = "Example: measure cup fit=300. Brings up the instrument if needed, finds at the "
                 "widest zoom how far away and how deep the subject is, aims, zooms, closes the "
                 "iris for that depth, focuses, exposes, takes pairs and computes their surface, "
                 "which stays in memory as reconstruct leaves it. States each decision with its "
                 "reason, how good the result is, what was lost on the way, and what would improve "
                 "it. Where a step fails, it continues with less if the result is still honest. "
                 "After Ctrl-C the rig is at rest.",
         .arguments = measure_request_arguments,
         .argument_count = MEASURE_REQUEST_ARGUMENTS,
         .flags = COMMAND_LONG | COMMAND_MOVES | COMMAND_GROUP_MEASURE | COMMAND_DAILY,
         .run = run_measure},
    };
    *count = 1;
    return commands;
}
