// SPDX-License-Identifier: Apache-2.0
#include "console/pair/zoom_query.h"

#include <math.h>
#include <string.h>

#include "console/commands.h"
#include "console/pair/calibration_at.h"
#include "core/error.h"
#include "core/invariant.h"
#include "core/math.h"
#include "measure/measure_events.h"
#include "measure/zoom_expect.h"
#include "measure/zoom_forecast.h"
#include "rig/rig_optics.h"
#include "stereo/zoom/zoom_aim.h"

/// What was asked for, and what it is about.
struct zoom_query {
    const struct command_call *call;
    const struct command_host *host;
    const struct zoom_calibration *calibration;
    struct zoom_frames frames;
    struct zoom_wish wish;
    bool has_wish, has_pan;
    double distance_mm, point_mm[3];
    struct zoom_state state;
};

static const char *unit_of(enum zoom_wish_kind kind) {
    return kind == ZOOM_WISH_DENSITY ? "px/mm^2" : "mm";
}

// ---- where the lenses are

/// Sets the state from the last readings; a servo that was not set counts as straight ahead.
static int take_readings(struct zoom_query *self) {
    const struct command_call *call = self->call;
    struct calibration_match_state now;
    struct message message;
    self->host->read_state(call, &now);
    self->has_pan = true;
    for (int side = 0; side < RIG_SIDES; side++) {
        struct calibration_axis *pan = &now.origin.side[side].axis[CALIBRATION_PAN];
        if (pan->kind != CALIBRATION_AXIS_KNOWN) {
            *pan = (struct calibration_axis){.kind = CALIBRATION_AXIS_KNOWN};
            self->has_pan = false;
        }
    }
    const struct calibration_window window[RIG_SIDES] = {now.origin.side[0].window,
                                                         now.origin.side[1].window};
    self->frames = zoom_frames_of(window, now.width_px[RIG_LEFT], now.height_px[RIG_LEFT]);
    const int error = calibration_at_axes(&now, &self->state, &message);
    return error == ERROR_OK ? ERROR_OK : command_refuse(call, error, "zoom: %s", message.text);
}

/// The distance: as given, else where the left lens is focused since an autofocus.
static int find_distance(struct zoom_query *self) {
    const struct command_call *call = self->call;
    const struct command_value *given = &call->values[COMMANDS_ZOOM_DISTANCE];
    struct zoom_pair pair;
    zoom_pair_at(self->calibration->camera, &self->state, &pair);
    const double dioptre = pair.side[RIG_LEFT].focus_dioptre;
    if (!given->given && (call->rig->camera[RIG_LEFT].lens.focused_us == 0 || dioptre <= 0)) {
        return command_refuse(call, ERROR_MISSING,
                              "zoom: the distance is not known (add distance=MM, or \"autofocus\" "
                              "first)");
    }
    self->distance_mm = given->given ? given->number : 1000 / dioptre;
    zoom_point_ahead(self->calibration, self->distance_mm, 0, self->point_mm);
    return ERROR_OK;
}

// ---- the zoom for a wish

/// The distance nearest to which both lenses focus at a state.
static double nearest_mm(const struct zoom_query *self) {
    double nearest = 0;
    struct zoom_state at = self->state;
    struct zoom_pair ends[2];
    for (int end = 0; end < 2; end++) {
        for (int side = 0; side < RIG_SIDES; side++) {
            const struct zoom_range *focus = &self->calibration->camera[side].focus;
            at.side[side].focus_counts = end == 0 ? focus->min : focus->max;
        }
        zoom_pair_at(self->calibration->camera, &at, &ends[end]);
    }
    for (int side = 0; side < RIG_SIDES; side++) {
        const double dioptre =
            math_max(ends[0].side[side].focus_dioptre, ends[1].side[side].focus_dioptre);
        nearest = math_max(nearest, 1000 / math_max(dioptre, 1e-3));
    }
    return nearest;
}

/// With three digits.
static void add_wish(struct command_text *text, double value) {
    command_text_add_number(text, value, command_text_decimals(value));
}

static int refuse_wish(const struct zoom_query *self, int error, const struct zoom_range *reach) {
    const struct command_call *call = self->call;
    if (error != ERROR_RANGE) {
        return command_refuse(call, error, "zoom: %s", error_text(error));
    }
    if (reach->min > reach->max) {
        return command_refuse(
            call, error,
            "zoom: the lenses do not focus at %.0f mm (from about %.0f mm on: move "
            "the instrument away)",
            self->distance_mm, nearest_mm(self));
    }
    if (reach->min <= 0) {
        return command_refuse(call, error,
                              "zoom: the cameras do not both see the middle at %.0f mm%s (\"aim "
                              "distance=%.0f\" first)",
                              self->distance_mm, reach->max > 0 ? " at all zooms" : "",
                              self->distance_mm);
    }
    struct command_text text = command_text_begin(call->message, call->message_bytes);
    command_text_join(&text, "zoom: ", self->wish.kind == ZOOM_WISH_DENSITY ? "density " : "fit ");
    add_wish(&text, self->wish.value);
    command_text_print(&text, " %s is out of reach at %.0f mm (", unit_of(self->wish.kind),
                       self->distance_mm);
    add_wish(&text, reach->min);
    command_text_add(&text, " to ");
    add_wish(&text, reach->max);
    command_text_join(&text, " ", unit_of(self->wish.kind), ")");
    return error;
}

/// Moves an axis of both lenses to whole counts.
static int move(const struct zoom_query *self, const char *axis, const double counts[RIG_SIDES]) {
    char line[64];
    struct command_text text = command_text_begin(line, sizeof line);
    command_text_print(&text, "%s %d right=%d", axis, (int)math_round(counts[RIG_LEFT]),
                       (int)math_round(counts[RIG_RIGHT]));
    return self->host->give(self->call, line);
}

/// Moves zoom and focus as the wish needs it, and reads where they came to rest.
static int fulfil(struct zoom_query *self) {
    struct zoom_state to = self->state;
    struct zoom_range reach;
    int error =
        zoom_for_wish(self->calibration, &self->frames, &self->wish, self->point_mm, &to, &reach);
    if (error != ERROR_OK) {
        return refuse_wish(self, error, &reach);
    }
    if (command_is_set(&self->call->values[COMMANDS_ZOOM_PLAN])) {
        self->state = to;
        return ERROR_OK;
    }
    const double zoom[] = {to.side[0].zoom_counts, to.side[1].zoom_counts};
    const double focus[] = {to.side[0].focus_counts, to.side[1].focus_counts};
    error = move(self, "zoom", zoom);
    error = error == ERROR_OK ? move(self, "focus", focus) : error;
    return error == ERROR_OK ? take_readings(self) : error;
}

// ---- what it is good for

/// The irises that the forecast may choose from: all, for stated depths, else the present one.
static bool find_irises(const struct zoom_query *self, struct depth_iris_limits *limits) {
    const struct rig *rig = self->call->rig;
    int32_t present = 0;
    limits->dark = (double)INFINITY;
    if (rig_optics_iris_ends(rig, RIG_LEFT, &limits->open, &limits->closed) != ERROR_OK ||
        rig_optics_position(rig, RIG_LEFT, LENS_IRIS, &present) != ERROR_OK) {
        return false;
    }
    if (!self->call->values[COMMANDS_ZOOM_SHARP].given) {
        double f_number = 0;
        const int error = rig_optics_f_number(rig, RIG_LEFT, present, &f_number);
        INVARIANT(error == ERROR_OK);
        limits->open = math_max(limits->open, math_min(limits->closed, f_number));
        limits->closed = limits->open;
    }
    return true;
}

static void put_iris(const struct command_call *call, const struct depth_iris *iris) {
    reply_number(call, "f_number", iris->f_number, 2, "f/");
    commands_lens_distance(call, "sharp_near", iris->sharp_near_mm);
    commands_lens_distance(call, "sharp_far", iris->sharp_far_mm);
    if (call->values[COMMANDS_ZOOM_SHARP].given) {
        reply_text(call, "iris", commands_iris_text(iris->limit));
    }
}

// ---- what pairs would make of the error that all points share

struct expectation {
    const struct command_call *call;
    const struct command_host *host;
    const struct zoom_calibration *calibration;
    const struct zoom_frames *frames;
    struct zoom_expect_request request;
    enum measure_advice advice;  // that it is about; MEASURE_ADVICE_NOTHING: all of them
    struct zoom_expect expect;
    int error;
};

static void expect(void *cookie, struct arena *arena) {
    struct expectation *self = cookie;
    struct zoom_state other;
    zoom_expect_complete(self->calibration, &self->request, &other);
    self->request.only_helped = self->advice != MEASURE_ADVICE_NOTHING;
    self->request.other = self->advice != MEASURE_ADVICE_BOARD ? self->request.other : NULL;
    self->request.columns = self->advice != MEASURE_ADVICE_SECOND_ZOOM ? self->request.columns : 0;
    self->error =
        zoom_expect_at(self->calibration, self->frames, &self->request, arena, &self->expect);
}

static void serve(void *cookie) {
    const struct expectation *self = cookie;
    self->host->serve(self->call);
}

static int compute(const struct command_call *call, const struct command_host *host,
                   struct expectation *self) {
    self->call = call;
    self->host = host;
    if (host->serve != NULL) {
        self->request.watch = (struct watch){serve, self};
    }
    host->compute(call, zoom_expect_need_bytes(), expect, self);
    return self->error;
}

void zoom_query_expect(const struct command_call *call, const struct command_host *host,
                       const struct measure *measure, struct measure_event *event) {
    const struct zoom_calibration *calibration = measure->instrument.calibration;
    struct expectation self = {
        .calibration = calibration,
        .frames = &measure->instrument.frames,
        .advice = measure_advice_after(measure, event),
        .request = {
            .state = measure->pair_axes, .near_mm = measure->near_mm, .far_mm = measure->far_mm}};
    if (calibration == NULL || event->error != ERROR_OK ||
        (self.advice != MEASURE_ADVICE_BOARD && self.advice != MEASURE_ADVICE_SECOND_ZOOM)) {
        return;
    }
    zoom_point_ahead(calibration, event->surface.depth_mm, 0, self.request.point_mm);
    if (measure->subject_known) {
        memcpy(self.request.point_mm, measure->point_mm, sizeof self.request.point_mm);
    }
    if (compute(call, host, &self) == ERROR_OK) {
        event->surface.other_mm = self.expect.other_mm;
        event->surface.board_mm = self.expect.board_mm;
    }
}

static void put_expected(const struct zoom_query *self, double before_mm) {
    const struct command_call *call = self->call;
    const struct command_value *sharp = &call->values[COMMANDS_ZOOM_SHARP];
    struct expectation expected = {.calibration = self->calibration,
                                   .frames = &self->frames,
                                   .request = {.state = self->state}};
    if (sharp->given && isfinite(sharp->numbers[1])) {
        expected.request.near_mm = sharp->numbers[0];
        expected.request.far_mm = sharp->numbers[1];
    }
    memcpy(expected.request.point_mm, self->point_mm, sizeof self->point_mm);
    const int error =
        self->host->serve == NULL ? compute(call, self->host, &expected) : ERROR_UNSUPPORTED;
    const struct {
        const char *key;
        double sigma_mm;
    } shown[] = {{"unadjusted", before_mm},
                 {"pair", expected.expect.alone_mm},
                 {"other_zoom", expected.expect.other_mm},
                 {"board", expected.expect.board_mm}};
    reply_group_begin(call, "common_error", false);
    for (unsigned i = 0; i < (error == ERROR_OK ? 4 : 1); i++) {
        if (shown[i].sigma_mm >= 0) {
            reply_number(call, shown[i].key, shown[i].sigma_mm, 2, "mm");
        }
    }
    reply_group_end(call);
}

static void put_forecast(const struct zoom_query *self, const struct zoom_forecast *forecast) {
    static const char *const limits[] = {
        [ZOOM_FORECAST_PIXELS] = "the error of a point: a longer focal length would reduce it",
        [ZOOM_FORECAST_COMMON] =
            "the error that all points share: see common_error for what would reduce it",
        [ZOOM_FORECAST_DEPTH] = "the depth that is sharp",
    };
    const struct command_call *call = self->call;
    reply_number(call, "distance", self->distance_mm, 1, "mm");
    if (!call->values[COMMANDS_ZOOM_DISTANCE].given) {
        reply_text(call, "distance_from", "the focus");
    }
    if (!self->has_pan) {
        reply_text(call, "note", "pan was not set since the bring-up, and counts as 0");
    }
    if (self->has_wish) {
        reply_number(call, "wanted", self->wish.value, 3, unit_of(self->wish.kind));
    }
    reply_number(call, "density", forecast->field.density_per_mm2, 3, "px/mm^2");
    reply_number(call, "width", forecast->field.width_mm, 1, "mm");
    reply_number(call, "height", forecast->field.height_mm, 1, "mm");
    reply_number(call, "depth_per_px", forecast->field.depth_per_px_mm, 3, "mm");
    reply_number(call, "factor", forecast->factor, 2, "x");
    for (unsigned side = 0; side < RIG_SIDES; side++) {
        reply_group_begin(call, commands_side_name(side), false);
        reply_number(call, "zoom", self->state.side[side].zoom_counts, 2, "counts");
        reply_number(call, "focus", self->state.side[side].focus_counts, 2, "counts");
        reply_group_end(call);
    }
    if (forecast->has_iris) {
        put_iris(call, &forecast->iris);
    }
    reply_number(call, "point_error", forecast->point_mm, 3, "mm");
    put_expected(self, forecast->common_mm);
    reply_text(call, "limit", limits[forecast->limit]);
}

static int show(const struct zoom_query *self) {
    const struct command_call *call = self->call;
    const struct command_value *sharp = &call->values[COMMANDS_ZOOM_SHARP];
    struct depth_iris_limits limits = {0};
    struct zoom_forecast forecast;
    const bool has_irises = find_irises(self, &limits);
    const int error =
        zoom_forecast_at(self->calibration, &self->frames, &self->state, self->point_mm,
                         sharp->given ? sharp->numbers[0] : 0, sharp->given ? sharp->numbers[1] : 0,
                         has_irises ? &limits : NULL, &forecast);
    if (error == ERROR_OK && forecast.field.width_mm > 0) {
        put_forecast(self, &forecast);
        return ERROR_OK;
    }
    const struct zoom_range nothing = {0, 0};
    return refuse_wish(self, ERROR_RANGE, &nothing);
}

// ---- the command

static int check(const struct command_call *call, bool *has_wish) {
    const struct command_value *values = call->values;
    const bool density = values[COMMANDS_ZOOM_DENSITY].given, fit = values[COMMANDS_ZOOM_FIT].given;
    *has_wish = density || fit;
    if (density && fit) {
        return command_refuse(call, ERROR_ARGUMENT, "zoom: either density= or fit=, not both");
    }
    if (values[COMMANDS_ZOOM_SHARP].given &&
        values[COMMANDS_ZOOM_SHARP].numbers[0] > values[COMMANDS_ZOOM_SHARP].numbers[1]) {
        return command_refuse(call, ERROR_ARGUMENT,
                              "zoom: sharp=%s is not a range (the nearer distance first)",
                              values[COMMANDS_ZOOM_SHARP].text);
    }
    if (values[COMMANDS_ZOOM_POSITION].given || values[COMMANDS_ZOOM_SIDE].given ||
        values[COMMANDS_ZOOM_RIGHT].given) {
        return command_refuse(
            call, ERROR_ARGUMENT,
            "zoom: POSITION, side= and right= do not go with density=, fit=, distance=, sharp= "
            "and plan=, which concern both lenses");
    }
    return ERROR_OK;
}

static int run_query(struct zoom_query *self) {
    // The lenses may have been turned since they were last read.
    int error = self->host->give(self->call, COMMANDS_ZOOM);
    error = error == ERROR_OK ? take_readings(self) : error;
    error = error == ERROR_OK ? find_distance(self) : error;
    error = error == ERROR_OK && self->has_wish ? fulfil(self) : error;
    return error == ERROR_OK ? show(self) : error;
}

bool zoom_query_is_given(const struct command_value *values) {
    bool given = false;
    for (int i = COMMANDS_ZOOM_DENSITY; i < COMMANDS_ZOOM_ARGUMENTS; i++) {
        given = given || values[i].given;
    }
    return given;
}

int zoom_query_run(const struct command_call *call, const struct command_host *host,
                   const struct zoom_calibration *calibration) {
    const struct command_value *values = call->values;
    struct zoom_query query = {.call = call, .host = host, .calibration = calibration};
    const int error = check(call, &query.has_wish);
    const bool density = values[COMMANDS_ZOOM_DENSITY].given;
    query.wish =
        (struct zoom_wish){density ? ZOOM_WISH_DENSITY : ZOOM_WISH_WIDTH,
                           values[density ? COMMANDS_ZOOM_DENSITY : COMMANDS_ZOOM_FIT].number};
    return error == ERROR_OK ? run_query(&query) : error;
}
