// SPDX-License-Identifier: Apache-2.0
// The curve of sharpness against focus as a drawing and a table.
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "console/commands.h"
#include "daemon/commands/commands.h"
#include "daemon/commands/files.h"
#include "daemon/images/focus_plot.h"
#include "rig/rig_optics.h"

enum { CURVE_SIDE, CURVE_REGION, CURVE_MEASURE, CURVE_LAST, CURVE_ARGUMENTS };
enum { ABOUT_BYTES = 160 };

/// The lenses drawn, and their files, as a job for the disk writer.
struct drawing {
    const struct command_call *call;
    struct focus_plot plots[RIG_SIDES];
    char about[RIG_SIDES][ABOUT_BYTES];
    int count;
    char name[FILES_NAME_MAX + 1];
    char table[FILES_NAME_MAX + 1];
    int error;
};

/// Sweeps the wanted lenses by the rig's own command, so that recordings contain it.
static int sweep(const struct command_call *call) {
    static const char *const words[] = {"variance", "normalized", "tenengrad", "laplacian"};
    static const char *const sides[] = {"left", "right", "both"};
    const struct command_value *values = call->values;
    char line[COMMAND_LINE_MAX + 1] = "autofocus curve=yes";
    size_t used = strlen(line);
    if (values[CURVE_SIDE].given) {
        used += (size_t)snprintf(line + used, sizeof line - used, " side=%s",
                                 sides[values[CURVE_SIDE].choice]);
    }
    if (values[CURVE_MEASURE].given) {
        used += (size_t)snprintf(line + used, sizeof line - used, " measure=%s",
                                 words[values[CURVE_MEASURE].choice]);
    }
    if (values[CURVE_REGION].given) {
        const double *numbers = values[CURVE_REGION].numbers;
        snprintf(line + used, sizeof line - used, " region=%.0f,%.0f,%.0f,%.0f", numbers[0],
                 numbers[1], numbers[2], numbers[3]);
    }
    return command_give(call, line, call->reply);
}

static void add_plot(struct drawing *self, unsigned side) {
    const struct rig *rig = self->call->rig;
    const struct rig_camera *camera = &rig->camera[side];
    const struct rig_rectangle *region = &camera->focus.region_px;
    const struct focus_result *result = &camera->focus.search.result;
    char *about = self->about[side];
    int32_t zoom = 0, iris = 0;
    double distance_mm = 0;
    int used = snprintf(about, ABOUT_BYTES, "region %d x %d px at %d, %d; %u frames in %.1f s",
                        region->width_px, region->height_px, region->column_px, region->row_px,
                        (unsigned)camera->focus.frames, camera->focus.duration_ms / 1000.0);
    if (rig_optics_position(rig, side, LENS_ZOOM, &zoom) == 0 &&
        rig_optics_position(rig, side, LENS_IRIS, &iris) == 0) {
        used += snprintf(about + used, ABOUT_BYTES - (size_t)used, "; zoom %d, iris %d counts",
                         (int)zoom, (int)iris);
    }
    if (result->peak.height > 0 &&
        rig_optics_distance_at(rig, side, (int32_t)(result->peak.position + 0.5), &distance_mm) ==
            0) {
        snprintf(about + used, ABOUT_BYTES - (size_t)used, "; peak at %.0f mm", distance_mm);
    }
    self->plots[self->count++] = (struct focus_plot){
        .name = rig_side_names[side], .about = about, .search = &camera->focus.search};
}

/// Writes one of both files.
static int write_file(struct drawing *self, const char *name,
                      void (*plot)(FILE *stream, const struct focus_plot *plots, int count)) {
    char *text = NULL;
    size_t bytes = 0;
    FILE *stream = open_memstream(&text, &bytes);
    if (stream == NULL) {
        return ERROR_MEMORY;
    }
    plot(stream, self->plots, self->count);
    const bool whole = ferror(stream) == 0;
    const int error =
        fclose(stream) == 0 && whole ? files_write(self->call, name, text, bytes) : ERROR_MEMORY;
    free(text);
    return error;
}

/// On the disk writer's thread.
static void make_files(void *cookie) {
    struct drawing *self = cookie;
    files_name_now(self->call, "focus-curve", ".svg", self->name);
    const size_t stem = strlen(self->name) - strlen(".svg");
    snprintf(self->table, sizeof self->table, "%.*s.csv", (int)stem, self->name);
    self->error = write_file(self, self->name, focus_plot_svg);
    if (self->error == ERROR_OK) {
        self->error = write_file(self, self->table, focus_plot_csv);
    }
}

static int run_focus_curve(const struct command_call *call) {
    static struct drawing drawing;  // one thread has the rig
    const unsigned sides = commands_sides(&call->values[CURVE_SIDE]);
    const bool last = command_is_set(&call->values[CURVE_LAST]);
    int error = files_need_directory(call);
    if (error == ERROR_OK && !last) {
        error = sweep(call);
    }
    if (error != ERROR_OK) {
        return error;
    }
    drawing = (struct drawing){.call = call};
    for (unsigned side = 0; side < RIG_SIDES; side++) {
        if ((sides >> side & 1) != 0 && call->rig->camera[side].focus.search.curve.count > 0) {
            add_plot(&drawing, side);
        }
    }
    if (drawing.count == 0) {
        return command_fail(call, ERROR_MISSING,
                            "focus-curve: no curve has been measured (leave last=yes out)");
    }
    disk_writer_run(&daemon_of(call)->disk_writer, make_files, &drawing);
    if (drawing.error == ERROR_MEMORY) {
        return command_fail(call, ERROR_MEMORY, "focus-curve: out of memory");
    }
    if (drawing.error == ERROR_OK) {
        reply_text(call, "file", drawing.name);
        reply_text(call, "table", drawing.table);
    }
    return drawing.error;
}

static const struct command_argument arguments[CURVE_ARGUMENTS] = {
    [CURVE_SIDE] = {.name = "side",
                    .kind = COMMAND_CHOICE,
                    .choices = COMMANDS_SIDES,
                    .help = "camera; default: both"},
    [CURVE_REGION] = {.name = "region",
                      .kind = COMMAND_INTEGER,
                      .unit = "px",
                      .min = 0,
                      .max = UINT16_MAX,
                      .count = 4,
                      .separator = ',',
                      .value_name = "X,Y,W,H",
                      .help = "part of the sensor to look at, as of autofocus"},
    [CURVE_MEASURE] = {.name = "measure",
                       .kind = COMMAND_CHOICE,
                       .choices = "variance normalized tenengrad laplacian",
                       .help = "what counts as sharp; default: variance"},
    [CURVE_LAST] = {.name = "last",
                    .kind = COMMAND_FLAG,
                    .help = "draw what the last autofocus measured, without moving"},
};

static const struct command commands[] = {
    {.name = "focus-curve",
     .summary = "draw sharpness against focus",
     .help =
         "Sweeps the focus over its whole range and returns it to where it was, or draws the last "
         "autofocus. Writes a drawing (SVG) with both lenses, their peaks and the position of the "
         "ring, and all samples as a table (CSV); vergence --connect fetches both.",
     .arguments = arguments,
     .argument_count = CURVE_ARGUMENTS,
     .flags =
         COMMAND_NEEDS_RIG | COMMAND_LONG | COMMAND_MOVES | COMMAND_UNRECORDED | COMMAND_GROUP_MOVE,
     .run = run_focus_curve},
};

const struct command *commands_focus_curve_table(size_t *count) {
    *count = sizeof commands / sizeof commands[0];
    return commands;
}
