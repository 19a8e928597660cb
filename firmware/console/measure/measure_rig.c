// SPDX-License-Identifier: Apache-2.0
#include "console/measure/measure_rig.h"

#include <math.h>
#include <string.h>

#include "console/commands.h"
#include "core/error.h"
#include "core/invariant.h"
#include "core/math.h"
#include "measure/measure_dark.h"
#include "rig/auto/exposure_camera.h"
#include "rig/rig_optics.h"

enum {
    // A search of the focus needs texture in its region, and is faster the smaller that is.
    FOCUS_REGION_PX = 256,
    LIGHT_REGION_MIN_PX = 64,
    // Readings of the lens positions for each pair: they decide its focal length.
    PAIR_READINGS = 16,
    // The sensor's black level by its data sheet, of 10 bits: reading it would be a call that no
    // recorded command makes.
    BLACK_Q10 = 42,
};

// ---- what it is

static bool has_axis(const struct rig *rig, enum lens_axis axis) {
    return rig_has_axis(&rig->profile, RIG_LEFT, axis) &&
           rig_has_axis(&rig->profile, RIG_RIGHT, axis);
}

static double f_number_at(const struct rig *rig, int32_t iris) {
    double f_number = 0;
    return rig_optics_f_number(rig, RIG_LEFT, iris, &f_number) == ERROR_OK ? f_number : 0;
}

void measure_rig_instrument(const struct rig *rig, const struct calibration_match_state *now,
                            const struct zoom_calibration *zoom,
                            struct measure_instrument *instrument) {
    const struct lens_axis_settings *iris = &rig->profile.lens.axis[LENS_IRIS];
    memset(instrument, 0, sizeof *instrument);
    instrument->ready = rig->state == RIG_READY;
    instrument->servos = rig->profile.servos;
    instrument->zoom = has_axis(rig, LENS_ZOOM);
    instrument->focus = has_axis(rig, LENS_FOCUS);
    instrument->iris = has_axis(rig, LENS_IRIS);
    instrument->exposure = true;
    instrument->brackets = rig->profile.bridge;
    instrument->mosaic = rig->profile.bridge;
    instrument->calibration = zoom;
    measure_rig_axes(now, &instrument->axes);
    if (instrument->iris) {
        instrument->f_number_open = f_number_at(rig, iris->max);
        instrument->f_number_closed = f_number_at(rig, iris->min);
    }
    if (instrument->ready) {
        const struct exposure_limits limits = exposure_camera_limits(rig, RIG_LEFT);
        const struct calibration_window windows[2] = {now->origin.side[RIG_LEFT].window,
                                                      now->origin.side[RIG_RIGHT].window};
        instrument->exposure_max_us = limits.max_us;
        instrument->gain_max = limits.gain_max_q3 / 8.0;
        instrument->steady_us = limits.mains_half_us * (limits.gain_min_q3 / 8.0);
        instrument->frames =
            zoom_frames_of(windows, now->width_px[RIG_LEFT], now->height_px[RIG_LEFT]);
    }
}

// ---- where it is

static double position_of(const struct calibration_axis *axis) {
    return axis->kind == CALIBRATION_AXIS_KNOWN ? axis->mean : (double)NAN;
}

void measure_rig_axes(const struct calibration_match_state *now, struct zoom_state *axes) {
    for (int side = 0; side < RIG_SIDES; side++) {
        const struct calibration_axis *axis = now->origin.side[side].axis;
        axes->side[side] = (struct zoom_camera_state){
            .zoom_counts = position_of(&axis[CALIBRATION_ZOOM]),
            .focus_counts = position_of(&axis[CALIBRATION_FOCUS]),
            .pan_rad = position_of(&axis[CALIBRATION_PAN]) * MATH_RAD_PER_DEGREE,
        };
    }
}

double measure_rig_f_number(const struct rig *rig) {
    int32_t position = 0;
    return rig_optics_position(rig, RIG_LEFT, LENS_IRIS, &position) == ERROR_OK
               ? f_number_at(rig, position)
               : 0;
}

double measure_rig_dark_part(const struct pair_frame *left, const struct measure_step *step,
                             double size_px) {
    const struct raw_image *image = &left->image;
    const bool bridge = left->window.skip > 0;
    const int skip = bridge ? left->window.skip : 1;
    struct measure_box box = {0, 0, image->width_px, image->height_px};
    if (step->has_place && size_px > 0) {
        const double *place_px = step->place_px[RIG_LEFT];
        box =
            (struct measure_box){(int)((place_px[0] - size_px / 2 - left->window.column_px) / skip),
                                 (int)((place_px[1] - size_px / 2 - left->window.row_px) / skip),
                                 (int)(size_px / skip), (int)(size_px / skip)};
    }
    return measure_dark_permille(image, bridge ? BLACK_Q10 : 0, &box) / 1e3;
}

double measure_rig_subject_px(const struct measure *machine) {
    const struct zoom_calibration *zoom = machine->instrument.calibration;
    return zoom != NULL && machine->width_mm > 0 && machine->distance_mm > 0
               ? zoom_function_value(&zoom->camera[RIG_LEFT], ZOOM_FOCAL,
                                     machine->axes.side[RIG_LEFT].zoom_counts) *
                     machine->width_mm / machine->distance_mm
               : 0;
}

// ---- what searches found

static const char too_dark[] = "too dark";  // in the answer of autoexpose, or in its error

static void catch_number(void *cookie, const char *key, double value, int decimals,
                         const char *unit) {
    struct measure_rig_light *self = cookie;
    (void)decimals;
    (void)unit;
    if (key != NULL && strcmp(key, "mean") == 0) {
        self->mean_percent = self->mean_percent > 0 ? math_min(self->mean_percent, value) : value;
    }
}

static void catch_text(void *cookie, const char *key, const char *value) {
    struct measure_rig_light *self = cookie;
    if (key != NULL && strcmp(key, "limit") == 0 && strstr(value, too_dark) != NULL) {
        self->too_dark = true;
    }
}

static void ignore_begin(void *cookie, const char *key, bool array) {
    (void)cookie;
    (void)key;
    (void)array;
}

static void ignore_end(void *cookie) {
    (void)cookie;
}

struct command_reply measure_rig_light_reply(struct measure_rig_light *self) {
    static const struct command_reply_operations operations = {catch_number, catch_text,
                                                               ignore_begin, ignore_end};
    return (struct command_reply){&operations, self};
}

static void read_focus(const struct rig *rig, struct measure_event *event) {
    const double found = rig->camera[RIG_LEFT].focus.search.result.position;
    double distance_mm = 0;
    if (rig_optics_distance_at(rig, RIG_LEFT, (int32_t)math_round(found), &distance_mm) ==
            ERROR_OK &&
        distance_mm < INFINITY) {
        event->focus_mm = distance_mm;
    }
}

void measure_rig_read_search(const struct rig *rig, const struct measure_step *step,
                             const struct measure_rig_light *light, const char *why,
                             struct measure_event *event) {
    static const double target_percent = 50;
    const struct rig_camera *camera = &rig->camera[RIG_LEFT];
    if (step->kind == MEASURE_STEP_AUTOFOCUS && event->error == ERROR_OK) {
        read_focus(rig, event);
    } else if (step->kind == MEASURE_STEP_LIGHT) {
        // A camera without the controls exposes on its own.
        event->error = event->error == ERROR_UNSUPPORTED ? ERROR_OK : event->error;
        event->light.exposure_us = camera->exposure_us;
        event->light.gain = camera->gain_q3 / 8.0;
        event->light.reached =
            light->too_dark || (event->error == ERROR_RANGE && strstr(why, too_dark) != NULL)
                ? math_max(1e-3, light->mean_percent / target_percent)
                : 1;
    }
}

// ---- steps as commands

static struct command_text next_line(struct measure_rig_lines *lines) {
    INVARIANT(lines->count < MEASURE_RIG_LINES_MAX);
    return command_text_begin(lines->line[lines->count++], MEASURE_RIG_LINE_BYTES);
}

static void add_move(const char *axis, const int32_t position[RIG_SIDES],
                     struct measure_rig_lines *lines) {
    struct command_text line = next_line(lines);
    command_text_print(&line, "%s %d right=%d", axis, (int)position[RIG_LEFT],
                       (int)position[RIG_RIGHT]);
}

static int32_t within(const struct lens_axis_settings *axis, double counts) {
    return (int32_t)math_clamp(math_round(counts), axis->min, axis->max);
}

static void add_zoom_or_focus(const struct rig *rig, const struct measure_step *step,
                              struct measure_rig_lines *lines) {
    const bool zoom = step->kind == MEASURE_STEP_ZOOM;
    const enum lens_axis axis = zoom ? LENS_ZOOM : LENS_FOCUS;
    int32_t position[RIG_SIDES];
    for (int side = 0; side < RIG_SIDES; side++) {
        const struct zoom_camera_state *to = &step->axes.side[side];
        position[side] =
            within(&rig->profile.lens.axis[axis], zoom ? to->zoom_counts : to->focus_counts);
    }
    add_move(lens_axis_names[axis], position, lines);
}

static void add_iris(const struct rig *rig, double f_number, struct measure_rig_lines *lines) {
    const struct lens_axis_settings *axis = &rig->profile.lens.axis[LENS_IRIS];
    int32_t position[RIG_SIDES];
    for (int side = 0; side < RIG_SIDES; side++) {
        const int error = rig_optics_iris_for(rig, (unsigned)side, f_number, &position[side]);
        if (error != ERROR_OK) {  // beyond an end by rounding, or by what the lens has learned
            double open = 0;
            (void)rig_optics_f_number(rig, (unsigned)side, axis->max, &open);
            position[side] = f_number <= open ? axis->max : axis->min;
        }
    }
    add_move(lens_axis_names[LENS_IRIS], position, lines);
}

// A square around a place, on the sensor and with even corners.
static void add_region(double x_px, double y_px, double size_px, struct command_text *line) {
    const int size = (int)size_px / 2 * 2;
    const int column = (int)math_max(0, math_min(MT9T001_WIDTH_PX - size, x_px - size / 2.0));
    const int row = (int)math_max(0, math_min(MT9T001_HEIGHT_PX - size, y_px - size / 2.0));
    command_text_print(line, " region=%d,%d,%d,%d", column / 2 * 2, row / 2 * 2, size, size);
}

// A search for both sides with one region between the places, or for one side after the other
// where they are too far apart for that.
static void add_search(const char *command, const struct measure_step *step, double size_px,
                       struct measure_rig_lines *lines) {
    const double(*place)[2] = step->place_px;
    const bool close = fabs(place[0][0] - place[1][0]) < size_px / 3 &&
                       fabs(place[0][1] - place[1][1]) < size_px / 3;
    if (close || !step->has_place) {
        struct command_text line = next_line(lines);
        command_text_add(&line, command);
        if (step->has_place) {
            add_region((place[0][0] + place[1][0]) / 2, (place[0][1] + place[1][1]) / 2, size_px,
                       &line);
        }
        return;
    }
    for (int side = 0; side < RIG_SIDES; side++) {
        struct command_text line = next_line(lines);
        command_text_join(&line, command, " side=", rig_side_names[side]);
        add_region(place[side][0], place[side][1], size_px, &line);
    }
}

static void add_light(const struct measure_step *step, double size_px,
                      struct measure_rig_lines *lines) {
    struct measure_step around = *step;
    const double most_px = MT9T001_HEIGHT_PX;
    around.has_place = step->has_place && size_px > 0 && size_px < most_px;
    add_search(step->keep_iris ? "autoexpose iris=no" : "autoexpose", &around,
               math_max(LIGHT_REGION_MIN_PX, size_px), lines);
}

static void add_capture(const struct measure_step *step, const char *session,
                        struct measure_rig_lines *lines) {
    struct command_text line = next_line(lines);
    command_text_add(&line, "capture");
    if (session != NULL) {
        command_text_join(&line, " ", session, " add=yes");
    }
    command_text_print(&line, " readings=%d", PAIR_READINGS);
    if (step->phase == MEASURE_PAIR) {  // merged frames are compared anyway
        command_text_add(&line, " static=yes");
    }
    if (step->bracket > 0) {
        command_text_print(&line, " bracket=%u", step->bracket);
    } else if (step->average > 0) {
        command_text_print(&line, " average=%u", step->average);
    }
}

void measure_rig_lines_of(const struct rig *rig, const struct measure_step *step,
                          const char *session, double size_px, struct measure_rig_lines *lines) {
    struct command_text line;
    lines->count = 0;
    switch (step->kind) {
        case MEASURE_STEP_BRINGUP:
            line = next_line(lines);
            command_text_add(&line, COMMANDS_BRINGUP);
            break;
        case MEASURE_STEP_AIM:
            line = next_line(lines);
            command_text_print(&line, "pan %.4f right=%.4f",
                               step->axes.side[RIG_LEFT].pan_rad * MATH_DEGREE_PER_RAD,
                               step->axes.side[RIG_RIGHT].pan_rad * MATH_DEGREE_PER_RAD);
            break;
        case MEASURE_STEP_ZOOM:
        case MEASURE_STEP_FOCUS:
            add_zoom_or_focus(rig, step, lines);
            break;
        case MEASURE_STEP_IRIS:
            add_iris(rig, step->f_number, lines);
            break;
        case MEASURE_STEP_AUTOFOCUS:
            add_search("autofocus", step, FOCUS_REGION_PX, lines);
            break;
        case MEASURE_STEP_LIGHT:
            add_light(step, size_px, lines);
            break;
        case MEASURE_STEP_PAIR:
            add_capture(step, session, lines);
            break;
        case MEASURE_STEP_LOOK:
        case MEASURE_STEP_SURFACE:
        case MEASURE_STEP_END:
            break;
    }
}
