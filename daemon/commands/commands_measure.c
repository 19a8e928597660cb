// SPDX-License-Identifier: Apache-2.0
// One command from a cold instrument to a surface. The decisions are those of firmware/measure;
// here each step becomes commands of the console, and what they showed becomes its event. Surfaces
// are computed on another thread, while this one, the rig's, looks after the rig.
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "console/measure_text.h"
#include "core/math.h"
#include "daemon/base/monotonic.h"
#include "daemon/commands/commands.h"
#include "daemon/commands/space_check.h"
#include "daemon/commands/surface_run.h"
#include "daemon/measure/measure_look.h"
#include "daemon/measure/measure_report.h"
#include "daemon/measure/measure_rig.h"
#include "measure/measure_dark.h"
#include "rig/base/rig_clock.h"
#include "rig/rig_optics.h"

enum { NAME, FIT, DENSITY, ZOOM, NEAR, FAR, QUICK, ARGUMENTS };

enum {
    PAIRS = 4,  // that a measurement takes at most, but for those that moved
    // What the sensor's black level is by its data sheet, of 10 bits: reading it would be a call
    // that no recorded command makes.
    BLACK_Q10 = 42,
};

// A coarse surface: a quarter of the pixels a side, and as near as lenses focus.
static const double look_scale = 0.25, look_near_mm = 500, look_margin = 1.2;
// Where memory is short, or more disparities would be searched than the matcher has room for, the
// smallest scale of a surface that is worth having.
static const double scale_min = 0.2;
static const double us_per_s = 1e6, um_per_mm = 1e3;

// One measurement. Allocated, as it is large.
struct measuring {
    const struct command_call *call;
    struct zoom_calibration *zoom;  // NULL: none
    struct measure machine;
    struct measure_step step;
    struct measure_event event;
    struct measure_report report;
    const char *name;
    const char *session;      // of the pairs
    double size_px;           // of the subject in the left picture; 0: not known
    char why[MESSAGE_BYTES];  // of the last step that failed
    uint64_t begin_us;        // rig's clock
    bool space_checked;
    struct surface_run *run;
    int run_error;
    atomic_bool stop;
    const char *_Atomic stage;
    atomic_int done, total;
    double light_mean, light_limited;  // of the answer of autoexpose, %
};

static double elapsed_s(const struct measuring *self) {
    return (double)(rig_now_us(self->call->rig) - self->begin_us) / us_per_s;
}

// ---- the answers of commands

static void catch_number(void *cookie, const char *key, double value, int decimals,
                         const char *unit) {
    struct measuring *self = cookie;
    (void)decimals;
    (void)unit;
    if (key != NULL && strcmp(key, "mean") == 0) {
        self->light_mean = self->light_mean > 0 ? fmin(self->light_mean, value) : value;
    }
}

static void catch_text(void *cookie, const char *key, const char *value) {
    struct measuring *self = cookie;
    if (key != NULL && strcmp(key, "limit") == 0 && strncmp(value, "too dark", 8) == 0) {
        self->light_limited = 1;
    }
}

static void catch_begin(void *cookie, const char *key, bool array) {
    (void)cookie;
    (void)key;
    (void)array;
}

static void catch_end(void *cookie) {
    (void)cookie;
}

static int give(struct measuring *self, const char *line) {
    static const struct command_reply_operations operations = {catch_number, catch_text,
                                                               catch_begin, catch_end};
    const struct command_reply reply = {&operations, self};
    return command_give(self->call, line, &reply);
}

// ---- steps that move the rig

static void read_light(struct measuring *self) {
    static const double target_percent = 50;
    const struct rig_camera *camera = &self->call->rig->camera[RIG_LEFT];
    self->event.light.exposure_us = camera->exposure_us;
    self->event.light.gain = camera->gain_q3 / 8.0;
    self->event.light.reached =
        self->light_limited > 0 ? fmax(1e-3, self->light_mean / target_percent) : 1;
}

static void read_focus(struct measuring *self) {
    const struct rig *rig = self->call->rig;
    double distance_mm = 0;
    if (rig_optics_distance_at(
            rig, RIG_LEFT, (int32_t)math_round(rig->camera[RIG_LEFT].focus.search.result.position),
            &distance_mm) == ERROR_OK &&
        distance_mm < INFINITY) {
        self->event.focus_mm = distance_mm;
    }
}

// Part of the subject that is dark in the left frame.
static double dark_part(const struct measuring *self, const struct pair_frame *frame) {
    const struct raw_image *image = &frame->image;
    const uint16_t black = frame->window.skip > 0 ? BLACK_Q10 : 0;
    const int skip = frame->window.skip > 0 ? frame->window.skip : 1;
    struct measure_box box = {0, 0, image->width_px, image->height_px};
    if (self->step.has_place && self->size_px > 0) {
        const double half_px = self->size_px / 2;
        box = (struct measure_box){
            (int)((self->step.place_px[0][0] - half_px - frame->window.column_px) / skip),
            (int)((self->step.place_px[0][1] - half_px - frame->window.row_px) / skip),
            (int)(self->size_px / skip), (int)(self->size_px / skip)};
    }
    return measure_dark_permille(image, black, &box) / 1e3;
}

static void read_pair(struct measuring *self) {
    struct measure_report *report = &self->report;
    struct captured_pair *captured = last_pair_use(&daemon_of(self->call)->last_pair);
    if (captured == NULL) {
        self->event.error = ERROR_MISSING;
        return;
    }
    const struct pair_frame *left = &captured->pair.frame[RIG_LEFT];
    self->event.pair.number = captured->pair.number;
    if (left->parts == 0) {
        self->event.pair.dark_part = dark_part(self, left);
    }
    report->captures++;
    if (self->step.phase == MEASURE_PAIR || self->step.phase == MEASURE_MERGED) {
        report->f_number = measure_rig_f_number(self->call->rig);
        report->exposures = left->parts > 0 ? left->parts : left->exposure_us != 0 ? 1 : 0;
        for (int i = 0; i < report->exposures; i++) {
            report->exposure_us[i] =
                left->parts > 0 ? left->part[i].exposure_us : left->exposure_us;
        }
    }
    last_pair_give_back(captured);
}

static void move(struct measuring *self) {
    struct measure_rig_lines lines;
    const bool recording = daemon_of(self->call)->session.recording;
    self->light_mean = self->light_limited = 0;
    measure_rig_lines_of(self->call->rig, &self->step, recording ? NULL : self->name, self->size_px,
                         &lines);
    for (int i = 0; i < lines.count && self->event.error == ERROR_OK; i++) {
        self->event.error = give(self, lines.line[i]);
    }
    if (self->event.error != ERROR_OK) {
        snprintf(self->why, sizeof self->why, "%s", self->call->message);
    } else if (self->step.kind == MEASURE_STEP_LIGHT) {
        read_light(self);
    } else if (self->step.kind == MEASURE_STEP_AUTOFOCUS) {
        read_focus(self);
    } else if (self->step.kind == MEASURE_STEP_PAIR) {
        read_pair(self);
    }
    if (self->step.kind == MEASURE_STEP_LIGHT && self->event.error == ERROR_UNSUPPORTED) {
        self->event.error = ERROR_OK;  // a camera that exposes by itself
        self->event.light.reached = 1;
    }
}

// ---- steps that compute

static bool should_stop(void *cookie) {
    struct measuring *self = cookie;
    return atomic_load(&self->stop);
}

static void note_progress(void *cookie, int stage, const char *what, int done, int total) {
    struct measuring *self = cookie;
    (void)stage;
    atomic_store(&self->stage, what);
    atomic_store(&self->done, done);
    atomic_store(&self->total, total);
}

static void compute(void *cookie) {
    struct measuring *self = cookie;
    self->run_error = surface_run(self->run);
}

static void watch(void *cookie) {
    struct measuring *self = cookie;
    const char *stage = atomic_load(&self->stage);
    const int total = atomic_load(&self->total);
    if (daemon_should_stop(self->call)) {
        atomic_store(&self->stop, true);
    }
    if (stage != NULL && total > 0) {
        daemon_progress(self->call, stage, (uint32_t)atomic_load(&self->done), (uint32_t)total);
    }
}

// Runs a reconstruction that `prepare` has filled in; its results are there until the next one.
static int run_surface(struct measuring *self, const struct surface_run *prepared) {
    const uint64_t begin_us = monotonic_now_us();
    if (self->run != NULL) {
        surface_run_end(self->run);
        free(self->run);
    }
    self->run = malloc(sizeof *self->run);
    if (self->run == NULL) {
        snprintf(self->why, sizeof self->why, "out of memory");
        return ERROR_MEMORY;
    }
    *self->run = *prepared;
    self->run->daemon = daemon_of(self->call);
    self->run->should_stop = should_stop;
    self->run->progress = note_progress;
    self->run->self = self;
    snprintf(self->run->session, sizeof self->run->session, "%s", self->session);
    atomic_store(&self->stage, (const char *)NULL);
    if (!worker_compute(job_of(self->call)->worker, compute, watch, self)) {
        snprintf(self->why, sizeof self->why, "out of memory for a thread");
        return ERROR_MEMORY;
    }
    if (self->run_error != ERROR_OK) {
        snprintf(self->why, sizeof self->why, "%s", self->run->message);
    }
    self->report.computing_seconds += (double)(monotonic_now_us() - begin_us) / us_per_s;
    return self->run_error;
}

// The width in which the subject is, by what is wanted.
static void set_width(const struct measuring *self, const struct pair_frame *frame,
                      struct measure_look *look) {
    const struct measure_request *request = &self->machine.request;
    const struct zoom_camera *camera = &self->zoom->camera[RIG_LEFT];
    const double sensor_px = frame->image.width_px * fmax(frame->window.skip, 1);
    if (request->wish == MEASURE_WISH_FIT) {
        look->width_mm = look_margin * request->value;
    } else if (request->wish == MEASURE_WISH_DENSITY) {
        look->width_mm = look_margin * frame->image.width_px / sqrt(request->value);
    } else if (request->wish == MEASURE_WISH_ZOOM) {
        const double wide_px = zoom_function_value(camera, ZOOM_FOCAL, camera->zoom.min);
        look->width_per_mm = look_margin * sensor_px / (request->value * wide_px);
    }
}

static void look(struct measuring *self) {
    struct surface_run *prepared = calloc(1, sizeof *prepared);
    if (prepared == NULL) {
        self->event.error = ERROR_MEMORY;
        return;
    }
    prepared->captured = last_pair_use(&daemon_of(self->call)->last_pair);
    prepared->request = reconstruct_request_defaults();
    prepared->request.scale = look_scale;
    prepared->request.depth_mm[0] = self->step.near_mm > 0 ? self->step.near_mm : look_near_mm;
    prepared->request.depth_mm[1] = self->step.far_mm > 0 ? self->step.far_mm : (double)INFINITY;
    (void)reconstruct_request_check_search(&prepared->request);
    self->event.error = run_surface(self, prepared);
    free(prepared);
    if (self->event.error != ERROR_OK) {
        return;
    }
    const struct pair_frame *frame = self->run->source.pair.pair.frame;
    const struct calibration_window window = {frame[RIG_RIGHT].window.column_px,
                                              frame[RIG_RIGHT].window.row_px,
                                              frame[RIG_RIGHT].window.skip};
    struct measure_look request = {.near_mm = self->step.near_mm, .far_mm = self->step.far_mm};
    set_width(self, &frame[RIG_LEFT], &request);
    if (!measure_look_find(&self->run->job.context, &window, &request, &self->event)) {
        self->event.error = ERROR_NO_SURFACE;
        snprintf(self->why, sizeof self->why, "the coarse surface has nothing in the middle");
    }
}

static void surface(struct measuring *self) {
    struct surface_run *prepared = calloc(1, sizeof *prepared);
    if (prepared == NULL) {
        self->event.error = ERROR_MEMORY;
        return;
    }
    prepared->keep = true;
    prepared->request = reconstruct_request_defaults();
    prepared->request.pair = (int)self->step.pair;
    prepared->request.with_pair = (int)self->step.with_pair;
    // As the note of it has them, so that the same surface follows from it.
    prepared->request.depth_mm[0] = math_round(self->step.near_mm * um_per_mm) / um_per_mm;
    prepared->request.depth_mm[1] = math_round(self->step.far_mm * um_per_mm) / um_per_mm;
    (void)reconstruct_request_check_search(&prepared->request);
    self->event.error = run_surface(self, prepared);
    while ((self->event.error == ERROR_MEMORY || self->event.error == ERROR_DISPARITY_RANGE) &&
           prepared->request.scale / 2 >= scale_min) {
        prepared->request.scale /= 2;
        self->event.error = run_surface(self, prepared);
    }
    self->report.scale = prepared->request.scale;
    free(prepared);
    if (self->event.error != ERROR_OK) {
        return;
    }
    const struct reconstruct_context *context = &self->run->job.context;
    measure_report_surface(&self->report, context, &self->event);
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
    const int error = self->zoom != NULL
                          ? commands_calibration_check_zoom(self->call, self->zoom, false)
                          : ERROR_OK;
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

// The subject's size in the left picture, by what the last look showed.
static void size_subject(struct measuring *self) {
    const double width_mm = self->machine.width_mm, distance_mm = self->machine.distance_mm;
    if (self->zoom != NULL && width_mm > 0 && distance_mm > 0) {
        const double f_px = zoom_function_value(&self->zoom->camera[RIG_LEFT], ZOOM_FOCAL,
                                                self->machine.axes.side[RIG_LEFT].zoom_counts);
        self->size_px = f_px * width_mm / distance_mm;
    }
}

static int carry_out(struct measuring *self) {
    memset(&self->event, 0, sizeof self->event);
    self->why[0] = self->call->message[0] = '\0';
    if (daemon_should_stop(self->call)) {
        self->event.error = ERROR_CANCELLED;
    } else if (self->step.kind == MEASURE_STEP_LOOK) {
        look(self);
    } else if (self->step.kind == MEASURE_STEP_SURFACE) {
        surface(self);
    } else {
        size_subject(self);
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
        struct measure_report_step *noted =
            measure_report_add(&self->report, &self->step, elapsed_s(self));
        announce(self, noted);
        error = carry_out(self);
        if (noted != NULL) {
            noted->taken_s = elapsed_s(self) - noted->at_s;
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

static int make_request(const struct command_call *call, struct measure_request *request) {
    static const enum measure_wish wishes[] = {
        [FIT] = MEASURE_WISH_FIT, [DENSITY] = MEASURE_WISH_DENSITY, [ZOOM] = MEASURE_WISH_ZOOM};
    const struct command_value *values = call->values;
    memset(request, 0, sizeof *request);
    for (int i = FIT; i <= ZOOM; i++) {
        if (values[i].given && request->wish != MEASURE_WISH_SUBJECT) {
            return command_fail(call, ERROR_ARGUMENT,
                                "measure: fit, density and zoom exclude each other (give one)");
        }
        if (values[i].given) {
            request->wish = wishes[i];
            request->value = values[i].number;
        }
    }
    request->near_mm = values[NEAR].given ? values[NEAR].number : 0;
    request->far_mm = values[FAR].given ? values[FAR].number : 0;
    request->quick = command_is_set(&values[QUICK]);
    if (values[NEAR].given != values[FAR].given || request->near_mm > request->far_mm) {
        return command_fail(call, ERROR_ARGUMENT,
                            "measure: near and far need each other, near first (near=1700 "
                            "far=2000)");
    }
    return ERROR_OK;
}

// The saved calibration: of all zooms where there is one; else of one state, which nothing may move
// away from.
static int load_calibration(struct measuring *self, const struct measure_request *request) {
    const struct command_call *call = self->call;
    const int error = commands_calibration_zoom(call, &self->zoom);
    if (error != ERROR_MISSING) {
        return error;
    }
    self->zoom = NULL;
    char *text = malloc(STORE_CALIBRATION_BYTES);
    size_t length = 0;
    const int missing = daemon_of(call)->store == NULL ? ERROR_MISSING
                        : text == NULL                 ? ERROR_MEMORY
                                       : commands_store_load(call, STORE_CALIBRATION, text,
                                                             STORE_CALIBRATION_BYTES, &length);
    free(text);
    if (missing != ERROR_OK) {
        return command_fail(call, missing,
                            "measure: no calibration is saved (\"calibration set FILE\" first)");
    }
    if (request->wish != MEASURE_WISH_SUBJECT) {
        return command_fail(call, ERROR_MISSING,
                            "measure: fit, density and zoom need the calibration of all zooms "
                            "(\"calibration set instrument.zoom\" first)");
    }
    return ERROR_OK;
}

static int check_name(const struct measuring *self) {
    const struct command_call *call = self->call;
    if (!daemon_of(call)->session.recording) {
        return commands_session_check_name(call, &call->values[NAME]);
    }
    return files_need_directory(call);
}

// What is left of a measurement that ended without a surface.
static int fail(const struct measuring *self, int error, const char *why) {
    char text[MESSAGE_BYTES];
    const unsigned pairs = self->report.captures;
    snprintf(text, sizeof text, "%s", why);
    if (pairs == 0) {
        return command_fail(self->call, error, "measure: %s", text);
    }
    return command_fail(self->call, error, "measure: %.700s; %s has %u pair%s (\"reconstruct %s\")",
                        text, self->session, pairs, pairs > 1 ? "s" : "", self->session);
}

static int conclude(struct measuring *self, int error, const struct measure_request *request) {
    const struct measure_result *result = &self->machine.result;
    self->report.seconds = elapsed_s(self);
    measure_report_put(&self->report, self->call, self->name, self->session, request, result);
    if (error != ERROR_OK) {
        char why[MESSAGE_BYTES];
        snprintf(why, sizeof why, "%s", self->call->message);
        return command_fail(self->call, error, "%s", why);
    }
    if (result->error == ERROR_OK) {
        self->call->message[0] = '\0';  // of steps that failed
        return ERROR_OK;
    }
    char why[MESSAGE_BYTES];
    snprintf(why, sizeof why, "%s: %.600s", measure_phase_text(result->phase),
             result->error == ERROR_CANCELLED ? "cancelled"
             : self->why[0] != '\0'           ? self->why
                                              : error_text(result->error));
    return fail(self, result->error, why);
}

static int run_with(struct measuring *self) {
    const struct command_call *call = self->call;
    struct measure_request request;
    int error = make_request(call, &request);
    error = error == ERROR_OK ? check_name(self) : error;
    error = error == ERROR_OK ? load_calibration(self, &request) : error;
    if (error != ERROR_OK) {
        return error;
    }
    self->begin_us = rig_now_us(call->rig);
    error = drive(self, &request);
    return conclude(self, error, &request);
}

static int run_measure(const struct command_call *call) {
    struct measuring *self = calloc(1, sizeof *self);
    if (self == NULL) {
        return command_fail(call, ERROR_MEMORY, "measure: out of memory");
    }
    const struct session *session = &daemon_of(call)->session;
    self->call = call;
    self->name = call->values[NAME].text;
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

static const struct command_argument arguments[ARGUMENTS] = {
    {.name = "NAME",
     .kind = COMMAND_TEXT,
     .min = 1,
     .max = 60,
     .help = "of the new session: letters, digits and - _ . + = , @"},
    {.name = "fit",
     .kind = COMMAND_NUMBER,
     .min = 1,
     .max = 1e6,
     .unit = "mm",
     .help = "width that both cameras see at the subject; default: 1.25 times its own"},
    {.name = "density",
     .kind = COMMAND_NUMBER,
     .min = 1e-3,
     .max = 1e6,
     .value_name = "PX_PER_MM2",
     .help = "pixels for each square millimetre of the subject, in place of fit"},
    {.name = "zoom",
     .kind = COMMAND_NUMBER,
     .min = 1,
     .max = 1000,
     .units = "x",
     .help = "magnification, in place of fit"},
    {.name = "near",
     .kind = COMMAND_NUMBER,
     .min = 1,
     .max = 1e6,
     .unit = "mm",
     .help = "nearest depth of the subject; default: as the wide view shows it"},
    {.name = "far",
     .kind = COMMAND_NUMBER,
     .min = 1,
     .max = 1e6,
     .unit = "mm",
     .help = "farthest depth"},
    {.name = "quick", .kind = COMMAND_FLAG, .help = "one look, and no pair at a second zoom"},
};

static const struct command commands[] = {
    {.name = "measure",
     .summary = "measure the surface of what is in the middle, from cold to the result",
     .help =
         "Example: measure cup fit=300. Brings up the instrument if needed, looks at the widest "
         "zoom how far away and how deep the subject is, aims, zooms, closes the iris for its "
         "depth, focuses, exposes, takes pairs into the session NAME and computes "
         "surface-NAME-PAIR with the saved calibration of all zooms. Says each decision and its "
         "reason, what the result is good for, what it lost on its way, and what would make it "
         "better. Where a step fails it goes on with less if that is honest. With a calibration "
         "of one state nothing moves. After Ctrl-C the rig is at rest, and the pairs that were "
         "taken can be reconstructed.",
     .arguments = arguments,
     .argument_count = ARGUMENTS,
     .flags =
         COMMAND_LONG | COMMAND_MOVES | COMMAND_UNRECORDED | COMMAND_GROUP_MEASURE | COMMAND_DAILY,
     .run = run_measure},
};

const struct command *commands_measure_table(size_t *count) {
    *count = 1;
    return commands;
}
