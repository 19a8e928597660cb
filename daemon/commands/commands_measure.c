// SPDX-License-Identifier: Apache-2.0
// One command from a cold instrument to a surface. The decisions are those of firmware/measure;
// here each step becomes commands of the console, and what they showed becomes its event. Surfaces
// are computed on another thread, while this one, the rig's, looks after the rig.
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "console/measure_text.h"
#include "daemon/base/monotonic.h"
#include "daemon/commands/commands.h"
#include "daemon/commands/space_check.h"
#include "daemon/commands/surface_run.h"
#include "daemon/measure/measure_look.h"
#include "daemon/measure/measure_report.h"
#include "daemon/measure/measure_request.h"
#include "daemon/measure/measure_rig.h"
#include "daemon/session/session_notes.h"
#include "measure/measure_tuning.h"

enum { PAIRS = 4 };  // that a measurement takes at most, but for those that moved

// Where memory is short, or more disparities would be searched than the matcher has room for, the
// smallest scale of a surface that is worth having.
static const double scale_min = 0.2, us_per_s = 1e6;

// One measurement. Allocated, as it is large.
struct measuring {
    const struct command_call *call;
    struct zoom_calibration *zoom;  // NULL: none
    struct measure machine;
    struct measure_step step;
    struct measure_event event;
    struct measure_report report;
    const char *name;
    const char *session;         // of the pairs
    struct measure_place place;  // that is asked for, by the request's pixel
    double size_px;              // of the subject in the left picture; 0: not known
    char why[MESSAGE_BYTES];     // of the last step that failed
    uint64_t begin_us;           // rig's clock
    bool space_checked;
    bool accepted;       // the calibration is of another instrument, which was accepted
    bool plan;           // nothing is carried out
    double distance_mm;  // of the subject, for a plan
    bool request_noted;
    int noted;  // steps of the report that the session has
    struct surface_run *run;
};

static double elapsed_s(const struct measuring *self) {
    return (double)(record_now_us(&daemon_of(self->call)->record) - self->begin_us) / us_per_s;
}

// ---- steps that move the rig

static void read_pair(struct measuring *self) {
    struct captured_pair *captured = last_pair_use(&daemon_of(self->call)->last_pair);
    INVARIANT(captured != NULL);  // this thread has just taken it
    const struct pair_frame *left = &captured->pair.frame[RIG_LEFT];
    self->event.pair.number = captured->pair.number;
    if (left->parts == 0) {
        self->event.pair.dark_part = measure_rig_dark_part(left, &self->step, self->size_px);
    }
    measure_report_pair(&self->report, self->step.phase, left,
                        measure_rig_f_number(self->call->rig));
    last_pair_give_back(captured);
}

static void move(struct measuring *self) {
    struct measure_rig_lines lines;
    struct measure_rig_light light = {.mean_percent = 0};
    const struct command_reply reply = measure_rig_light_reply(&light);
    const bool recording = daemon_of(self->call)->session.recording;
    measure_rig_lines_of(self->call->rig, &self->step, recording ? NULL : self->name, self->size_px,
                         &lines);
    for (int i = 0; i < lines.count && self->event.error == ERROR_OK; i++) {
        self->event.error = command_give(self->call, lines.line[i], &reply);
    }
    if (self->event.error != ERROR_OK) {
        snprintf(self->why, sizeof self->why, "%s", self->call->message);
    } else if (self->step.kind == MEASURE_STEP_PAIR) {
        read_pair(self);
    }
    measure_rig_read_search(self->call->rig, &self->step, &light, self->why, &self->event);
}

// ---- notes in the session, from which a PC makes the same surface and its report

// Notes the steps that the session does not have yet, once it is there. Continues if a
// note cannot be written: the pairs are there.
static void note_steps(struct measuring *self) {
    char text[SESSION_TEXT_MAX + 1];
    if (self->plan || (self->report.captures == 0 && !daemon_of(self->call)->session.recording)) {
        return;
    }
    if (!self->request_noted) {
        measure_request_print(&self->machine.request, SESSION_NOTE_MEASURE, text);
        self->request_noted = commands_session_note(self->call, self->session, text) == ERROR_OK;
    }
    for (; self->noted < self->report.steps; self->noted++) {
        snprintf(text, sizeof text, SESSION_NOTE_STEP "%s", self->report.step[self->noted].text);
        (void)commands_session_note(self->call, self->session, text);
    }
    self->call->message[0] = '\0';
}

// Before the surface is computed: a PC can make it if this machine cannot. The last note counts.
static void note_surface(struct measuring *self, const struct reconstruct_request *request) {
    char note[SESSION_TEXT_MAX + 1];
    measure_request_print_surface(request, note);
    (void)commands_session_note(self->call, self->session, note);
}

// ---- steps that compute

// Begins a reconstruction, whose request is to be set; its results are there until the next one.
static bool begin_run(struct measuring *self) {
    if (self->run != NULL) {
        surface_run_end(self->run);
        free(self->run);
    }
    self->run = calloc(1, sizeof *self->run);
    if (self->run == NULL) {
        snprintf(self->why, sizeof self->why, "out of memory");
        self->event.error = ERROR_MEMORY;
        return false;
    }
    snprintf(self->run->session, sizeof self->run->session, "%s", self->session);
    return true;
}

static void run_surface(struct measuring *self) {
    const uint64_t begin_us = monotonic_now_us();
    self->event.error = surface_run_beside(self->run, self->call);
    snprintf(self->why, sizeof self->why, "%s", self->run->message);
    if (self->event.error == ERROR_NO_SURFACE) {
        measure_report_no_surface(&self->run->job.context, &self->machine.request, self->why,
                                  sizeof self->why);
    }
    self->report.computing_seconds += (double)(monotonic_now_us() - begin_us) / us_per_s;
}

static void look(struct measuring *self) {
    if (!begin_run(self)) {
        return;
    }
    self->run->captured = last_pair_use(&daemon_of(self->call)->last_pair);
    INVARIANT(self->run->captured != NULL);  // this thread has just taken it
    measure_look_prepare(&self->step, self->run->captured->pair.frame, &self->run->request);
    self->run->request.accept_mismatch = self->accepted;
    run_surface(self);
    if (self->event.error == ERROR_OK &&
        !measure_look_at(&self->run->job.context, self->run->source.pair.pair.frame, &self->machine,
                         &self->step, &self->place, &self->event)) {
        self->event.error = ERROR_NO_SURFACE;
        measure_report_no_subject(&self->machine.request, self->why, sizeof self->why);
    }
}

// A job of the disk writer: it takes as long as a stage of the reconstruction.
static void report_surface(void *cookie) {
    struct measuring *self = cookie;
    const struct reconstruct_context *context = &self->run->job.context;
    const struct measure_depths depths = measure_look_depths(context, &self->machine, &self->place);
    measure_report_surface(&self->report, context, &depths, &self->event);
}

static void surface(struct measuring *self) {
    struct reconstruct_request request;
    bool too_large = true;
    measure_request_surface(&self->step, &request);
    request.accept_mismatch = self->accepted;
    while (too_large) {
        note_surface(self, &request);
        if (!begin_run(self)) {
            return;
        }
        self->run->keep = true;
        self->run->request = request;
        run_surface(self);
        self->report.scale = request.scale;
        too_large =
            (self->event.error == ERROR_MEMORY || self->event.error == ERROR_DISPARITY_RANGE) &&
            (request.scale /= 2) >= scale_min;
    }
    if (self->event.error != ERROR_OK) {
        return;
    }
    disk_writer_run(&daemon_of(self->call)->disk_writer, report_surface, self);
    const struct reconstruct_context *context = &self->run->job.context;
    zoom_query_expect(self->call, &commands_host, &self->machine, &self->event);
    snprintf(self->report.result, sizeof self->report.result, "%s", self->run->result);
    if (context->self_calibrated) {
        commands_calibration_adjusted(self->call, &context->self_calibration);
    }
}

// ---- the loop

static void take_instrument(const struct measuring *self, struct measure_instrument *instrument) {
    struct calibration_match_state now;
    commands_calibration_now(self->call, &now);
    measure_rig_instrument(self->call->rig, &now, self->zoom, instrument);
}

// What could be checked before only of an instrument that is up: its cameras, and room for its
// pairs.
static int check_ready(struct measuring *self) {
    const struct free_space_frames frames = {.files_images = PAIRS * RIG_SIDES};
    if (self->space_checked || self->call->rig->state != RIG_READY) {
        return ERROR_OK;
    }
    self->space_checked = true;
    const int error = commands_calibration_check_rig(self->call, &self->accepted);
    return error != ERROR_OK ? error : space_check_frames(self->call, &frames);
}

static void announce(struct measuring *self, struct measure_report_step *noted) {
    const double at_s = elapsed_s(self);
    const double left_s = self->step.seconds + self->step.seconds_left;
    if (noted != NULL) {
        daemon_progress(self->call, noted->text, (uint32_t)at_s, (uint32_t)(at_s + left_s + 1));
    }
}

// What is known of where the rig is, after a step.
static void read_state(struct measuring *self) {
    struct calibration_match_state now;
    commands_calibration_now(self->call, &now);
    measure_rig_axes(&now, &self->event.axes);
    self->event.f_number = measure_rig_f_number(self->call->rig);
    self->event.lost = self->call->rig->state != RIG_READY;
}

static int carry_out(struct measuring *self) {
    memset(&self->event, 0, sizeof self->event);
    if (self->plan) {
        self->event = measure_expect(&self->machine, &self->step, self->distance_mm);
        return ERROR_OK;
    }
    self->why[0] = self->call->message[0] = '\0';
    if (daemon_should_stop(self->call)) {
        self->event.error = ERROR_CANCELLED;
    } else if (self->step.kind == MEASURE_STEP_LOOK) {
        look(self);
    } else if (self->step.kind == MEASURE_STEP_SURFACE) {
        surface(self);
    } else {
        self->size_px = measure_rig_subject_px(&self->machine);
        move(self);
    }
    read_state(self);
    int error = ERROR_OK;
    if (self->step.kind == MEASURE_STEP_BRINGUP && self->event.error == ERROR_OK) {
        struct measure_instrument instrument;
        take_instrument(self, &instrument);
        measure_refresh(&self->machine, &instrument);
        error = check_ready(self);
    }
    return error;
}

static int drive(struct measuring *self, const struct measure_request *request) {
    struct measure_instrument instrument;
    int error = check_ready(self);
    take_instrument(self, &instrument);
    self->step = measure_begin(&self->machine, request, &instrument);
    while (error == ERROR_OK && self->step.kind != MEASURE_STEP_END) {
        struct measure_report_step *noted = measure_report_add(
            &self->report, &self->step, self->plan ? self->report.seconds : elapsed_s(self));
        announce(self, noted);
        if (self->step.kind != MEASURE_STEP_PAIR || self->report.captures > 0) {
            note_steps(self);
        }
        error = carry_out(self);
        if (noted != NULL) {
            noted->taken_s = self->plan ? self->step.seconds : elapsed_s(self) - noted->at_s;
            self->report.seconds = noted->at_s + noted->taken_s;
            snprintf(noted->failed, sizeof noted->failed, "%.*s", MEASURE_REPORT_TEXT_BYTES - 1,
                     self->event.error != ERROR_OK ? self->why : "");
        }
        if (error == ERROR_OK) {
            self->step = measure_next(&self->machine, &self->event);
        }
    }
    return error;
}

// ---- the command

// The saved calibration: of all zooms where there is one; else of one state, which nothing may move
// away from.
static int load_calibration(struct measuring *self, const struct measure_request *request) {
    const struct command_call *call = self->call;
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
    if (request->wish != MEASURE_WISH_SUBJECT || request->has_place) {
        return command_fail(call, ERROR_MISSING,
                            "measure: fit, density, zoom and at need the calibration of all zooms "
                            "(\"calibration set instrument.zoom\" first)");
    }
    return ERROR_OK;
}

static int fail(const struct measuring *self) {
    const struct measure_result *result = &self->machine.result;
    char text[MESSAGE_BYTES];
    measure_report_failure(&self->report, result, self->session, self->why, text, sizeof text);
    return command_fail(self->call, result->error, "measure: %s", text);
}

static int conclude(struct measuring *self, const struct measure_request *request) {
    const struct measure_result *result = &self->machine.result;
    if (self->plan) {
        measure_report_put_plan(&self->report, self->call, result);
    } else {
        self->report.seconds = elapsed_s(self);
        measure_report_put(&self->report, self->call, self->name, self->session, request, result);
        self->call->message[0] = '\0';  // of steps that failed
    }
    return result->error == ERROR_OK ? ERROR_OK : fail(self);
}

static int run_with(struct measuring *self) {
    const struct command_call *call = self->call;
    struct measure_request request;
    const char *wrong = measure_request_make(call->values, &request);
    int error = wrong == NULL ? ERROR_OK : command_fail(call, ERROR_ARGUMENT, "measure: %s", wrong);
    if (error == ERROR_OK) {
        error = daemon_of(call)->session.recording
                    ? files_need_directory(call)
                    : commands_session_check_name(call, &call->values[MEASURE_REQUEST_NAME]);
    }
    error = error == ERROR_OK ? load_calibration(self, &request) : error;
    error = error == ERROR_OK ? commands_view_ray(call, self->zoom, &request, &self->place) : error;
    if (error != ERROR_OK) {
        return error;
    }
    self->begin_us = record_now_us(&daemon_of(call)->record);
    self->plan = command_is_set(&call->values[MEASURE_REQUEST_PLAN]);
    self->distance_mm =
        request.far_mm > 0 ? (request.near_mm + request.far_mm) / 2 : MEASURE_ANY_DISTANCE_MM;
    error = drive(self, &request);
    return error == ERROR_OK ? conclude(self, &request) : error;
}

static int run_measure(const struct command_call *call) {
    struct measuring *self = calloc(1, sizeof *self);
    if (self == NULL) {
        return command_fail(call, ERROR_MEMORY, "measure: out of memory");
    }
    const struct session *session = &daemon_of(call)->session;
    self->call = call;
    self->name = call->values[MEASURE_REQUEST_NAME].text;
    self->session = session->recording ? session->name : self->name;
    const int error = run_with(self);
    if (self->run != NULL) {
        surface_run_end(self->run);
    }
    free(self->run);
    free(self->zoom);
    free(self);
    return error;
}

static const struct command commands[] = {
    {.name = "measure",
     .summary = "measure the surface of what is in the middle, from cold to the result",
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
