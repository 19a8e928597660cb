// SPDX-License-Identifier: Apache-2.0
#include "memory/reconstruct.h"

#include <math.h>

#include "console/pair/capture.h"
#include "core/error.h"
#include "memory/files.h"
#include "memory/pair.h"
#include "memory/surface.h"

enum { NEAR, FAR, DISPARITY, SCALE, PRESET, ACCEPT, ARGUMENTS };

static const double percent = 100;

/// What is wrong with the search; NULL: nothing.
static const char *search_fault(const struct command_value *values) {
    const bool near = values[NEAR].given, far = values[FAR].given;
    if (far && !(near && values[NEAR].number < values[FAR].number)) {
        return "far requires a near that is less";
    }
    if (!values[DISPARITY].given) {
        return NULL;
    }
    if (near) {
        return "near cannot be combined with disparity";
    }
    return values[DISPARITY].numbers[1] >= 1 ? NULL : "disparity MIN:COUNT is empty";
}

static int choose_options(const struct command_call *call, struct reconstruct_options *options) {
    const struct command_value *values = call->values;
    *options = memory_surface_options();
    options->preset = MATCH_PRESET_BOARD;
    if (values[NEAR].given) {
        options->rectify.depth_near_mm = values[NEAR].number;
        options->rectify.depth_far_mm = values[FAR].given ? values[FAR].number : (double)INFINITY;
    }
    if (values[DISPARITY].given) {
        options->rectify.disparity_min = (int)values[DISPARITY].numbers[0];
        options->rectify.disparity_count = (int)values[DISPARITY].numbers[1];
    }
    options->rectify.scale = values[SCALE].given ? values[SCALE].number : options->rectify.scale;
    if (values[PRESET].given) {
        options->preset = (enum match_preset)values[PRESET].choice;
    }
    const char *fault = search_fault(values);
    return fault == NULL ? ERROR_OK
                         : command_refuse(call, ERROR_ARGUMENT, "reconstruct: %s", fault);
}

static void reply(const struct command_call *call, const struct pair *pair, const char *pair_name,
                  const char *directory, const struct measure_surface *surface) {
    const struct reconstruct_result *result = surface->result;
    const double pixels = (double)result->plan.width_px * result->plan.height_px;
    reply_text(call, "session", pair_name);
    reply_number(call, "pair", pair->number, 0, NULL);
    reply_number(call, "skew", (double)pair->skew_us, 0, "us");
    reply_text(call, "result", directory);
    reply_text(call, "calibration", surface->calibration->id);
    reply_number(call, "width", result->plan.width_px, 0, "px");
    reply_number(call, "height", result->plan.height_px, 0, "px");
    reply_number(call, "disparities", result->plan.disparity_count, 0, NULL);
    reply_number(call, "points", result->vertex_count, 0, NULL);
    reply_number(call, "triangles", result->triangle_count, 0, NULL);
    reply_number(call, "density", percent * result->vertex_count / pixels, 1, "%");
    if (result->vertical.samples > 0) {
        reply_number(call, "rows_apart", result->vertical.median_px, 3, "px");
    }
    reply_number(call, "memory", (double)result->arena_peak_bytes, 0, "bytes");
    reply_number(call, "time", surface->seconds, 2, "s");
}

static int run_reconstruct(const struct command_call *call) {
    const char *pair_name = NULL;
    const struct pair *pair = memory_pair_last(&pair_name);
    struct measure_surface surface;
    char directory[MEMORY_FILE_NAME_BYTES];
    struct command_text name = command_text_begin(directory, sizeof directory);
    struct memory_surface_request request = {
        .command = "reconstruct",
        .directory = directory,
        .accept_mismatch = command_is_set(&call->values[ACCEPT]),
    };
    if (pair == NULL) {
        return command_refuse(call, ERROR_MISSING, "reconstruct: no pair (\"capture\" takes one)");
    }
    command_text_join(&name, "surface-", pair_name);
    int error = choose_options(call, &request.options);
    error = error == ERROR_OK ? memory_surface_make(call, &request, pair, &surface) : error;
    if (error == ERROR_OK) {
        reply(call, pair, pair_name, directory, &surface);
    }
    return error;
}

const struct command *memory_reconstruct_table(size_t *count) {
    static const struct command_argument arguments[ARGUMENTS] = {
        [NEAR] = {.name = "near",
                  .kind = COMMAND_NUMBER,
                  .unit = "mm",
                  .min = 1e-3,
                  .max = 1e6,
                  .help = "minimum depth to search; default: the calibration's range"},
        [FAR] = {.name = "far",
                 .kind = COMMAND_NUMBER,
                 .unit = "mm",
                 .min = 1e-3,
                 .max = INFINITY,
                 .help = "maximum depth to search; default with near: inf"},
        [DISPARITY] = {.name = "disparity",
                       .kind = COMMAND_INTEGER,
                       .value_name = "MIN:COUNT",
                       .min = -MATCH_DISPARITY_LIMIT,
                       .max = MATCH_DISPARITY_LIMIT,
                       .count = 2,
                       .separator = ':',
                       .help = "disparities to search instead of depths"},
        [SCALE] = {.name = "scale",
                   .kind = COMMAND_NUMBER,
                   .min = 0.01,
                   .max = 4,
                   .help = "size of the rectified images relative to the frames; default: 1"},
        [PRESET] = {.name = "preset",
                    .kind = COMMAND_CHOICE,
                    .choices = "fast standard best board paper",
                    .help = "matcher; default: board"},
        [ACCEPT] = {.name = CAPTURE_ACCEPT_NAME,
                    .kind = COMMAND_FLAG,
                    .help = "accept a calibration made with other axes, cameras or windows"},
    };
    static const struct command commands[] = {
        {.name = "reconstruct",
         .summary = "measure a surface from the last pair",
         .help = "Leaves surface.compact in memory until the next capture or reconstruct; "
                 "\"vergence --connect\" fetches it and makes all other files of it.",
         .arguments = arguments,
         .argument_count = ARGUMENTS,
         .flags = COMMAND_LONG | COMMAND_GROUP_MEASURE | COMMAND_DAILY,
         .run = run_reconstruct},
    };
    *count = 1;
    return commands;
}
