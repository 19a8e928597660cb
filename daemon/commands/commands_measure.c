// SPDX-License-Identifier: Apache-2.0
// `measure` of an instrument with a disk: its pairs and its decisions go into a session, and
// surfaces are computed on another thread, while this one, the rig's, looks after the rig.
#include <errno.h>
#include <fcntl.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "console/measure/measure_driver.h"
#include "console/measure/measure_request.h"
#include "daemon/base/monotonic.h"
#include "daemon/commands/commands.h"
#include "daemon/commands/space_check.h"
#include "daemon/commands/surface_run.h"
#include "daemon/session/session_notes.h"
#include "daemon/surface/reconstruct_pictures.h"
#include "daemon/surface/result/result_figures.h"

enum { PAIRS = 5 };  // that a measurement takes at most, but for those that moved

static const double us_per_s = 1e6;
// Of the pixels, measured: the objects of tools/figures before their blank wall have 23 % and more.
static const double few_percent = 10;

// One measurement. Allocated, as it is large.
struct measuring {
    struct measure_driver driver;
    struct zoom_calibration *zoom;   // NULL: none
    struct captured_pair *captured;  // in use by the driver
    struct surface_run *run;
    bool accepted;         // the calibration is of another instrument, which was accepted
    struct message doubt;  // of the surface's pictures
    bool request_noted;
    int noted;  // steps of the report that the session has
};

static struct measuring *measuring_of(struct measure_driver *driver) {
    return driver->owner;
}

static uint64_t now_us(const struct command_call *call) {
    return record_now_us(&daemon_of(call)->record);
}

static const struct pair *use_pair(struct measure_driver *driver) {
    struct measuring *self = measuring_of(driver);
    self->captured = last_pair_use(&daemon_of(driver->call)->last_pair);
    INVARIANT(self->captured != NULL);  // this thread has just taken it
    return &self->captured->pair;
}

static void give_back(struct measure_driver *driver) {
    last_pair_give_back(measuring_of(driver)->captured);
}

// Its cameras, and room for its pairs.
static int check(struct measure_driver *driver) {
    const struct daemon *daemon = daemon_of(driver->call);
    if (faccessat(daemon->files_fd, ".", W_OK, AT_EACCESS) != 0) {
        return command_fail(driver->call, ERROR_REFUSED,
                            "measure: the directory of files, %s, cannot be written: %s",
                            daemon->config.files, strerror(errno));
    }
    const struct free_space_frames frames = {.files_images = PAIRS * RIG_SIDES};
    const int error = commands_calibration_check_rig(driver->call, &measuring_of(driver)->accepted);
    return error != ERROR_OK ? error : space_check_frames(driver->call, &frames);
}

// ---- notes in the session, from which a PC makes the same surface and its report

// Notes the steps that the session does not have yet, once it is there. Continues if a
// note cannot be written: the pairs are there.
static void note(struct measure_driver *driver) {
    struct measuring *self = measuring_of(driver);
    const struct command_call *call = driver->call;
    char text[SESSION_TEXT_MAX + 1];
    if (driver->report.captures == 0 && !daemon_of(call)->session.recording) {
        return;
    }
    if (!self->request_noted) {
        struct command_text words = command_text_begin(text, sizeof text);
        command_text_add(&words, SESSION_NOTE_MEASURE);
        measure_request_add(&words, &driver->machine.request);
        self->request_noted = commands_session_note(call, driver->pairs, text) == ERROR_OK;
    }
    for (; self->noted < driver->report.steps; self->noted++) {
        snprintf(text, sizeof text, SESSION_NOTE_STEP "%s", driver->report.step[self->noted].text);
        (void)commands_session_note(call, driver->pairs, text);
    }
    call->message[0] = '\0';
}

static void __attribute__((format(printf, 2, 3)))
append(char text[SESSION_TEXT_MAX + 1], const char *format, ...) {
    const size_t used = strlen(text), room = SESSION_TEXT_MAX + 1 - used;
    va_list values;
    va_start(values, format);
    const int length = vsnprintf(text + used, room, format, values);
    va_end(values);
    INVARIANT(length >= 0 && (size_t)length < room);
}

// By whose words a PC makes the same surface, before it is computed: a PC can if this machine
// cannot. The last note counts.
static void note_surface(struct measure_driver *driver, const struct measure_search *search) {
    char text[SESSION_TEXT_MAX + 1] = "";
    append(text, SESSION_NOTE_SURFACE "pair=%d", (int)search->pair);
    if (search->with_pair > 0) {
        append(text, " with-pair=%d", (int)search->with_pair);
    }
    if (search->far_mm > 0) {
        append(text, " near=%.3f far=%.3f", search->near_mm, search->far_mm);
    }
    if (search->scale < 1) {
        append(text, " scale=%.6g", search->scale);
    }
    if (measuring_of(driver)->accepted) {
        append(text, " accept-mismatch=yes");
    }
    (void)commands_session_note(driver->call, driver->pairs, text);
}

// ---- surfaces

static void end_run(struct measuring *self) {
    if (self->run != NULL) {
        surface_run_end(self->run);
    }
    free(self->run);
    self->run = NULL;
}

static void read_surface(const struct surface_run *run, struct measure_surface *surface) {
    const struct reconstruct_context *context = &run->job.context;
    surface->result = context->result;
    surface->calibration = context->calibration;
    surface->shrink = context->shrink;
    surface->frames = run->source.pair.pair.frame;
    snprintf(surface->name, sizeof surface->name, "%s", run->result);
    surface->spread = context->spread;
    surface->common_mm = context->depth_sigma_common_mm;
    surface->with_used = context->with_pair_used;
    surface->misfit =
        context->self_calibrated && context->self_calibration.health == ADJUST_CALIBRATE;
}

// Only a surface that is kept is doubted: of a coarse one, whose pictures would be compared for
// nothing, the subject alone is read.
static void explain(struct measure_driver *driver, int error, bool keep) {
    struct measuring *self = measuring_of(driver);
    driver->surface.doubt = NULL;
    if (error != ERROR_OK && error != ERROR_NO_SURFACE) {
        snprintf(driver->why, sizeof driver->why, "%s", self->run->message);
        return;
    }
    if (error == ERROR_OK && !keep) {
        return;
    }
    const struct reconstruct_context *context = &self->run->job.context;
    if (!reconstruct_pictures_explain(context, &self->doubt)) {
        const double density_percent = result_figures_density_percent(context->result);
        if (error == ERROR_NO_SURFACE || density_percent > few_percent) {
            return;
        }
        message_set(&self->doubt, 0, "only %.0f %% of the pixels could be measured",
                    density_percent);
    }
    if (error == ERROR_OK) {
        driver->surface.doubt = self->doubt.text;
    } else {
        snprintf(driver->why, sizeof driver->why, "%s", self->doubt.text);
    }
}

static int compute(struct measure_driver *driver, const struct measure_search *search, bool keep) {
    struct measuring *self = measuring_of(driver);
    const uint64_t begin_us = monotonic_now_us();
    end_run(self);
    if (keep) {
        note_surface(driver, search);
    }
    self->run = calloc(1, sizeof *self->run);
    if (self->run == NULL) {
        snprintf(driver->why, sizeof driver->why, "out of memory");
        return ERROR_MEMORY;
    }
    struct reconstruct_request *request = &self->run->request;
    *request = reconstruct_request_defaults();
    request->pair = (int)search->pair;
    request->with_pair = (int)search->with_pair;
    request->scale = search->scale;
    request->depth_mm[0] = search->near_mm;
    request->depth_mm[1] = search->far_mm;
    (void)reconstruct_request_check_search(request);  // they are in order
    request->accept_mismatch = self->accepted;
    snprintf(self->run->session, sizeof self->run->session, "%s", driver->pairs);
    self->run->keep = keep;
    self->run->captured = keep ? NULL : last_pair_use(&daemon_of(driver->call)->last_pair);
    const int error = surface_run_beside(self->run, driver->call);
    read_surface(self->run, &driver->surface);
    explain(driver, error, keep);
    if (error == ERROR_OK && keep && self->run->job.context.self_calibrated) {
        commands_calibration_adjusted(driver->call, &self->run->job.context.self_calibration);
    }
    driver->surface.seconds = (double)(monotonic_now_us() - begin_us) / us_per_s;
    return error;
}

// ---- the command

// The saved calibration: of all zooms where there is one; else of one state, which nothing may move
// away from.
static int load_calibration(struct measuring *self, const struct measure_request *request) {
    const struct command_call *call = self->driver.call;
    const int error = commands_calibration_zoom(call, &self->zoom, &self->accepted);
    if (error != ERROR_MISSING) {
        return error;
    }
    self->zoom = NULL;
    const int missing = commands_calibration_check_rig(call, &self->accepted);
    if (missing == ERROR_MISSING) {
        return command_fail(call, missing,
                            "measure: no calibration is saved (\"calibration set FILE\" first)");
    }
    if (missing != ERROR_OK) {
        return missing;
    }
    if (measure_request_needs_zoom(request)) {
        return command_fail(call, ERROR_MISSING, "measure: %s", MEASURE_REQUEST_NEEDS_ZOOM);
    }
    return ERROR_OK;
}

static int run_with(struct measuring *self) {
    struct measure_driver *driver = &self->driver;
    const struct command_call *call = driver->call;
    struct measure_request request;
    const char *wrong = measure_request_make(call->values, &request);
    int error = wrong == NULL ? ERROR_OK : command_fail(call, ERROR_ARGUMENT, "measure: %s", wrong);
    if (error == ERROR_OK) {
        error = daemon_of(call)->session.recording
                    ? files_need_directory(call)
                    : commands_session_check_name(call, &call->values[MEASURE_REQUEST_NAME]);
    }
    error = error == ERROR_OK ? load_calibration(self, &request) : error;
    error =
        error == ERROR_OK ? commands_view_ray(call, self->zoom, &request, &driver->place) : error;
    driver->zoom = self->zoom;
    return error == ERROR_OK ? measure_driver_run(driver, &request) : error;
}

static int run_measure(const struct command_call *call) {
    static const struct measure_host host = {
        .commands = &commands_host,
        .give = command_give,
        .now_us = now_us,
        .should_stop = daemon_should_stop,
        .progress = daemon_progress,
        .use_pair = use_pair,
        .give_back = give_back,
        .check = check,
        .note = note,
        .compute = compute,
    };
    struct measuring *self = calloc(1, sizeof *self);
    if (self == NULL) {
        return command_fail(call, ERROR_MEMORY, "measure: out of memory");
    }
    const struct session *session = &daemon_of(call)->session;
    const char *name = call->values[MEASURE_REQUEST_NAME].text;
    self->driver.call = call;
    self->driver.host = &host;
    self->driver.owner = self;
    self->driver.name = name;
    self->driver.session = session->recording ? NULL : name;
    self->driver.pairs = session->recording ? session->name : name;
    self->driver.plan = command_is_set(&call->values[MEASURE_REQUEST_PLAN]);
    const int error = run_with(self);
    end_run(self);
    free(self->zoom);
    free(self);
    return error;
}

static const struct command commands[] = {
    {.name = "measure",
     .summary = MEASURE_REQUEST_SUMMARY,
     .help =
         "Example: measure cup fit=300. Brings up the instrument if needed, finds at the widest "
         "zoom how far away and how deep the subject is, aims, zooms, closes the iris for that "
         "depth, focuses, exposes, takes pairs into the session NAME and computes "
         "surface-NAME-PAIR with the saved calibration of all zooms. States each decision with its "
         "reason, how good the result is, what was lost on the way, and what would improve it. "
         "Where a step fails, it continues with less if the result is still honest. With a "
         "calibration of one state nothing moves. After Ctrl-C the rig is at rest, and the pairs "
         "that were taken can be reconstructed. A PC also uses a board or a length in view.",
     .arguments = measure_request_arguments,
     .argument_count = MEASURE_REQUEST_ARGUMENTS,
     .flags =
         COMMAND_LONG | COMMAND_MOVES | COMMAND_UNRECORDED | COMMAND_GROUP_MEASURE | COMMAND_DAILY,
     .run = run_measure},
};

const struct command *commands_measure_table(size_t *count) {
    *count = 1;
    return commands;
}
