// SPDX-License-Identifier: Apache-2.0
#include "console/measure/measure_driver.h"

#include <math.h>
#include <string.h>

#include "console/measure/measure_look.h"
#include "console/measure/measure_request.h"
#include "console/measure/measure_rig.h"
#include "console/measure/measure_share.h"
#include "console/measure_text.h"
#include "core/error.h"
#include "core/invariant.h"
#include "core/math.h"
#include "measure/measure_tuning.h"

// Where memory is short, or more disparities would be searched than the matcher has room for, the
// smallest scale of a surface that is worth having.
static const double scale_min = 0.2, us_per_s = 1e6, um_per_mm = 1e3;

static double elapsed_s(const struct measure_driver *self) {
    return (double)(self->host->now_us(self->call) - self->begin_us) / us_per_s;
}

static struct command_text begin_why(struct measure_driver *self) {
    return command_text_begin(self->why, sizeof self->why);
}

// ---- steps that move the rig

static void read_pair(struct measure_driver *self) {
    const struct pair *pair = self->host->use_pair(self);
    INVARIANT(pair != NULL);  // it has just been taken
    const struct pair_frame *left = &pair->frame[RIG_LEFT];
    self->event.pair.number = pair->number;
    if (left->parts == 0) {
        self->event.pair.dark_part = measure_rig_dark_part(left, &self->step, self->size_px);
    }
    measure_report_pair(&self->report, self->step.phase, left,
                        measure_rig_f_number(self->call->rig));
    self->host->give_back(self);
}

static void move(struct measure_driver *self) {
    struct measure_rig_lines lines;
    struct measure_rig_light light = {.mean_percent = 0};
    const struct command_reply reply = measure_rig_light_reply(&light);
    measure_rig_lines_of(self->call->rig, &self->step, self->session, self->size_px, &lines);
    for (int i = 0; i < lines.count && self->event.error == ERROR_OK; i++) {
        self->event.error = self->host->give(self->call, lines.line[i], &reply);
    }
    if (self->event.error != ERROR_OK) {
        struct command_text why = begin_why(self);
        command_text_add(&why, self->call->message);
    } else if (self->step.kind == MEASURE_STEP_PAIR) {
        read_pair(self);
    }
    measure_rig_read_search(self->call->rig, &self->step, &light, self->why, &self->event);
}

// ---- steps that compute

static void compute(struct measure_driver *self, const struct measure_search *search, bool keep) {
    self->why[0] = '\0';
    self->event.error = self->host->compute(self, search, keep);
    if (self->event.error == ERROR_NO_SURFACE && self->why[0] == '\0') {
        struct command_text why = begin_why(self);
        measure_report_no_surface(self->surface.result, &self->machine.request, &why);
    }
    self->report.computing_seconds += self->surface.seconds;
}

static void look(struct measure_driver *self) {
    struct measure_search search;
    const struct pair *pair = self->host->use_pair(self);
    INVARIANT(pair != NULL);
    measure_look_prepare(&self->step, &pair->frame[RIG_LEFT], &search);
    compute(self, &search, false);
    if (self->event.error == ERROR_OK &&
        !measure_look_at(&self->surface, &self->machine, &self->step, &self->place, &self->event)) {
        struct command_text why = begin_why(self);
        self->event.error = ERROR_NO_SURFACE;
        measure_report_no_subject(&self->machine.request, &why);
    }
    self->host->give_back(self);
}

static void report_surface(void *cookie, struct arena *arena) {
    struct measure_driver *self = cookie;
    const struct surface_figures_depths depths =
        measure_look_depths(&self->surface, &self->machine, &self->place, arena);
    measure_report_surface(&self->report, &self->surface, &depths, arena, &self->event);
}

static void surface(struct measure_driver *self) {
    const struct measure_step *step = &self->step;
    // As a note states it, so that the same surface follows from that.
    struct measure_search search = {
        .pair = step->pair,
        .with_pair = step->with_pair,
        .near_mm = math_round(step->near_mm * um_per_mm) / um_per_mm,
        .far_mm = math_round(step->far_mm * um_per_mm) / um_per_mm,
        .scale = step->scale,
    };
    bool too_large = true;
    while (too_large) {
        compute(self, &search, true);
        self->report.scale = search.scale;
        too_large =
            (self->event.error == ERROR_MEMORY || self->event.error == ERROR_DISPARITY_RANGE) &&
            (search.scale /= 2) >= scale_min;
    }
    if (self->event.error != ERROR_OK) {
        return;
    }
    self->host->commands->compute(self->call, measure_share_need_bytes(self->surface.result),
                                  report_surface, self);
    zoom_query_expect(self->call, self->host->commands, &self->machine, &self->event);
    struct command_text result =
        command_text_begin(self->report.result, sizeof self->report.result);
    command_text_add(&result, self->surface.name);
}

// ---- the loop

static void take_instrument(const struct measure_driver *self,
                            struct measure_instrument *instrument) {
    struct calibration_match_state now;
    self->host->commands->read_state(self->call, &now);
    measure_rig_instrument(self->call->rig, &now, self->zoom, instrument);
}

static int check_ready(struct measure_driver *self) {
    if (self->checked || self->call->rig->state != RIG_READY) {
        return ERROR_OK;
    }
    self->checked = true;
    return self->host->check(self);
}

static void announce(const struct measure_driver *self, const struct measure_report_step *noted) {
    const double at_s = elapsed_s(self);
    const double left_s = self->step.seconds + self->step.seconds_left;
    if (noted != NULL && !self->plan) {
        self->host->progress(self->call, noted->text, (uint32_t)at_s,
                             (uint32_t)(at_s + left_s + 1));
    }
}

// What is known of where the rig is, after a step.
static void read_state(struct measure_driver *self) {
    struct calibration_match_state now;
    self->host->commands->read_state(self->call, &now);
    measure_rig_axes(&now, &self->event.axes);
    self->event.f_number = measure_rig_f_number(self->call->rig);
    self->event.lost = self->call->rig->state != RIG_READY;
}

static int carry_out(struct measure_driver *self) {
    memset(&self->event, 0, sizeof self->event);
    if (self->plan) {
        self->event = measure_expect(&self->machine, &self->step, self->distance_mm);
        return ERROR_OK;
    }
    self->why[0] = self->call->message[0] = '\0';
    // A surface that is not computed here any more is noted, so that a PC can.
    if (self->step.kind != MEASURE_STEP_SURFACE && self->host->should_stop(self->call)) {
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

static int drive(struct measure_driver *self, const struct measure_request *request) {
    struct measure_instrument instrument;
    int error = check_ready(self);
    take_instrument(self, &instrument);
    self->step = measure_begin(&self->machine, request, &instrument);
    while (error == ERROR_OK && self->step.kind != MEASURE_STEP_END) {
        struct measure_report_step *noted = measure_report_add(
            &self->report, &self->step, self->plan ? self->report.seconds : elapsed_s(self));
        announce(self, noted);
        if (self->host->note != NULL && !self->plan &&
            (self->step.kind != MEASURE_STEP_PAIR || self->report.captures > 0)) {
            self->host->note(self);
        }
        error = carry_out(self);
        if (noted != NULL) {
            noted->taken_s = self->plan ? self->step.seconds : elapsed_s(self) - noted->at_s;
            self->report.seconds = noted->at_s + noted->taken_s;
            struct command_text failed = command_text_begin(noted->failed, sizeof noted->failed);
            command_text_add(&failed, self->event.error != ERROR_OK ? self->why : "");
        }
        if (error == ERROR_OK) {
            self->step = measure_next(&self->machine, &self->event);
        }
    }
    return error;
}

static int conclude(struct measure_driver *self, const struct measure_request *request) {
    struct measure_result *result = &self->machine.result;
    const bool cancelled = result->error == ERROR_CANCELLED;
    if (result->error == ERROR_NO_SURFACE && self->why[0] != '\0') {
        result->advice = MEASURE_ADVICE_NOTHING;  // the reason has its own
    }
    if (result->error == ERROR_OVERLAP && self->report.steps == 0) {
        return command_refuse(self->call, ERROR_OVERLAP,
                              "measure: nothing from %.0f to %.0f mm is in the view of both "
                              "cameras (state other near and far, or \"aim\" there first)",
                              request->near_mm, request->far_mm);
    }
    if (self->plan) {
        measure_report_put_plan(&self->report, self->call, result);
    } else {
        self->report.seconds = elapsed_s(self);
        measure_report_put(&self->report, self->call, self->name, self->pairs, request, result,
                           cancelled ? "" : self->why);
        self->call->message[0] = '\0';  // of steps that failed
    }
    if (result->error == ERROR_OK) {
        return ERROR_OK;
    }
    char text[MESSAGE_BYTES];
    struct command_text failure = command_text_begin(text, sizeof text);
    measure_report_failure(&self->report, result, self->pairs, self->why, &failure);
    return command_refuse(self->call, result->error, "measure: %s", text);
}

int measure_driver_run(struct measure_driver *self, const struct measure_request *request) {
    self->begin_us = self->host->now_us(self->call);
    self->distance_mm =
        request->far_mm > 0 ? (request->near_mm + request->far_mm) / 2 : MEASURE_ANY_DISTANCE_MM;
    const int error = drive(self, request);
    return error == ERROR_OK ? conclude(self, request) : error;
}
